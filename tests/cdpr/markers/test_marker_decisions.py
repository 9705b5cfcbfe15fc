"""What is decided of markers, on both sides of every limit, on made numbers."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false
# pyright: reportOptionalSubscript=false, reportReturnType=false

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.markers import (
    exchanged_labels,
    layout_against_target,
    layout_of_session,
    layouts_aligned,
    session_markers,
    spoiling_markers,
)
from freeswing.cdpr.markers.distances import distances, pairs_of
from freeswing.cdpr.markers.marker_jumps import mended
from freeswing.cdpr.markers.marker_units import unit_between
from freeswing.cdpr.markers.slow_residuals import slow_share
from freeswing.cdpr.measured.marker_recording import MarkerRecording
from freeswing.cdpr.measured.target import Marker, Target

SQUARE = np.array([[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, -0.2, 0.05]])


@pytest.mark.parametrize(("off_m", "jumps"), [(0.95e-3, 0), (1.05e-3, 1)])
def test_a_marker_jumps_by_a_millimetre(off_m, jumps):
    points = np.tile(SQUARE, (50, 1, 1))
    points[20, 0, 0] += off_m  # straight away from the second marker
    assert len(mended(points).jumps) == jumps


@pytest.mark.parametrize(("deviations", "jumps"), [(7.8, 0), (8.2, 1)])
def test_or_by_eight_deviations_of_its_distances(deviations, jumps):
    """Three markers in a row, so that distances are as far off as the first of them."""
    points = np.tile(np.array([[0.1, 0, 0], [-0.1, 0, 0], [0.5, 0, 0]]), (101, 1, 1))
    points[:, 0, 0] += 1e-3 / 1.4826 * np.resize([1.0, -1.0, 1.5, -1.5, 0.0], 101)
    points[40, 0, 0] = 0.1 + deviations * 1e-3
    assert len(mended(points).jumps) == jumps


@pytest.mark.parametrize(("factor", "found"), [(1029.0, True), (1031.0, False), (969.0, False)])
def test_a_unit_is_another_within_three_per_cent(factor, found):
    apart = factor * distances(SQUARE, pairs_of(4))
    assert (unit_between(SQUARE, apart) is not None) == found


@pytest.mark.parametrize(
    ("size_m", "wrong"), [(0.019, True), (0.021, False), (9.9, False), (10.1, True)]
)
def test_a_platform_measures_two_centimetres_to_ten_metres(size_m, wrong):
    """Of sizes a thousand times apart, the layout's is wrong where no platform has it."""
    places = SQUARE * size_m / distances(SQUARE, pairs_of(4)).max()
    apart = 1000.0 * distances(places, pairs_of(4))
    assert unit_between(places, apart)[1] == wrong


@pytest.mark.parametrize(("off_m", "looked"), [(4.9e-3, False), (5.1e-3, True)])
def test_labels_that_fit_to_five_millimetres_are_right(monkeypatch, off_m, looked):
    calls = []
    monkeypatch.setattr(
        exchanged_labels, "_orders", lambda n: calls.append(n) or [tuple(range(n))] * 2
    )
    points = np.tile(SQUARE, (5, 1, 1))
    points[:, 0, 0] += off_m
    assert exchanged_labels.renamed(SQUARE, points) is None
    assert bool(calls) == looked


@pytest.mark.parametrize(("times", "renamed"), [(9.5, False), (10.5, True)])
def test_another_order_fits_ten_times_better(monkeypatch, times, renamed):
    orders = [(0, 1, 2, 3), (1, 0, 2, 3), (2, 1, 0, 3)]
    points = np.tile(SQUARE[[1, 0, 2, 3]] * [2.0, 1.0, 1.0], (5, 1, 1))
    fits = iter([1.0, 1.0 / times, 1.0, 1.0])
    monkeypatch.setattr(exchanged_labels, "_orders", lambda _: orders)
    monkeypatch.setattr(exchanged_labels, "_rigid_error", lambda *_: next(fits))
    assert (exchanged_labels.renamed(SQUARE, points) is not None) == renamed


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
    monkeypatch.setattr(spoiling_markers, "_level", lambda *_: level)
    monkeypatch.setattr(spoiling_markers, "_best_without", lambda *_: next(sizes))
    points = np.vstack([SQUARE, [[0.1, 0.1, 0.1]]])
    found = spoiling_markers.rigidity(points, np.tile(points, (20, 1, 1)))
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
    found = layouts_aligned.best_way(
        moves, np.full((2, 4), 1e6), costs, SQUARE, known, layouts_aligned.CLEAR
    )
    assert (found.rival_m > 0.0) == rival


