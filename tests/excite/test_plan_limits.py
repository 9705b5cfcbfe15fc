"""What a plan takes, and what is worth a word: both sides of each limit, without any robot."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.excite import bench_plan, bench_table, plan_tables
from freeswing.excite.bench_plan import BenchCase, bench_case

CASE = BenchCase(1.26, 0.04, 0.8, 0.0093, 0.25, 1.2, 0.4)


@pytest.mark.parametrize(("loss", "taken_s"), [(1.015, 10.0), (1.025, 20.0)])
def test_time_is_not_spent_for_a_fiftieth_of_a_deviation(monkeypatch, loss, taken_s) -> None:
    """Runs of 10 s are so much worse than those of 20 s, and longer ones are no better."""
    monkeypatch.setattr(
        bench_plan, "deviations", lambda case: {"total": loss if case.duration_s < 20.0 else 1.0}
    )
    best, _ = bench_plan.planned(CASE)
    assert best.duration_s == taken_s


@pytest.mark.parametrize(("share", "told"), [(0.018, False), (0.022, True)])
def test_sources_far_below_the_largest_are_not_told(share, told) -> None:
    document = {
        "choices": [],
        "percent": 1.0,
        "sources": [{"what": "wires", "percent": 1.0}, {"what": "clock", "percent": share}],
    }
    assert any("clock" in line for line in bench_table.bench_words(document)) == told


def test_bodies_of_which_nothing_is_said_are_a_disc_and_a_small_object() -> None:
    """Full discs, m r^2 / 2: as wide as the wires, and 0.45 as wide."""
    ends = 0.3 * np.array([[1.0, 0.0, 0.0], [-0.5, 0.75**0.5, 0.0], [-0.5, -(0.75**0.5), 0.0]])
    robot = SimpleNamespace(
        attachments_m=ends, entries_m=ends + np.array([0.0, 0.0, 1.0]),
        platform=SimpleNamespace(mass_kg=2.0, specific_inertia_m2=None),
    )  # fmt: skip
    case = bench_case(robot, None, None)
    disc, small = 0.5 * 2.0 * 0.3**2, 0.5 * 2.0 * (0.45 * 0.3) ** 2
    assert case.izz_kg_m2 == pytest.approx(disc, rel=0.1)
    assert case.load_izz_kg_m2 == pytest.approx(small, rel=0.15)


@pytest.mark.parametrize(("cost", "share"), [(9.5, 1.0), (10.5, 0.0)])
def test_random_plans_are_good_below_the_papers_ten(cost, share) -> None:
    plan = SimpleNamespace(
        cost=5.0, swings=(), releases=(), std=np.ones(9), start_costs=(), history=(),
        seconds=(0.0, 0.0, 0.0), random=np.full(3, cost),
    )  # fmt: skip
    bench = SimpleNamespace(free=(), n_samples=1, duration_s=1.0, mass_kg=1.0)
    limits = SimpleNamespace(tension_N=(1.0, 2.0), reach_m=1.0, amplification=1.0)
    options = SimpleNamespace(criterion="C", limits=limits)
    document = plan_tables.plan_document(bench, options, plan)
    assert document["random_plans"]["share_below_10"] == share
