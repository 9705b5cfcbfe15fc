"""Tags that look larger than they are: told from residuals, taken off, and what is left counted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from freeswing.cdpr.rotation import exp_rotation, log_rotation
from freeswing.demo.rig import demo_target
from freeswing.vision.fuse import tag_growth
from freeswing.vision.fuse.corner_noise import Noise, outwards
from freeswing.vision.fuse.run_views import CameraViews
from freeswing.vision.fuse.tag_growth import Growth, growth_of
from freeswing.vision.look.follow import USED
from freeswing.vision.look.pieces import Piece, save_piece
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.rig.correct_rig import Corrected, correct_rig
from tests.samples import make_filmed as filmed
from tests.vision.fuse.test_corner_noise import FOCAL, INSTANTS, sightings, stub

NOISE_PX = 0.015
SQUARE = np.array([-1.0, -1, 1, -1, 1, 1, -1, 1])


def found(monkeypatch, px, seed: int, noise_px: float = 0.01) -> Growth:
    """What residuals of poses tell of tags that look larger by so much in two cameras."""
    block, views, slopes = sightings(seed)
    block.first, n = 0, len(slopes)
    rng = np.random.default_rng(seed + 50)
    pixel = np.sqrt(np.diagonal(block.covariances, axis1=1, axis2=2)) * rng.normal(size=(n, 8))
    errors = pixel + noise_px / FOCAL * rng.normal(size=(n, 8))
    errors += np.array(px)[block.camera_of, None] / FOCAL * outwards(block.rays)
    linear = stub(residuals=errors, jacobians=slopes)
    monkeypatch.setattr(tag_growth, "blocks", lambda *_: [block])
    monkeypatch.setattr(tag_growth, "linearised", lambda *_: linear)
    poses = stub(times_s=np.zeros(INSTANTS), known=np.ones(INSTANTS, dtype=bool))
    fit = stub(noise=Noise.plain(np.full(2, noise_px)))
    return growth_of(poses, fit, views, stub())


def test_growth_is_told_to_its_deviation(monkeypatch) -> None:
    """Two cameras, twenty draws of 750 tags: scores are normal, poses eliminated."""
    true = np.array([0.003, -0.004])
    scores = []
    for seed in range(20):
        one = found(monkeypatch, true, seed)
        scores.append(np.linalg.solve(np.linalg.cholesky(one.covariance), one.px - true))
        assert one.is_real, one.px
    assert 0.75 < np.std(scores) < 1.25, np.std(scores)


def test_corners_off_one_by_one_make_no_growth(monkeypatch) -> None:
    for seed in range(20):
        assert not found(monkeypatch, (0.0, 0.0), seed).is_real, seed


def test_one_tag_alone_tells_of_no_growth(monkeypatch) -> None:
    """Nearer or larger is the same there: what is usual stays as it was, and nothing is done."""
    block, views, _ = sightings(0)
    rays = block.rays.reshape(-1, 4, 2)
    slopes = np.concatenate(
        [outwards(block.rays)[:, :, None], np.random.default_rng(1).normal(size=(len(rays), 8, 5))],
        axis=2,
    )
    block.first, block.starts = 0, np.arange(len(rays) + 1)
    linear = stub(residuals=0.01 / FOCAL * outwards(block.rays), jacobians=slopes)
    monkeypatch.setattr(tag_growth, "blocks", lambda *_: [block])
    monkeypatch.setattr(tag_growth, "linearised", lambda *_: linear)
    poses = stub(times_s=np.zeros(len(rays)), known=np.ones(len(rays), dtype=bool))
    one = growth_of(poses, stub(noise=Noise.plain(np.full(2, 0.01))), views, stub())
    assert not one.is_real
    assert np.sqrt(np.diag(one.covariance)) == pytest.approx([0.005, 0.005], rel=0.01)


@pytest.mark.parametrize(
    ("px", "real", "large"),
    [(0.0038, False, False), (0.0042, True, False), (0.0195, True, False), (0.0205, False, True)],
)
def test_growth_counts_from_four_deviations_to_four_usual_ones(px, real, large) -> None:
    one = Growth(np.array([px, 0.0]), 0.001**2 * np.eye(2), np.zeros((1, 6, 2)))
    assert (one.is_real, one.is_too_large) == (real, large)


def test_what_is_left_counts_sixteen_times() -> None:
    slopes = np.random.default_rng(2).normal(size=(3, 6, 2))
    covariance = np.array([[4.0, 1.0], [1.0, 2.0]])
    causes = Growth(np.zeros(2), covariance, slopes).causes()
    whole = 16.0 * slopes @ covariance @ np.swapaxes(slopes, 1, 2)
    np.testing.assert_allclose(causes @ np.swapaxes(causes, 1, 2), whole)


@pytest.mark.parametrize("order", [[0, 1, 2, 3], [3, 2, 1, 0]])
def test_every_edge_moves_outwards_by_one(order) -> None:
    """Of a square by its corners, of any quadrangle by its edges, whichever way round."""
    square = SQUARE.reshape(4, 2)[order]
    np.testing.assert_allclose(outwards(square.reshape(1, 8))[0], square.ravel(), atol=1e-12)
    quad = np.array([[0.0, 0.0], [5.0, 1.0], [6.0, 4.0], [-1.0, 3.0]])[order]
    moved = quad + outwards(quad.reshape(1, 8)).reshape(4, 2)
    for a, b, c in zip(quad, np.roll(quad, -1, axis=0), moved, strict=True):
        normal = np.array([b[1] - a[1], a[0] - b[0]]) / np.linalg.norm(b - a)
        away = float(normal @ (a - quad.mean(axis=0)))
        assert np.sign(away) * normal @ (c - a) == pytest.approx(1.0)


def seen_grown(folder: Path, growth_px: float) -> tuple[Corrected, np.ndarray]:
    """A swing before the cameras of samples/filmed, corners noisy, tags grown; the true turns."""
    rng, watch = np.random.default_rng(8), Watch.of(demo_target(), ())
    times = np.arange(90) / 20.0
    phases = np.outer(5.0 * times, [1.0, 1.2, 0.7]) + np.arange(3.0)
    turns = exp_rotation(0.1 * np.sin(phases))
    places = filmed.CENTRE_M + 0.04 * np.sin(np.outer(4.0 * times, [1.0, 1.3, 0.8]))
    views = []
    for told in filmed.cameras():
        camera = replace(told, clock_offset_s=0.0)
        T = camera.T_camera_base
        focal = camera.focal_px.mean()
        corners = np.einsum("nij,tkj->ntki", turns, watch.tag_corners_m) + places[:, None, None]
        seen = corners @ T[:3, :3].T + T[:3, 3]
        rays = (seen[..., :2] / seen[..., 2:]).reshape(-1, 8)
        n_tags = len(watch.tag_corners_m)
        rays = rays + growth_px / focal * outwards(rays)
        rays = rays + NOISE_PX / focal * rng.standard_normal(rays.shape)
        own = (T[:3, :3] @ turns).reshape(-1, 9)
        poses = np.hstack([own, places @ T[:3, :3].T + T[:3, 3]])
        piece = Piece(
            np.arange(90), times, np.full(90, USED), poses,
            np.repeat(np.arange(90), n_tags), np.tile(np.arange(n_tags), 90), rays,
            np.tile((NOISE_PX / focal) ** 2 * np.eye(8), (len(rays), 1, 1)),
            np.full((len(rays), 4), 180.0), np.ones((len(rays), 2)),
        )  # fmt: skip
        path = folder / f"{camera.name}.npz"
        nothing = stub(past=[], base_rays={}, before={}, misses=0, count=0)
        save_piece(path, piece, nothing)
        views.append(CameraViews(camera, (path,)))
    return correct_rig(views, watch, 3e-4), turns


def test_poses_are_freed_of_growth_and_count_what_is_left(tmp_path) -> None:
    """Tags 0.003 px larger turn all poses by some 30 urad and more: taken off to the claim."""
    corrected, turns = seen_grown(tmp_path, 0.003)
    assert [view.growth_px for view in corrected.views] == pytest.approx([0.003] * 2, abs=0.0012)
    assert corrected.doubt is not None
    error = log_rotation(corrected.poses.rotations @ np.swapaxes(turns, 1, 2)).mean(axis=0)
    claimed = np.sqrt(np.sum(corrected.doubt[:, 3:] ** 2, axis=2)).mean(axis=0)
    white = np.sqrt(np.diagonal(corrected.poses.covariances, axis1=1, axis2=2)[:, 3:].mean(axis=0))
    assert (np.abs(error) < 3.0 * np.hypot(claimed, white / np.sqrt(90))).all(), error
    assert any("larger to each side" in said for said in corrected.remarks), corrected.remarks


def test_sharp_tags_are_left_as_they_are(tmp_path) -> None:
    corrected, _ = seen_grown(tmp_path, 0.0)
    assert [view.growth_px for view in corrected.views] == [0.0, 0.0]
    assert corrected.remarks == ()


def test_a_wrong_size_is_said_and_no_growth(tmp_path) -> None:
    """A tenth of a pixel to each side is no squeezing: the poses stay, the message says size_m."""
    corrected, _ = seen_grown(tmp_path, 0.1)
    assert [view.growth_px for view in corrected.views] == [0.0, 0.0]
    assert any("check size_m" in said for said in corrected.remarks), corrected.remarks