@pytest.mark.parametrize(("open_m", "refused"), [(4.9e-3, False), (5.1e-3, True)])
def test_a_frame_is_open_by_five_millimetres_at_most(monkeypatch, open_m, refused):
    target = Target((), tuple(Marker(f"m{k}", place, 0.01) for k, place in enumerate(SQUARE)))
    onto = layouts_aligned.Alignment(SQUARE, 0 * SQUARE, np.ones(4), np.eye(6), open_m, 0 * SQUARE)
    told = layout_of_session.SessionLayout(SQUARE, 0 * SQUARE, 1e-4, onto)
    monkeypatch.setattr(session_markers, "session_layout", lambda *_: told)
    found = SimpleNamespace(kept_m=1e-4, layout_m=SQUARE, left_out=())
    run = SimpleNamespace(rigidity=found, recording=SimpleNamespace(times_s=np.arange(9.0)))
    if refused:
        with pytest.raises(DataError, match="measure position_m"):
            session_markers.common_layout(target, [run])
        return
    assert session_markers.common_layout(target, [run]) is told


def ball(n: int) -> np.ndarray:
    """Places on a ball of 0.2 m, evenly (n, 3)."""
    height = (np.arange(n) + 0.5) / n * 2.0 - 1.0
    turn = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(n)
    flat = np.sqrt(1.0 - height**2)
    return 0.2 * np.stack([flat * np.cos(turn), flat * np.sin(turn), height], axis=1)


def test_a_marker_that_is_four_scales_off_has_a_fifth_of_the_weight():
    """Student's law with four degrees of freedom: 4 of 4 + 16."""
    places = ball(200)
    off = places.copy()
    off[0] += [0.0, 4e-3, 0.0]
    weights = layouts_aligned.align(off, places, 1e-3).weights
    assert weights[0] / np.median(weights) == pytest.approx(0.2, rel=0.04)


def test_one_run_alone_has_the_usual_change_from_run_to_run():
    found = layout_of_session.session_layout(SQUARE, [SQUARE + 0.1], 1e-6)
    assert found.run_std_m == pytest.approx(0.3e-3, rel=0.05)


def test_a_drawing_is_good_to_a_fiftieth_of_a_millimetre():
    found = layout_against_target.align_to_target(ball(5) + 0.1, ball(5))
    assert np.allclose(1.0 / np.sqrt(found.weights[found.weights > 0.0]), 2e-5, rtol=0.05)


def off_by(off_m: float) -> layouts_aligned.Alignment:
    """Four markers measured beside a drawing, one of whose numbers is wrong."""
    places = np.array([[0.3, 0.0, 0.0], [-0.3, 0.0, 0.0], [0.0, 0.3, 0.0], [0.0, -0.3, 0.3]])
    wrong = places.copy()
    wrong[3, 2] += off_m
    return layout_against_target.align_to_target(places, wrong)


@pytest.mark.parametrize(("off_m", "left_out"), [(2.19e-3, False), (2.255e-3, True)])
def test_a_number_of_a_drawing_is_wrong(off_m, left_out):
    """It is one of twenty and wrong by 2 cm at most, where the others agree to 0.02 mm.

    Likelihoods with and without it are alike at 2.22 mm, and differ by 6 log(off).
    """
    assert (off_by(off_m).weights[3] == 0.0) == left_out


@pytest.mark.parametrize(("off_m", "open_too"), [(4.85e-3, True), (5.37e-3, False)])
def test_that_no_number_is_wrong_stays_open_up_to_odds_of_150(off_m, open_too):
    """6 log(5.11 / 2.22) is 5: log likelihoods that far apart."""
    assert (off_by(off_m).rival_m > 0.0) == open_too


def test_without_its_own_noise_a_marker_is_taken_for_half_as_uncertain_as_the_others():
    rng = np.random.default_rng(3)
    points = np.tile(ball(7), (300, 1, 1))
    points[:, 1:] += 1e-4 * rng.normal(size=(300, 6, 3))
    std = spoiling_markers.rigidity(ball(7), points).std_m
    usual = np.median(np.r_[0.0, std[1:] ** 2])
    assert std[0] ** 2 / usual == pytest.approx(0.25, rel=0.02)


@pytest.mark.parametrize(("samples", "enough"), [(7, False), (8, True)])
def test_eight_samples_with_three_markers(samples, enough):
    target = Target((), tuple(Marker(f"m{k}", place, 0.01) for k, place in enumerate(SQUARE)))
    points = np.tile(SQUARE, (12, 1, 1))
    points[samples:, :2] = np.nan
    names = target.marker_names
    recording = MarkerRecording(0.01 * np.arange(12.0), names, points)
    if enough:
        assert len(session_markers.examine(recording, target).rigidity.layout_m) == 4
        return
    with pytest.raises(DataError, match="no sample shows three markers"):
        session_markers.examine(recording, target)


@pytest.mark.parametrize(("n", "found"), [(3, None), (4, (1, 0, 2, 3))])
def test_labels_of_four_markers_show_an_exchange(n, found):
    """Three alike in two distances may as well be another platform."""
    places = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.5, 0.0], [0.2, 0.1, 0.4]])[:n]
    points = np.tile(places[[1, 0, *range(2, n)]], (20, 1, 1))
    assert exchanged_labels.renamed(places, points) == found
