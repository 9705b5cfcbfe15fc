"""Planning swings: limits, cost, exact gradients, exchange, refinement, information."""

from dataclasses import replace

import numpy as np
import pytest

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.files.robot_file import write_robot
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.statics import equilibrium_at_lengths
from freeswing.cdpr.robot import Platform
from freeswing.excite.choose_swings import (
    choose,
    excitation_cost,
    stacked_cost,
)
from freeswing.excite.excite import ExcitationOptions, excite, make_bench
from freeswing.excite.information import predicted_std, swing_information
from freeswing.excite.plan import check_options
from freeswing.excite.refine_plan import plan_cost, refine, smooth_cost
from freeswing.excite.swing import SwingLimits, keeps_limits, released, swing_from
from freeswing.excite.swing_gradient import (
    Differentiator,
    equilibrium_by_release,
    lagrange_regressor,
)
from tests.excite.excitation_bench import bologna_4, paper_bench, swings

PAPER_COST = 5.94
TABLE_2 = [
    [1.66, 1.86, 1.68, 1.41],
    [1.11, 1.68, 2.19, 1.72],
    [1.52, 1.12, 1.17, 1.54],
]


@pytest.mark.parametrize("lengths", TABLE_2)
def test_12_kg_keep_the_papers_equilibria_within_its_limits(lengths):
    bench = paper_bench()
    start = np.append(bench.model.robot.entries_m.mean(axis=0) - [0, 0, 1.0], np.zeros(3))
    rest = equilibrium_at_lengths(bench.model, np.array(lengths), start, bench.inertia)
    tensions = 12.0 * rest.tensions
    assert rest.stable
    assert tensions.min() > 20, f"lowest tension {tensions.min():.1f} N"
    assert tensions.max() < 200, f"highest tension {tensions.max():.1f} N"


def test_random_swings_keep_their_limits_along_an_independent_grid():
    bench = paper_bench()
    for swing in swings(4):
        assert keeps_limits(bench, swing)
        course = bench.course(swing.release, 10.0, 1e-10)
        times = np.random.default_rng(0).uniform(0, 10, 3000)
        tensions = 12.0 * course.motion.tensions(times)
        assert tensions.min() > 19.9, f"tension falls to {tensions.min():.2f} N"
        assert tensions.max() < 200.1, f"tension rises to {tensions.max():.2f} N"
        away = np.abs(course.motion.at(times)[0][:, :2] - swing.equilibrium.zeta[:2]).max()
        assert away < 0.1001, f"x or y departs by {away:.4f} m"


def test_regressor_from_lagrange_is_the_closed_form():
    bench = paper_bench()
    motion = bench.course(swings(1)[0].release, 10.0).motion
    closed = bench.regressor(motion)
    found = evaluate(lagrange_regressor(bench.model, (0, 1)), *motion.at(bench.times_s))[0]
    worst = np.abs(found - closed).max() / np.abs(closed).max()
    assert worst < 1e-12, f"eq. (19) and Lagrange differ by {worst:.1e}"


def test_nominal_parameters_lie_in_the_kernel_of_w():
    bench, chi = paper_bench(), np.concatenate([[1.0], bologna_4().inertia])
    stacked = bench.regressor(bench.course(swings(1)[0].release, 10.0, 1e-10).motion)
    worst = np.abs(stacked @ chi).max() / np.abs(stacked).max()
    assert worst < 1e-8, f"W chi is {worst:.1e} of W"


def test_cost_of_grams_is_that_of_the_stacked_regressor():
    bench, plan = paper_bench(), swings(4)
    stacked = [bench.regressor(bench.course(s.release, 10.0).motion) for s in plan]
    expected = stacked_cost(np.concatenate(stacked).reshape(-1, 10))
    found = plan_cost(bench, plan)
    assert abs(found / expected - 1) < 1e-6, f"{found:.6f} and {expected:.6f}"


def test_slopes_are_differences():
    bench, swing, step = paper_bench(), swings(1)[0], 1e-6
    exact = Differentiator(bench).slopes(swing)
    for k in range(6):
        move = step * np.eye(6)[k]
        up, down = (_fine(bench, swing, swing.release + s * move) for s in (1, -1))
        rate = (up["gram"] - down["gram"]) / (2 * step)
        worst = np.abs(rate - exact.gram[..., k]).max() / np.abs(exact.gram[..., k]).max()
        assert worst < 1e-4, f"W^T W by release coordinate {k}: {worst:.1e}"
        rate = (up["reach"] - down["reach"]) / (2 * step) / 0.1
        worst = np.abs(rate - exact.excess_by[8:, k]).max()
        assert worst < 1e-3, f"reach by release coordinate {k}: {worst:.1e}"
        rate = (up["tension"] - down["tension"]) / (2 * step) / 180.0
        worst = np.abs(rate - exact.excess_by[:4, k]).max()
        assert worst < 1e-2 * np.abs(exact.excess_by[:4]).max(), f"tension, {k}: {worst:.1e}"


def _fine(bench, swing, release):
    course = bench.course(release, 10.0, 1e-12)
    stacked = bench.regressor(course.motion)
    rest = swing_from(bench, release, swing.equilibrium).equilibrium.zeta
    return {
        "gram": np.einsum("tij,tik->jk", stacked, stacked),
        "reach": np.abs(course.zetas[:, :2] - rest[:2]).max(axis=0),
        "tension": course.tensions_N.max(axis=0),
    }


