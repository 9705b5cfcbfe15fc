"""Which views start a lens and which model is advised: both sides of each limit, without images."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.calib.camera import intrinsics, lens_choice, off_plane_views
from freeswing.cdpr.files.documents import DataError


class Sighted:
    """Views of one camera, as many as asked for."""

    def __init__(self, count: int) -> None:
        self.camera = np.zeros(count, dtype=int)
        self.pixels = np.zeros((count, 4, 2))
        self.label = tuple(str(k) for k in range(count))

    def __len__(self) -> int:
        return len(self.camera)

    def select(self, rows: np.ndarray) -> Sighted:
        return Sighted(len(self.camera[rows]))


def advised(
    monkeypatch, count: int, gain: np.ndarray, used: float = 10.0
) -> lens_choice.LensChoice:
    """The choice where the larger model gains so much of every view's square error."""

    def held_out(_rig, _camera, model, views):
        level = np.full(len(views), used)
        return level - (gain if model == "FULL_OPENCV" else 0.0) + (model == "PINHOLE")

    monkeypatch.setattr(lens_choice, "_held_out", held_out)
    rig = SimpleNamespace(cameras=(SimpleNamespace(model="OPENCV"),))
    return lens_choice._weigh(rig, 0, Sighted(count))


@pytest.mark.parametrize(("count", "compared"), [(11, False), (12, True)])
def test_lenses_are_compared_on_a_dozen_views(monkeypatch, count, compared) -> None:
    assert bool(advised(monkeypatch, count, np.zeros(count)).held_out_px) == compared


@pytest.mark.parametrize(("sigmas", "advice"), [(2.8, ""), (3.2, "FULL_OPENCV")])
def test_a_better_lens_stands_out_by_three_deviations(monkeypatch, sigmas, advice) -> None:
    gain = 1.0 + np.sqrt(60.0) / sigmas * np.tile([1.0, -1.0], 30)
    assert advised(monkeypatch, 60, gain).advice == advice


@pytest.mark.parametrize(("share", "advice"), [(0.018, ""), (0.022, "FULL_OPENCV")])
def test_a_better_lens_gains_a_fiftieth(monkeypatch, share, advice) -> None:
    assert advised(monkeypatch, 60, np.full(60, share), used=1.0).advice == advice


@pytest.mark.parametrize(
    ("usual", "error", "kept"),
    [
        (0.02, 0.057, True), (0.02, 0.063, False),  # never more than 6 % of the board
        (0.005, 0.038, True), (0.005, 0.042, False),  # eight times what is usual
        (1e-4, 0.0093, True), (1e-4, 0.0107, False),  # 1 % is noise, bend and lens
    ],
)  # fmt: skip
def test_a_board_is_flat(monkeypatch, usual, error, kept) -> None:
    monkeypatch.setattr(
        off_plane_views, "flatness_errors", lambda *_: np.array([usual, usual, usual, error])
    )
    _, dropped = off_plane_views.drop_false_boards(np.zeros((4, 3)), Sighted(4))
    assert len(dropped) == (0 if kept else 1)


@pytest.mark.parametrize(("count", "enough"), [(3, False), (4, True)])
def test_a_lens_needs_four_views(count, enough) -> None:
    with nullcontext() if enough else pytest.raises(DataError, match="needs at least 4"):
        intrinsics._require("left", count, 0)


@pytest.mark.parametrize(("sigma_px", "starts"), [(0.9, 1), (1.1, 5)])
def test_a_start_within_a_pixel_is_the_lens(monkeypatch, sigma_px, starts) -> None:
    """Else four other focal lengths are tried."""
    tried = []

    def adjust(camera, *_):
        tried.append(camera)
        return SimpleNamespace(sigma_px=np.array([sigma_px]))

    monkeypatch.setattr(intrinsics, "homographies", lambda *_: np.zeros((1, 3, 3)))
    monkeypatch.setattr(intrinsics, "focal_guess", lambda *_: 900.0)
    monkeypatch.setattr(intrinsics, "_adjust_lens", adjust)
    intrinsics._best_lens("left", (800, 600), "OPENCV", np.zeros((4, 3)), Sighted(1))
    assert len(tried) == starts
