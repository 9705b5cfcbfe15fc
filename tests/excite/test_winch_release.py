"""Letting go by winch: the motion ends, locked, in the wanted swing, cables taut throughout."""

import numpy as np

from freeswing.cdpr.simulation.free_swing import simulate
from freeswing.excite.winch_release import Strokes, driven_model, winch_release
from tests.excite.excitation_bench import paper_bench, swings

SHAPES = Strokes(2.0, (1.2, 2.5))


def test_strokes_begin_and_end_at_rest():
    times = np.array([0.0, 1e-3, 2.0 - 1e-3, 2.0])
    shapes = SHAPES.at(times)
    assert np.allclose(shapes[[0, 3]], 0, atol=1e-15)
    assert np.abs(shapes[[1, 2]]).max() < 1e-7, f"{shapes}"


def test_winches_that_stand_still_leave_the_free_motion():
    bench, swing = paper_bench(), swings(1)[0]
    driven = driven_model(bench.model, SHAPES)
    strokes = np.zeros(SHAPES.count * 4)
    moved = simulate(driven, swing.release, np.zeros(6), (0, 2.0), bench.inertia, strokes)
    times = np.linspace(0, 2, 50)
    free = bench.course(swing.release, 2.0, 1e-10).motion
    worst = np.abs(moved.at(times)[0] - free.at(times)[0]).max()
    assert worst < 1e-8, f"differs from the free motion by {worst:.1e}"


def test_driven_lengths_are_those_told():
    bench, swing = paper_bench(), swings(1)[0]
    driven = driven_model(bench.model, SHAPES)
    strokes = 0.005 * np.random.default_rng(0).standard_normal(SHAPES.count * 4)
    rest = swing.equilibrium
    motion = simulate(driven, rest.zeta, np.zeros(6), (0, 2.0), bench.inertia, strokes)
    times = np.linspace(0, 2, 80)
    told = rest.lengths_m + SHAPES.at(times) @ strokes.reshape(SHAPES.count, 4)
    worst = np.abs(bench.lengths(motion.at(times)[0]) - told).max()
    assert worst < 1e-8, f"cables depart from their commands by {worst:.1e} m"


def test_the_release_ends_in_the_wanted_swing():
    bench, swing = paper_bench(), swings(2)[1]
    found = winch_release(bench, swing)
    assert found.miss[0] < 1e-7, f"pose missed by {found.miss[0]:.1e}"
    assert found.miss[1] < 1e-6, f"rates missed by {found.miss[1]:.1e}"
    assert found.tension_N[0] >= 20, f"tension falls to {found.tension_N[0]:.1f} N"
    assert found.tension_N[1] <= 200, f"tension rises to {found.tension_N[1]:.1f} N"
    gap = np.abs(found.lengths_m[[0, -1]] - swing.equilibrium.lengths_m).max()
    assert gap < 1e-12, f"the winches start or stop {gap:.1e} m from the swing's lengths"
