"""What is decided of markers, on both sides of every limit, on made numbers."""

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.markers import layout, rigidity, session_markers, spacing
from freeswing.cdpr.markers.slow_residuals import slow_share
from freeswing.cdpr.measured.target import Marker, Target

SQUARE = np.array([[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, -0.2, 0.05]])


@pytest.mark.parametrize(("off_m", "jumps"), [(0.95e-3, 0), (1.05e-3, 1)])
def test_a_marker_jumps_by_a_millimetre(off_m, jumps):
    points = np.tile(SQUARE, (50, 1, 1))
    points[20, 0, 0] += off_m  # straight away from the second marker
    assert len(spacing.mended(points).jumps) == jumps


@pytest.mark.parametrize(("deviations", "jumps"), [(7.8, 0), (8.2, 1)])
def test_or_by_eight_deviations_of_its_distances(deviations, jumps):
    """Three markers in a row, so that distances are as far off as the first of them."""
    points = np.tile(np.array([[0.1, 0, 0], [-0.1, 0, 0], [0.5, 0, 0]]), (101, 1, 1))
    points[:, 0, 0] += 1e-3 / 1.4826 * np.resize([1.0, -1.0, 1.5, -1.5, 0.0], 101)
    points[40, 0, 0] = 0.1 + deviations * 1e-3
    assert len(spacing.mended(points).jumps) == jumps


@pytest.mark.parametrize(("factor", "found"), [(1029.0, True), (1031.0, False), (969.0, False)])
def test_a_unit_is_another_within_three_per_cent(factor, found):
    apart = factor * spacing.distances(SQUARE, spacing.pairs_of(4))
    assert (spacing.unit_between(SQUARE, apart) is not None) == found


@pytest.mark.parametrize(
    ("size_m", "wrong"), [(0.019, True), (0.021, False), (9.9, False), (10.1, True)]
)
def test_a_platform_measures_two_centimetres_to_ten_metres(size_m, wrong):
    """Of sizes a thousand times apart, the layout's is wrong where no platform has it."""
    places = SQUARE * size_m / spacing.distances(SQUARE, spacing.pairs_of(4)).max()
    apart = 1000.0 * spacing.distances(places, spacing.pairs_of(4))
    assert spacing.unit_between(places, apart)[1] == wrong


@pytest.mark.parametrize(("off_m", "looked"), [(4.9e-3, False), (5.1e-3, True)])
def test_labels_that_fit_to_five_millimetres_are_right(monkeypatch, off_m, looked):
    calls = []
    monkeypatch.setattr(spacing, "_orders", lambda n: calls.append(n) or [tuple(range(n))] * 2)
    points = np.tile(SQUARE, (5, 1, 1))
    points[:, 0, 0] += off_m
    assert spacing.renamed(SQUARE, points) is None
    assert bool(calls) == looked


@pytest.mark.parametrize(("times", "renamed"), [(9.5, False), (10.5, True)])
def test_another_order_fits_ten_times_better(monkeypatch, times, renamed):
    orders = [(0, 1, 2, 3), (1, 0, 2, 3), (2, 1, 0, 3)]
    points = np.tile(SQUARE[[1, 0, 2, 3]] * [2.0, 1.0, 1.0], (5, 1, 1))
    fits = iter([1.0, 1.0 / times, 1.0, 1.0])
    monkeypatch.setattr(spacing, "_orders", lambda _: orders)
    monkeypatch.setattr(spacing, "_rigid_error", lambda *_: next(fits))
    assert (spacing.renamed(SQUARE, points) is not None) == renamed


@pytest.mark.parametrize(
    ("level", "without", "left"),
    [
        (1.95e-4, 1e-4, 0),
        (2.05e-4, 1e-4, 1),  # twice as well without it
        (1.95e-5, 1e-6, 0),
        (2.05e-5, 1e-6, 1),  # and by more than noise is worth
    ],
)
def test_a_marker_spoils_a_run(monkeypatch, level, without, left):
    sizes = iter([(3, without), (-1, without)])
    monkeypatch.setattr(rigidity, "_level", lambda *_: level)
    monkeypatch.setattr(rigidity, "_best_without", lambda *_: next(sizes))
    points = np.vstack([SQUARE, [[0.1, 0.1, 0.1]]])
    found = rigidity.rigidity(points, np.tile(points, (20, 1, 1)))
    assert len(found.left_out) == left


@pytest.mark.parametrize(("share", "slow"), [(2.9, False), (3.1, True)])
def test_neighbours_correlate_by_three_deviations_of_chance(share, slow):
    """Numbers of unit variance whose neighbours' products have exactly the mean that is wanted."""
    n = 401
    values = np.ones(n)
    same = round(0.5 * (n - 1) * (1.0 + share / np.sqrt(n - 1)))
    values[1:] = np.cumprod(np.r_[np.ones(same), -np.ones(n - 1 - same)])
    residuals = np.full((n, 1, 1), np.nan)
    residuals[:, 0, 0] = values
    assert (slow_share(residuals, 0.01)[0] > 0.0) == slow


@pytest.mark.parametrize(
    ("behind", "apart_m", "rival"),
    [(2.9, 0.01, True), (3.1, 0.01, False), (0.0, 0.95e-3, False), (0.0, 1.05e-3, True)],
)
def test_another_way_to_lie_on_a_layout_is_a_rival(behind, apart_m, rival):
    """As likely to a factor of twenty, and a millimetre away."""
    moves = np.stack([SQUARE, SQUARE + np.array([apart_m, 0.0, 0.0])])
    known = np.ones(4, dtype=bool)
    costs = np.array([0.0, behind])
    found = layout._best(moves, np.full((2, 4), 1e6), costs, SQUARE, known, layout.CLEAR)
    assert (found.rival_m > 0.0) == rival


@pytest.mark.parametrize(("open_m", "refused"), [(4.9e-3, False), (5.1e-3, True)])
def test_a_frame_is_open_by_five_millimetres_at_most(monkeypatch, open_m, refused):
    target = Target((), tuple(Marker(f"m{k}", place, 0.01) for k, place in enumerate(SQUARE)))
    onto = layout.Alignment(SQUARE, 0 * SQUARE, np.ones(4), np.eye(6), open_m, 0 * SQUARE)
    told = layout.SessionLayout(SQUARE, 0 * SQUARE, 1e-4, onto)
    monkeypatch.setattr(session_markers, "session_layout", lambda *_: told)
    found = SimpleNamespace(kept_m=1e-4, layout_m=SQUARE, left_out=())
    run = SimpleNamespace(rigidity=found, recording=SimpleNamespace(times_s=np.arange(9.0)))
    if refused:
        with pytest.raises(DataError, match="measure position_m"):
            session_markers.common_layout(target, [run])
        return
    assert session_markers.common_layout(target, [run]) is told
