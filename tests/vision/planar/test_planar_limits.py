"""Which dots, steps and arms of a film from above count: both sides of each limit."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.files.documents import DataError, InputError
from freeswing.cdpr.measured.target import Target
from freeswing.vision.planar import dots as dots_module
from freeswing.vision.planar import film_faults, fit_plane, plane, track_planar
from freeswing.vision.planar.dots import Spots, followed, side_of_dots
from tests.vision.planar.benches_from_above import plate_tag


def stub(**attributes: Any) -> Any:
    return SimpleNamespace(**attributes)


def dots(frames: np.ndarray, places: np.ndarray, count: int) -> int:
    """How many dots one spot at these places, in these frames of so many, is."""
    rays = np.column_stack([places, np.zeros(len(places))])
    spots = Spots(np.asarray(frames), rays, np.zeros((len(rays), 2, 2)))
    return len(followed(spots, count))


@pytest.mark.parametrize(("jump", "found"), [(0.0095, 1), (0.0105, 0)])
def test_a_dot_at_rest_starts_by_ten_pixels(jump, found) -> None:
    """Beyond it is another dot, and both are seen half of the time."""
    frames = np.arange(20)
    assert dots(frames, jump * (frames >= 10), 20) == found


@pytest.mark.parametrize(("times", "found"), [(2.9, 1), (3.1, 0)])
def test_a_dot_leaves_its_prediction_by_three_steps(times, found) -> None:
    frames = np.arange(20)
    assert dots(frames, 0.009 * (frames + times * (frames >= 10)), 20) == found


@pytest.mark.parametrize(("hidden", "found"), [(14, 1), (15, 0)])
def test_a_dot_comes_back_within_fifteen_frames(hidden, found) -> None:
    frames = np.r_[0:30, 30 + hidden : 60 + hidden]
    assert dots(frames, np.zeros(60), 60 + hidden) == found


@pytest.mark.parametrize(("seen", "found"), [(59, 0), (61, 1)])
def test_a_dot_is_seen_in_six_frames_of_ten(seen, found) -> None:
    frames = np.unique(np.linspace(0, 99, seen).astype(int))
    assert dots(frames, np.zeros(seen), 100) == found


TRIPLE_M = np.array([[-0.15, 0.02], [0.16, -0.03], [0.02, 0.13]])


def seen_dots(points: np.ndarray) -> tuple[np.ndarray, Spots]:
    """Points as spots of twenty frames."""
    count = len(points)
    rays = np.tile(points, (20, 1))
    spots = Spots(np.repeat(np.arange(20), count), rays, np.zeros((len(rays), 2, 2)))
    return followed(spots, 20), spots


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_known_dots_show_from_which_side_they_are_seen(side: float) -> None:
    """In an image y goes down; from below the platform is seen as in a mirror."""
    found, spots = seen_dots(0.8 * TRIPLE_M * [1.0, -side])
    assert side_of_dots(found, spots, TRIPLE_M) == side
    pair = TRIPLE_M[:2]
    found, spots = seen_dots(pair * [1.0, -side])
    assert side_of_dots(found, spots, pair) == 1.0, "two dots are their own mirror image"


@pytest.mark.parametrize(("share", "side"), [(0.095, -1.0), (0.105, 1.0)])
def test_dots_that_are_nearly_their_own_mirror_image(monkeypatch, share, side) -> None:
    """The mirror leaves so much of what is left from above."""
    monkeypatch.setattr(dots_module, "_ordered", lambda *those: (
        (1.0 if those[3] > 0.0 else share), []
    ))  # fmt: skip
    found, spots = seen_dots(TRIPLE_M)
    assert side_of_dots(found, spots, TRIPLE_M) == side


def size_said(arm_m: float, times: float, cosine: float) -> bool:
    """Whether a tag of 0.1 m, whose arm is so many times longer by the yaw, is complained of."""
    middle = np.array([arm_m, 0.0])
    centre = middle - times * arm_m * np.array([cosine, np.sqrt(1.0 - cosine**2)])
    chi = 0.2 * np.sin(np.linspace(0.0, 20.0 * np.pi, 401))
    poses = np.column_stack([chi * centre[1], -chi * centre[0], chi])
    return film_faults.size_text(poses, middle, 0.1, "a") is not None


@pytest.mark.parametrize(("arm_m", "said"), [(0.048, False), (0.052, True)])
def test_an_arm_of_half_a_tag_tells_its_size(arm_m, said) -> None:
    assert size_said(arm_m, 2.0, 1.0) == said


@pytest.mark.parametrize(("cosine", "said"), [(0.88, False), (0.92, True)])
def test_a_wrong_size_leaves_the_turning_point_in_its_direction(cosine, said) -> None:
    assert size_said(0.2, 2.0, cosine) == said


@pytest.mark.parametrize(
    ("times", "said"), [(1.55, False), (1.65, True), (0.64, False), (0.61, True)]
)
def test_a_size_that_no_printer_is_off_by(times, said) -> None:
    assert size_said(0.2, times, 1.0) == said


FAST = np.resize([1.0, -1.0], 1000)
SLOWER = np.resize([1.0, 1.0, -1.0, -1.0], 1000)
SLOWEST = np.resize(np.repeat([1.0, -1.0], 4), 1000)


def moved_said(monkeypatch, series: np.ndarray, known: tuple[np.ndarray, ...] = ()) -> bool:
    """Whether a step is found in x beside what oscillations explain."""
    n = len(series)
    base = np.column_stack([np.ones(n), *(one[:n] for one in known)])
    monkeypatch.setattr(film_faults, "_oscillations", lambda *_: base)
    poses = np.column_stack([series, SLOWEST[:n], SLOWEST[:n]])
    return film_faults.moved_text(np.arange(float(n)), poses, "a") is not None


def step(n: int, share: float = 0.5) -> np.ndarray:
    return (np.arange(n) >= round(share * n)).astype(float)


@pytest.mark.parametrize(("samples", "said"), [(79, False), (80, True)])
def test_a_step_is_told_by_eighty_samples(monkeypatch, samples, said) -> None:
    assert moved_said(monkeypatch, step(samples)) == said


@pytest.mark.parametrize(("height", "said"), [(5.8, False), (6.2, True)])
def test_a_step_is_six_times_what_is_left(monkeypatch, height, said) -> None:
    assert moved_said(monkeypatch, height * step(200) + SLOWER[:200]) == said


@pytest.mark.parametrize(("height", "said"), [(0.048, False), (0.052, True)])
def test_a_step_is_a_twentieth_of_the_motion(monkeypatch, height, said) -> None:
    assert moved_said(monkeypatch, height * step(160) + FAST[:160], (FAST,)) == said


@pytest.mark.parametrize(("share", "said"), [(0.47, False), (0.53, True)])
def test_a_step_takes_away_half_of_what_is_left(monkeypatch, share, said) -> None:
    """Oscillations that look like the step already leave a hundredth of it."""
    a2 = 0.04 / 0.96
    like = (2.0 * step(200) - 1.0) + np.sqrt(a2) * FAST[:200]
    height = 10.0 * np.sqrt(share / (1.0 - share))
    assert moved_said(monkeypatch, height * step(200) + SLOWER[:200], (like,)) == said


@pytest.mark.parametrize(("share", "said"), [(0.092, False), (0.104, True)])
def test_a_step_is_an_eighth_from_the_ends(monkeypatch, share, said) -> None:
    """Looked for from 0.12 on: a step at 0.097 or before leaves a sixth of itself there."""
    assert moved_said(monkeypatch, step(1000, share)) == said


@pytest.mark.parametrize(("frames", "enough"), [(39, False), (40, True)])
def test_a_film_shows_the_platform_in_forty_frames(monkeypatch, frames, enough) -> None:
    monkeypatch.setattr(track_planar, "twice_text", lambda *_: None)
    film = stub(
        run=stub(name="a"), recording=stub(path=stub(name="a.mp4")), views=stub(numbers=range(90))
    )
    items = stub(frames=np.repeat(np.arange(frames), 2))
    with nullcontext() if enough else pytest.raises(DataError, match="40 are needed"):
        track_planar._check_seen(film, items, stub())


def test_how_far_phones_and_stands_are_from_straight(monkeypatch) -> None:
    """Focal lengths within a third, bends of a tenth, leans of seventeen degrees."""
    told: list[np.ndarray] = []

    class Reached(Exception):
        pass

    def normal(_, prior):
        told.append(prior)
        raise Reached

    monkeypatch.setattr(fit_plane, "_begun", lambda *_: None)
    monkeypatch.setattr(fit_plane, "_some", lambda _: None)
    monkeypatch.setattr(fit_plane, "_cost", lambda *_: 0.0)
    monkeypatch.setattr(fit_plane, "_normal", normal)
    with pytest.raises(Reached):
        fit_plane.fit_planes([stub()], [1], 1.0, False)
    assert told[0][:4] == pytest.approx([0.35, 0.1, 0.3, 0.3], rel=0.05)


@pytest.mark.parametrize(("dot", "std_mm"), [(False, 0.1), (True, 0.5)])
def test_how_well_places_are_known(monkeypatch, dot, std_mm) -> None:
    """Printed corners to a tenth of a millimetre, the middles of dots to half of one."""
    places = np.zeros((1, 4, 3)) if dot else np.arange(12.0).reshape(1, 4, 3)
    monkeypatch.setattr(fit_plane, "_pull", lambda run, shift: np.eye(6)[0] * shift.any())
    run = stub(items=stub(points_m=places))
    found = fit_plane._by_places([run], np.eye(6))
    ways = 3 if dot else 12  # each point along each axis
    assert np.sqrt(found[0, 0] / ways) == pytest.approx(1e-3 * std_mm, rel=0.05)


def test_points_that_lie_aside_pull_as_much_as_they_miss() -> None:
    """Against the right side of a fit to points that really lie there, by two micrometres."""
    poses = np.column_stack([*0.01 * np.random.default_rng(0).normal(size=(2, 30)), np.zeros(30)])
    poses[:, 2] = 0.15 * np.sin(np.arange(30.0))
    square = np.array([[0.1, 0.1, 0.0], [-0.1, 0.1, 0.0], [-0.1, -0.1, 0.0], [0.1, -0.1, 0.0]])
    items = plane.Items(
        np.arange(30), np.tile(square, (30, 1, 1)), np.zeros((30, 4, 2)),
        np.tile(1e4 * np.eye(8), (30, 1, 1)),
    )  # fmt: skip
    true = plane.Plane(np.array([0.0, 0.0, 0.15, -0.1, 0.2, 0.02]), 1.0, 0.0)
    shift = np.zeros((30, 4, 3))
    shift[:, 1, 0] = 2e-6
    really = items._replace(points_m=items.points_m + shift)
    runs = [items._replace(rays=plane.seen(true, one, poses)) for one in (items, really)]
    prior = np.array([0.35, 0.1, 0.3, 0.3, np.inf, 0.1])
    run = fit_plane._Run(runs[0], true, poses)
    other = fit_plane._Run(runs[1], true, poses)
    pulls = (fit_plane._normal([other], prior)[1] - fit_plane._normal([run], prior)[1]) / 2e-6
    expected = fit_plane._pull(run, shift / 2e-6)
    np.testing.assert_allclose(expected, pulls, atol=1e-3 * np.abs(pulls).max())


@pytest.mark.parametrize(("far_m", "refused"), [(9.9, False), (10.1, True)])
def test_a_tag_beyond_any_platform_is_in_mm(far_m: float, refused: bool) -> None:
    target = Target((plate_tag(at_m=(far_m, 0.0, 0.0)),), ())
    with (
        pytest.raises(InputError, match=r"tag tag36h11 3 is 10\.1 m") if refused else nullcontext()
    ):
        track_planar._watch(target)
