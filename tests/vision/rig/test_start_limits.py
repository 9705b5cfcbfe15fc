"""Which starts, stamps and cameras are compared at all: both sides of each limit."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.files.documents import DataError
from freeswing.vision.rig import correct_rig, lag_accepted, rig_step, stamp_jitter, untied_cameras
from freeswing.vision.rig.lag_accepted import Missed, _chosen, deviations_apart
from freeswing.vision.rig.lag_search import _correlations, _is_plausible
from tests.vision.scenes import camera

VIEW = camera()


class Reached(Exception):
    """What comes after the limit was called."""


def reached(*_: Any, **__: Any) -> Any:
    raise Reached


def stub(**attributes: Any) -> Any:
    return SimpleNamespace(**attributes)


def started(
    monkeypatch, lag_s: float, deviations: float, known_m: float = 0.0
) -> lag_accepted.Aligned:
    """Two cameras of 10 Hz, the second so much later."""
    pair = stub(lag_s=lag_s, at_zero_m=0.1, miss_m=0.001, known_m=known_m)
    view = stub(status=np.zeros(3), camera=VIEW, believed=lambda moved: moved)
    monkeypatch.setattr(lag_accepted, "own_track", lambda _: stub(step_s=0.1))
    monkeypatch.setattr(lag_accepted, "_next", lambda *_: (0, 1, pair))
    monkeypatch.setattr(lag_accepted, "_needed", lambda _: True)
    monkeypatch.setattr(lag_accepted, "_chosen", lambda *_: (lag_s, 0.1, 0.2, deviations))
    return lag_accepted.aligned([view, view], 0, reached)


@pytest.mark.parametrize(("lag_s", "later"), [(0.048, False), (0.052, True)])
def test_half_a_frame_is_left_to_the_clocks(monkeypatch, lag_s, later) -> None:
    assert bool(started(monkeypatch, lag_s, 99.0).lags_s[1]) == later


@pytest.mark.parametrize(("known_m", "asked"), [(0.062, True), (0.064, False)])
def test_cameras_that_stand_elsewhere_are_asked_for_no_start(monkeypatch, known_m, asked) -> None:
    """Nothing that pixels say of it is right then; what is wrong is named afterwards."""
    assert bool(started(monkeypatch, 1.0, 99.0, known_m).lags_s[1]) == asked


@pytest.mark.parametrize(("deviations", "sure"), [(3.9, False), (4.1, True)])
def test_a_start_is_believed(monkeypatch, deviations, sure) -> None:
    told = nullcontext() if sure else pytest.raises(DataError, match="started apart")
    with told:
        assert started(monkeypatch, 1.0, deviations).lags_s[1] == 1.0


@pytest.mark.parametrize(("common", "by_frame"), [(19, False), (20, True)])
def test_frames_that_both_starts_share(common, by_frame) -> None:
    """A steady difference stands out frame by frame, of few frames only by its size."""
    best = Missed(0.02, {k: 1.0 + 1e-3 * (k % 2) for k in range(common)})
    rival = Missed(0.021, {k: 1.1 for k in range(common)})
    assert (deviations_apart(best, rival) > 100.0) == by_frame


@pytest.mark.parametrize(("apart_s", "rivals"), [(0.0048, 0), (0.0052, 1)])
def test_starts_that_end_five_milliseconds_apart_are_two(apart_s, rivals) -> None:
    view = stub(camera=VIEW, believed=lambda moved: moved)
    pair = stub(lag_s=1.0, decided_m=0.01, at_zero_m=0.1, rivals=[(1.07, 0.011)])
    ends = iter((1.02, 1.02 + apart_s))
    chosen = _chosen(
        pair, view, view, lambda *_: Missed(0.1, dict.fromkeys(range(50), 0.01), next(ends))
    )
    assert np.isfinite(chosen[3]) == bool(rivals)


@pytest.mark.parametrize(("shared", "compared"), [(19, False), (20, True)])
def test_frames_that_two_records_share(shared, compared) -> None:
    """At 10 Hz twenty are two seconds."""
    whole = np.arange(0.0, 5.0, 0.1)
    part = whole[-1] + 0.05 - 0.1 * shared + np.arange(0.0, 4.0, 0.1)

    def rates(times_s):
        return times_s, np.stack([np.sin(3.0 * times_s), np.cos(2.0 * times_s)], axis=1)

    lags, _ = _correlations(rates(whole), rates(part), 0.1)
    assert bool((np.abs(lags) < 1e-6).any()) == compared


@pytest.mark.parametrize(
    ("tags", "known", "judged"), [(1, 20, True), (2, 20, False), (1, 19, False)]
)
def test_cameras_that_base_tags_do_not_hold(monkeypatch, tags, known, judged) -> None:
    """Two tags hold a camera; twenty poses tell where one without them stands."""
    monkeypatch.setattr(untied_cameras, "base_tag_misses", lambda *_: (None, np.ones(tags), None))
    monkeypatch.setattr(untied_cameras, "iterated", reached)
    poses = stub(known=np.arange(60) < known, times_s=np.arange(60.0))
    views = [stub(camera=VIEW, numbers=range(60))] * 2
    with pytest.raises(Reached) if judged else nullcontext():
        assert untied_cameras.untied_shifts(views, stub(tags=(1,)), poses, stub(), 3e-4) == (
            None,
            (),
        )


@pytest.mark.parametrize(("known", "looked"), [(19, False), (20, True)])
def test_twenty_poses_tell_of_the_rig(monkeypatch, known, looked) -> None:
    poses = stub(known=np.arange(60) < known)
    monkeypatch.setattr(correct_rig, "instants_of", lambda _: np.arange(60.0))
    monkeypatch.setattr(correct_rig, "fuse", lambda *_, **__: (poses, stub()))
    monkeypatch.setattr(correct_rig, "moved_cameras", reached)
    with pytest.raises(Reached) if looked else nullcontext():
        view = stub(camera=VIEW, stamps_s=np.arange(10.0))
        found = correct_rig.correct_rig([view], stub(tags=(), markers=()), 3e-4)
        assert found.findings == ()


def test_sightings_that_fit_badly_say_less_of_the_rig(monkeypatch) -> None:
    """Twenty deviations say all; beyond, the weight falls as their fourth power."""
    seen = []
    scores = np.array([9.0, 390.0, 800.0])
    block = stub(
        first=0, starts=np.array([0, 3]), camera_of=np.zeros(3, int), rows_px=None,
        counts=np.ones(3, int), things=np.arange(3),
    )  # fmt: skip
    residuals = np.sqrt(scores)[:, None] * np.ones(2)
    monkeypatch.setattr(rig_step, "blocks", lambda *_, **__: [block])
    monkeypatch.setattr(rig_step, "linearised", lambda *_: stub(residuals=residuals))
    monkeypatch.setattr(rig_step, "whitened", lambda *_: np.tile(np.eye(2), (3, 1, 1)))
    monkeypatch.setattr(
        rig_step, "add_rig_equations", lambda sums, given, *_: seen.append(given) or sums
    )
    monkeypatch.setattr(rig_step, "base_equations", lambda *_: (np.zeros((6, 6)), np.zeros(6)))
    poses = stub(times_s=np.zeros(1), known=np.ones(1, bool), motions=np.ones((1, 12)))
    free = np.zeros((1, 8), dtype=bool)
    rig_step.rig_step([stub(camera=VIEW)], stub(), poses, stub(noise=None), free, 3e-4)
    assert np.allclose(seen[0].weights, [1.0, 1.0, 0.25], rtol=0.01)


@pytest.mark.parametrize(("later_s", "stretch"), [(0.24, 0), (0.26, 1)])
def test_stretches_are_a_quarter_of_a_second(later_s, stretch) -> None:
    assert rig_step.stretches(3.0 + np.array([0.0, later_s])).tolist() == [0, stretch]
    assert len(rig_step.stretches(np.zeros(0))) == 0


def test_deviations_between_stretches_hold_what_they_err_by_alike(monkeypatch) -> None:
    """Two numbers of a camera seen in 40 stretches, each with an error of its own beside noise.

    The equations know the noise alone, 0.1 a stretch; the stretches' errors are ten times that.
    """

    def told(apart: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
        rng = np.random.default_rng(seed)
        seen = apart * rng.normal(size=(40, 2)) + 0.1 * rng.normal(size=(40, 2))
        parts = []
        for one in seen:
            normal, right = np.zeros((8, 8)), np.zeros(8)
            normal[:2, :2] = np.diag([1e2, 1e2])
            right[:2] = 1e2 * one
            parts.append(rig_step.RigEquations(normal, right))
        monkeypatch.setattr(rig_step, "_equations", lambda *_, **__: (parts, []))
        monkeypatch.setattr(rig_step, "base_equations", lambda *_: (np.zeros((6, 6)), np.zeros(6)))
        free = np.zeros((1, 8), dtype=bool)
        free[0, :2] = True
        fit = stub(total=(1.0, 1))
        step = rig_step.rig_step([stub(camera=VIEW)], stub(), stub(), fit, free, 3e-4)
        assert np.sqrt(np.diag(step.covariance))[:2] == pytest.approx(step.deviations[0, :2])
        return step.changes[0, :2], step.deviations[0, :2]

    found = [told(1.0, seed) for seed in range(50)]
    z = np.array([change / std for change, std in found])
    assert 0.8 < np.sqrt(np.mean(z**2)) < 1.2, "deviations are those of the errors"
    quiet = np.array([told(0.0, seed)[1] for seed in range(50)])
    assert (quiet >= 0.1 / np.sqrt(40) * (1 - 1e-9)).all()
    assert quiet.mean() < 1.2 * 0.1 / np.sqrt(40)


@pytest.mark.parametrize(("parts", "told"), [(3, False), (4, True)])
def test_four_parts_tell_how_far_they_differ(parts, told) -> None:
    found = rig_step.leaving_out(np.arange(float(parts))[:, None] * np.ones(3))
    assert (found > 1.0).tolist() == [told] * 3
    assert rig_step.leaving_out(np.zeros((0, 2))).tolist() == [0.0, 0.0]


def jitter(monkeypatch, frames: int, late_s: float, noise_px: float, speed_px_s: float) -> float:
    """Found of two cameras alike that see a platform move along one line."""
    rng = np.random.default_rng(2)
    late = late_s * rng.normal(size=(frames, 2)) * speed_px_s
    misses = late + noise_px * rng.normal(size=(frames, 2))
    block = stub(first=0, starts=np.arange(0, 2 * frames + 1, 2), camera_of=np.tile([0, 1], frames))
    linear = stub(
        rates=np.full((2 * frames, 1), speed_px_s),
        residuals=misses.reshape(-1, 1),
        jacobians=np.ones((2 * frames, 1, 1)),
    )
    monkeypatch.setattr(stamp_jitter, "free_of", lambda _: 1)
    monkeypatch.setattr(stamp_jitter, "blocks", lambda *_: [block])
    monkeypatch.setattr(stamp_jitter, "linearised", lambda *_: linear)
    monkeypatch.setattr(
        stamp_jitter, "whitened", lambda _, floor_px, __: np.full((2 * frames, 1, 1), 1 / floor_px)
    )
    fit = stub(noise=stub(at_most=lambda floor_px: floor_px))
    poses = stub(times_s=np.arange(float(frames)))
    told = stamp_jitter.lateness([stub(), stub()], stub(), poses, fit)
    return float(stamp_jitter.stamp_jitter_s(told)[0])


@pytest.mark.parametrize(("late_s", "shown"), [(0.93e-4, False), (1.07e-4, True)])
def test_a_tenth_of_a_millisecond_is_jitter(monkeypatch, late_s, shown) -> None:
    assert bool(jitter(monkeypatch, 20001, late_s, 0.0, 1e6)) == shown


@pytest.mark.parametrize(("frames", "shown"), [(19, False), (20, True)])
def test_jitter_needs_twenty_frames(monkeypatch, frames, shown) -> None:
    assert bool(jitter(monkeypatch, frames, 5e-3, 0.0, 1e6)) == shown


@pytest.mark.parametrize(("noise_px", "shown"), [(0.0285, False), (0.0325, True)])
def test_what_lenses_leave_is_no_jitter(monkeypatch, noise_px, shown) -> None:
    """Corners of a platform so slow that 0.03 px are a millisecond."""
    assert bool(jitter(monkeypatch, 20001, 0.0, noise_px, 30.0)) == shown


@pytest.mark.parametrize(
    ("known_m", "free_m", "plausible"),
    [(0.019, 0.0, True), (0.021, 0.0, False), (2.9, 1.0, True), (3.1, 1.0, False)],
)
def test_cameras_that_stand_as_calibrated_tell_their_lag(known_m, free_m, plausible) -> None:
    assert _is_plausible(known_m, free_m) == plausible


@pytest.mark.parametrize(("times", "shown"), [(0.97 * 1.466, False), (1.03 * 1.466, True)])
def test_jitter_has_to_stand_out_of_the_pixels_noise(monkeypatch, times, shown) -> None:
    """A variance by the median of four hundred steps is known to 12 %: four of these."""
    drawn = 1.039  # the variance by the median of the steps that this seed draws
    noise_px = 0.03 * np.sqrt(times / drawn)
    assert bool(jitter(monkeypatch, 401, 0.0, noise_px, 30.0)) == shown