def test_equilibrium_follows_the_release_through_the_lengths():
    bench, swing, step = paper_bench(), swings(1)[0], 1e-6
    exact = equilibrium_by_release(bench, swing.equilibrium, swing.release)
    for k in range(6):
        move = step * np.eye(6)[k]
        up, down = (
            equilibrium_at_lengths(
                bench.model,
                bench.lengths(swing.release + s * move),
                swing.equilibrium.zeta,
                bench.inertia,
            ).zeta
            for s in (1, -1)
        )
        worst = np.abs((up - down) / (2 * step) - exact[:, k]).max()
        assert worst < 1e-5, f"equilibrium by release coordinate {k}: {worst:.1e}"


def test_smooth_cost_and_its_gradient():
    rng = np.random.default_rng(0)
    root = rng.standard_normal((9, 12))
    by = rng.standard_normal((5, 9, 9))
    by = by + by.swapaxes(1, 2)
    total, point = root @ root.T + 5 * np.eye(9), 0.05 * rng.standard_normal(5)
    value, slope = smooth_cost(total, by, point)
    steps = [
        (smooth_cost(total, by, point + d)[0] - smooth_cost(total, by, point - d)[0]) / 2e-6
        for d in 1e-6 * np.eye(5)
    ]
    assert np.allclose(slope, steps, rtol=1e-5, atol=1e-8), f"{slope} and {steps}"
    sharp = np.log(excitation_cost(total + np.tensordot(point, by, axes=1)))
    assert 0 <= value - sharp < 0.2, f"smooth {value:.3f}, sharp {sharp:.3f}"


def test_exchange_never_loses_and_ends_where_no_exchange_helps():
    rng = np.random.default_rng(0)
    roots = rng.standard_normal((30, 9, 4))
    matrices = roots @ roots.swapaxes(1, 2)
    found = choose(matrices, 6, rng)
    plan = list(found.indices)
    rest = matrices[plan].sum(axis=0)
    others = [k for k in range(30) if k not in plan]
    best = min(excitation_cost(rest - matrices[i] + matrices[o]) for i in plan for o in others)
    assert best >= found.cost * (1 - 1e-9), f"an exchange leads from {found.cost} to {best}"


def test_a_release_keeps_the_lengths():
    bench, rest = paper_bench(), swings(1)[0].equilibrium
    pose = released(bench, rest, np.array([0.03, -0.02]))
    gap = np.abs(bench.lengths(pose) - rest.lengths_m).max()
    assert gap < 1e-11, f"lengths change by {gap:.1e} m"


@pytest.mark.slow
def test_refinement_lowers_c_within_the_limits():
    bench, plan = paper_bench(), swings(6)
    found = refine(bench, plan, 2)
    assert found.cost < found.history[0] * 0.98, f"C went {found.history}"
    assert all(keeps_limits(bench, swing) for swing in found.swings)


def test_one_swing_alone_excites_poorly():
    bench, plan = paper_bench(), swings(6)
    alone, together = plan_cost(bench, plan[:1]), plan_cost(bench, plan)
    assert alone > 5 * together, f"C is {alone:.0f} for one swing, {together:.1f} for six"


def test_information_is_that_of_a_fit_and_adds_up():
    bench, plan = paper_bench(), swings(4)
    told = [swing_information(bench, swing) for swing in plan]
    for one in told:
        least = np.linalg.eigvalsh(one)[0] / np.trace(one)
        assert least > -1e-12, f"information has the eigenvalue {least:.1e} of its trace"
    few, many = predicted_std(sum(told[:3])), predicted_std(sum(told))
    assert (many < few).all(), f"a fourth swing widens {few} to {many}"


@pytest.mark.slow
def test_tables_are_made_and_c_is_below_the_papers(tmp_path):
    write_robot(tmp_path / "robot.toml", bologna_4())
    options = ExcitationOptions(n_library=20, n_starts=5, rounds=1, n_random=200, seed=1)
    written, files = excite(tmp_path / "robot.toml", options)
    assert written["cost_C"] < PAPER_COST, f"C {written['cost_C']:.2f}"
    assert len(written["equilibria"]) == 12
    assert len(files["excitation.csv"].splitlines()) == 13
    assert files["excitation.svg"].startswith("<svg")
    share = written["random_plans"]["share_below_10"]
    assert share > 0.7, f"only {100 * share:.0f} % of random plans have C below 10"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (ExcitationOptions(n_library=5), "n_library is 5"),
        (ExcitationOptions(n_swings=0), "n_swings is 0"),
        (ExcitationOptions(criterion="trace"), "criterion 'trace'"),
        (ExcitationOptions(limits=SwingLimits(tension_N=(50.0, 20.0))), "tension limits 50 to 20"),
    ],
)
def test_senseless_options_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        check_options(options)


def test_missing_values_are_named():
    robot = bologna_4()
    bare = replace(robot, platform=Platform(12.0))
    with pytest.raises(DataError, match="com_m"):
        make_bench(bare, ExcitationOptions())
    massless = replace(robot, platform=Platform(None, robot.platform.com_m, robot.inertia[3:]))
    with pytest.raises(DataError, match="mass_kg"):
        make_bench(massless, ExcitationOptions())


def test_limits_that_nothing_keeps_are_an_error():
    bench = replace(paper_bench(), limits=SwingLimits(tension_N=(500.0, 600.0)))
    from freeswing.excite.random_swings import random_swing

    with pytest.raises(ValueError, match="within the limits"):
        random_swing(bench, np.random.default_rng(0), 20)
