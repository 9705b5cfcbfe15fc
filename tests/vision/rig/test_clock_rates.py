"""Cameras whose clocks run at other rates: put right, and refused beyond what clocks do."""

from __future__ import annotations

import json
from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.rotation import log_rotation
from freeswing.vision.rig import correct_rig as module
from freeswing.vision.rig.clock_rates import Rates, refuse_far_apart
from freeswing.vision.rig.correct_rig import correct_rig
from freeswing.vision.tracked_runs import TrackedCamera, rate_by
from tests.vision.footage.sessions import errors_m, track, write_session
from tests.vision.rig.made_views import SWING, Recorded, made_views


def stub(**attributes: Any) -> Any:
    return SimpleNamespace(**attributes)


def test_a_clock_that_runs_faster_is_put_right(tmp_path, monkeypatch) -> None:
    """1.6e-4 between two: each is put on by half, all else is right to its deviations."""
    unseen = "lost frames are not looked for"
    monkeypatch.setattr(module, "recounted", lambda views, **_: (list(views), [], [unseen]))
    views, watch = made_views(tmp_path, (Recorded(rate=1.00016), Recorded()), seconds=6.0)
    found = correct_rig(views, watch, 1e-3)
    assert found.remarks.count(unseen) == 1, "said of the stamps as they were, and put right"
    told = {f.camera: f.parameters[0] for f in found.findings if f.effect == "clock_rate"}
    assert told.keys() == {"left", "right"}
    for camera, wanted in (("left", 8e-5), ("right", -8e-5)):
        _, rate, std = told[camera]
        assert abs(rate - wanted) < 3.0 * std < 3e-5, (camera, rate, std)
    (clock,) = [f.parameters[0] for f in found.findings if f.effect == "clock_offset"]
    assert abs(clock[1] - 3.0 * 1.6e-4) < 4.0 * clock[2], clock  # alike in the middle, not at zero
    poses = found.poses
    places, turns = SWING((poses.times_s - 3.0 * 8e-5) / (1.0 + 8e-5))
    turned = log_rotation(poses.rotations @ np.swapaxes(turns, 1, 2))
    error = np.concatenate([poses.positions_m - places, turned], axis=1)
    z = np.sqrt(np.mean(error**2 / np.diagonal(poses.covariances, axis1=1, axis2=2), axis=0))
    assert np.all(z < 1.3), z  # 1.5 without


def test_clocks_of_one_rate_stay(tmp_path) -> None:
    views, watch = made_views(tmp_path, (Recorded(late_s=0.01), Recorded()), seconds=6.0, seed=6)
    found = correct_rig(views, watch, 1e-3)
    assert [f.effect for f in found.findings if f.effect == "clock_rate"] == []


@pytest.mark.parametrize(("apart", "refused"), [(1.9e-4, False), (2.1e-4, True)])
def test_quartz_is_no_farther_off(apart, refused) -> None:
    rates = Rates(np.array([0.5, -0.5]) * apart, np.full(2, 1e-6), 5.0, 3.0)
    assert rates.real.all()
    views = [stub(camera=stub(name=name)) for name in ("left", "right")]
    said = "the stamps of left take 0.021 % longer"
    with pytest.raises(DataError, match=said) if refused else nullcontext():
        refuse_far_apart(views, rates)


def test_a_camera_that_hardly_tells_refuses_none() -> None:
    """It had been named beside the one whose rate is sure, and is put right by nothing."""
    values, deviations = np.array([5e-5, 0.0, -4e-4]), np.array([1e-6, 1e-6, 3e-4])
    rates = Rates(values, deviations, 5.0, 3.0)
    views = [stub(camera=stub(name=name)) for name in ("left", "middle", "right")]
    assert rates.real.tolist() == [True, False, False]
    refuse_far_apart(views, rates)
    sure = Rates(np.array([3e-4, 0.0, -4e-4]), deviations, 5.0, 3.0)
    with pytest.raises(DataError, match=r"cameras left and middle: .* 0\.030 % longer"):
        refuse_far_apart(views, sure)


def test_what_shows_frames_takes_their_stamps_put_right(monkeypatch) -> None:
    numbers = (("rate", 1e-3, 1e-6), ("about_s", 2.0, 0.0))
    rate = rate_by([stub(effect="clock_rate", parameters=numbers)])
    assert rate == (1e-3, 2.0)
    assert rate_by([]) == (0.0, 0.0)
    piece = made_piece()
    monkeypatch.setattr("freeswing.vision.tracked_runs.load_piece", lambda _: piece)
    shown = list(TrackedCamera(stub(), stub(), (stub(),), ((0.0, 0.5),), rate).frames())
    assert shown[0][0].stamps_s == pytest.approx([1.001, 2.4995])


def made_piece() -> Any:
    from freeswing.vision.look.pieces import Piece

    empty = np.zeros(0)
    numbers = np.arange(2)
    stamps = np.array([1.0, 2.0])
    return Piece(numbers, stamps, numbers, empty, numbers, numbers, *([empty] * 4))


@pytest.mark.slow
@pytest.mark.parametrize("apart", [1.2e-4, 3e-3])
def test_stamps_of_another_rate_beside_one_video(tmp_path, apart, capsys) -> None:
    folder = write_session(tmp_path)
    path = folder / "runs" / "swing-01" / "right.csv"
    rows = [line.split(",") for line in path.read_text().splitlines()[1:]]
    lines = [f"{frame},{(1.0 + apart) * float(t):.9f}" for frame, t in rows]
    path.write_text("\n".join(["frame,t_s", *lines]))
    if apart > 1e-3:
        assert track(folder) == 1
        assert "the stamps of right take 0.3" in capsys.readouterr().err
        return
    assert track(folder) == 0
    told = json.loads((folder / "results" / "tracking.json").read_text())
    rates = {
        e["camera"]: e["parameters"][0] for e in told["effects"] if e["effect"] == "clock_rate"
    }
    for camera, sign in (("left", -0.5), ("right", 0.5)):
        assert abs(rates[camera]["value"] - sign * apart) < 4.0 * rates[camera]["std"], rates
    assert np.sqrt(np.mean(errors_m(folder, 0.0) ** 2)) < 1e-4
