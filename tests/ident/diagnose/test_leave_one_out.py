"""Linear evidence: what a set of unknowns makes of it, with and without each run."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from freeswing.ident.diagnose.leave_one_out import Evidence, score

TRUTH = np.array([0.5, -1.0, 2.0])


def made_evidence(seed, runs=6, rows=200, noise=1.0, coloured=0.0, steep=1.0):
    rng = np.random.default_rng(seed)
    triangles, raw = [], []
    for run in range(runs):
        matrix = rng.normal(size=(rows, 3))
        matrix[:, 2] *= steep if run == 4 else 1.0
        off = coloured * rng.normal(size=3)
        right = -matrix @ (TRUTH + off) + noise * rng.normal(size=rows)
        raw.append((matrix, right))
        triangles.append(np.linalg.qr(np.column_stack([matrix, right]), mode="r"))
    names = tuple(f"r{k}" for k in range(runs))
    counts = np.full(runs, float(rows))
    return Evidence(names, np.array(triangles), counts, np.zeros((0, 4))), raw


def test_score_equals_the_explicit_least_squares():
    evidence, raw = made_evidence(1)
    found = score(evidence)
    matrix, right = (np.concatenate(part) for part in zip(*raw, strict=True))
    expected = -np.linalg.lstsq(matrix, right, rcond=None)[0]
    assert np.abs(found.change - expected).max() < 1e-12, found.change
    cost = np.sum((right + matrix @ expected) ** 2)
    assert found.cost == pytest.approx(cost, rel=1e-12)
    assert found.rank == 3


def test_a_run_left_out_costs_what_it_adds_to_the_others():
    """With the covariance of the prediction: the whole cost less that of the others alone."""
    evidence, raw = made_evidence(2)
    found = score(evidence)
    others = [pair for k, pair in enumerate(raw) if k != 4]
    costs = []
    for pairs in (raw, others):
        matrix, right = (np.concatenate(part) for part in zip(*pairs, strict=True))
        change = -np.linalg.lstsq(matrix, right, rcond=None)[0]
        costs.append((np.sum((right + matrix @ change) ** 2), np.linalg.slogdet(matrix.T @ matrix)))
    (whole, (_, log_whole)), (fewer, (_, log_fewer)) = costs
    assert found.held_out[4] == pytest.approx(whole - fewer, rel=1e-9)
    assert found.wider[4] == pytest.approx(log_whole - log_fewer, rel=1e-9)
    assert found.surprise[4] == found.held_out[4] + found.wider[4]


def test_a_run_that_no_other_tells_anything_of_has_no_veto():
    """Near a singularity one run answers to an unknown a thousand times as much as the others.

    What these leave open of it moves that run by tens of times its noise: no contradiction.
    """
    evidence, raw = made_evidence(10, steep=1e3)
    others = [pair for k, pair in enumerate(raw) if k != 4]
    matrix, right = (np.concatenate(part) for part in zip(*others, strict=True))
    change = -np.linalg.lstsq(matrix, right, rcond=None)[0]
    plain = np.sum((raw[4][1] + raw[4][0] @ change) ** 2)
    found = score(evidence)
    assert plain > 100.0 * evidence.counts[4], plain
    assert found.held_out[4] < 1.2 * evidence.counts[4], found.held_out
    assert 10.0 < found.wider[4] < 20.0, found.wider


def test_what_no_other_run_knows_at_all_costs_nothing():
    """Others that are blind to an unknown let the run say what it is."""
    evidence, _ = made_evidence(8)
    triangles = evidence.triangles.copy()
    triangles[np.arange(6) != 4, :, 2] = 0.0
    found = score(Evidence(evidence.runs, triangles, evidence.counts, evidence.prior_rows))
    assert found.held_out[4] < 1.2 * evidence.counts[4], found.held_out


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_a_column_without_influence_does_not_help_left_out_runs_much(seed):
    evidence, _ = made_evidence(seed)
    fewer = score(evidence.subset(np.array([0, 1])))
    whole = score(evidence)
    assert whole.held_out.sum() < fewer.held_out.sum(), (whole.held_out, fewer.held_out)


def test_jackknife_sees_unknowns_that_differ_from_run_to_run():
    steady = score(made_evidence(3)[0])
    unsteady = score(made_evidence(3, coloured=0.5)[0])
    ratio = unsteady.jackknife_std / unsteady.std
    assert (steady.jackknife_std / steady.std).max() < 3.0, steady.jackknife_std / steady.std
    assert ratio.min() > 2.0, ratio


def test_rank_loss_is_reported():
    evidence, _ = made_evidence(4)
    doubled = evidence.triangles[:, :, [0, 1, 1, 3]]
    found = score(Evidence(evidence.runs, doubled, evidence.counts, evidence.prior_rows))
    assert found.rank == 2, found.rank
