"""Equilibria as a second witness of a displaced point, on runs of the independent integrator."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.ident.diagnose.lengths.equilibria import (
    BESIDE,
    Equilibrium,
    Witness,
    equilibrium,
    heard,
    with_equilibria,
)
from freeswing.ident.diagnose.lengths.joint_lengths import (
    Blocks,
    normal_equations,
    renewed,
    solved,
    total,
)
from freeswing.ident.diagnose.lengths.length_rows import LengthRows, length_rows
from freeswing.ident.diagnose.lengths.place_probabilities import mixed
from freeswing.ident.likelihood.samples_and_noise import prepare
from freeswing.session.load_swings import load_robot, load_swings, load_target
from freeswing.session.session_file import read_session
from tests.oracle.recorded.sessions import make_session

KEY = "attachment_offset:2"
CHANCES = {(KEY,): 1.0}


def session(folder, effects):
    """Model, displaced place (k,), blocks, lengths' normal equations and balances of eight runs."""
    truth = make_session(folder, 31, "bologna-4", effects, n_runs=10, duration_s=5.0, noise_m=2e-5)
    read = read_session(folder)
    robot = load_robot(read)
    model = build_model(robot, ("attachment_offset", "anchor_offset"))
    moved = truth.scene.world.attach - np.array(robot.attachments_m)
    cable = int(np.argmax(np.linalg.norm(moved, axis=1)))
    inertia = np.append(robot.platform.com_m, robot.platform.specific_inertia_m2)  # pyright: ignore[reportArgumentType, reportCallIssue]
    nothing = np.zeros(len(model.parameters))
    samples = [prepare(run, run.window_s) for run in load_swings(read, robot, load_target(read))]  # pyright: ignore[reportArgumentType]
    rows = [length_rows(model, inertia, one, np.ones(2), nothing, {}) for one in samples]
    tolerance = np.repeat([5e-4, 1e-3], 12)
    places = 3 * cable + np.arange(3)
    blocks = Blocks({KEY: places}, tolerance, 12.0 * tolerance)
    balances = [equilibrium(model, inertia, one, nothing) for one in samples]
    return moved[cable], blocks, normal_equations(rows, blocks.gross), balances


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effects", "agrees"),
    [
        ({"swivel_friction": "medium", "rotational_drag": "medium"}, True),
        ({"constant_force": "medium", "gravity_tilt": "medium"}, True),
        ({"tether": "medium"}, False),
    ],
)
def test_equilibria_tell_a_point_whatever_losses_and_constant_forces_act(
    tmp_path, effects, agrees
) -> None:
    """The body is the nominal one, a few percent off: swings' own moments do not matter."""
    truth, blocks, normal, balances = session(tmp_path, {"attachment_offset": "medium", **effects})
    told = heard(normal, blocks, CHANCES, [KEY], balances)
    assert told.witness.agrees == agrees, told.witness
    places = blocks.columns[KEY]
    both = mixed(told.normal, told.blocks, CHANCES, [KEY])
    off = (both.values[places] - truth) / np.sqrt(np.diag(both.covariance)[places])
    assert np.abs(off).max() < 3.0, off
    alone = solved(total(normal), blocks.spread([KEY]))
    narrower = np.diag(both.covariance)[places] / np.diag(alone.covariance)[places]
    if agrees:
        own = (told.witness.values - truth) / told.witness.std
        assert np.abs(own).max() < 3.0, own
        assert narrower.max() < 1.0, narrower
    else:
        assert told.normal is normal


@pytest.mark.parametrize(
    ("explained", "agreement", "agrees"),
    [(0.11, 0.9, True), (0.9, 0.11, True), (0.09, 0.9, False), (0.9, 0.09, False)],
)
def test_witnesses_that_contradict_each_other_are_not_taken_together(
    explained, agreement, agrees
) -> None:
    witness = Witness(np.array([1e-3]), np.array([2e-4]), explained, agreement)
    assert witness.agrees == agrees
    assert "1.0 +- 0.2" in str(witness)
    assert ("contradicts" in str(witness)) != agrees


def rows_and_balances(runs: int = 3) -> tuple[list[LengthRows], list[Equilibrium]]:
    """Random lengths of two cables by two unknowns and a stretch, with balances beside them."""
    rng = np.random.default_rng(4)
    rows, balances = [], []
    for run in range(runs):
        own = np.concatenate(
            [np.broadcast_to(np.eye(2), (30, 2, 2)), rng.normal(size=(30, 2, 6))], axis=2
        )
        right, shared = 1e-3 * rng.normal(size=(30, 2)), rng.normal(size=(30, 2, 3))
        unit = np.broadcast_to(1e-8 * np.eye(2), (30, 2, 2))
        rows.append(LengthRows(f"run-{run}", own, shared, right, unit, unit, 0.0))
        balances.append(
            Equilibrium(
                rng.normal(size=(2, 6)), rng.normal(size=(2, 2 + BESIDE)), rng.normal(size=2)
            )
        )
    return rows, balances


@pytest.mark.parametrize("lengths_too", [True, False])
def test_both_together_are_the_explicit_least_squares(lengths_too: bool) -> None:
    rows, balances = rows_and_balances()
    tolerance = np.array([1.0, 1.0, 2.0])
    blocks = Blocks({KEY: np.array([0, 1])}, tolerance, 12.0 * tolerance)
    normal = renewed(tuple(rows), np.zeros(len(rows)))
    both, wider = with_equilibria(normal, blocks, balances, lengths_too)
    found = solved(total(both), wider.gross)
    runs, size = len(rows), 3 + BESIDE
    equations, rights = (
        [np.diag(1.0 / wider.gross) @ np.eye(size, size + 8 * runs)],
        [np.zeros(size)],
    )
    for k, (one, balance) in enumerate(zip(rows, balances, strict=True)):
        mine = size + 8 * k
        lengths, beside = np.zeros((60, size + 8 * runs)), np.zeros((2, size + 8 * runs))
        lengths[:, :3], lengths[:, mine : mine + 8] = (
            one.shared.reshape(60, 3),
            one.own.reshape(60, 8),
        )
        beside[:, [0, 1, *range(3, size)]] = balance.shared
        beside[:, mine + 2 : mine + 8] = balance.frame
        prior = np.zeros((6, size + 8 * runs))
        prior[:, mine + 2 : mine + 8] = np.eye(6)
        equations += [lengths / 1e-4 if lengths_too else 0.0 * lengths, beside, prior]
        rights += [one.right.reshape(-1) / 1e-4 * lengths_too, balance.right, np.zeros(6)]
    matrix, right = np.vstack(equations), np.concatenate(rights)
    expected = np.linalg.lstsq(matrix, -right, rcond=None)[0][:size]
    assert found.values == pytest.approx(expected, rel=1e-6, abs=1e-8)
