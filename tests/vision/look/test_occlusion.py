"""Tags that hide parts of each other: told by layout and pose, and left out."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.cdpr.measured.target import Tag, Target
from freeswing.cdpr.rotation import exp_rotation
from freeswing.vision.look.follow import Follower
from freeswing.vision.look.occlusion import Plates
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.render.render_scene import Look, Renderer
from tests.vision.scenes import camera, facing, platform_tags, scene_of

FRAMES = 36
STAMPS = np.arange(FRAMES) / 40.0
SIDE_M = 0.11
# The second tag stands behind the first one's edge, turned to the right.
CONCAVE = Target(
    (
        Tag("tag36h11", 1, SIDE_M, facing((0.0, -0.24, 0.0))),
        Tag("tag36h11", 2, SIDE_M, facing((0.15, -0.18, 0.0), yaw=0.5)),
        Tag("tag36h11", 4, SIDE_M, facing((0.0, -0.24, 0.16))),
    )
)


def turning(times_s):
    """The platform turns to and fro, so that the second tag comes to stand behind the first."""
    t = np.asarray(times_s, float)
    yaw = 0.03 + 0.11 * np.sin(2 * np.pi * 1.2 * t)
    return np.zeros((len(t), 3)), exp_rotation(np.stack([0 * t, 0 * t, yaw], axis=1))


def followed() -> tuple[dict[int, list[float]], int]:
    """Squared errors over their claim of every sighting by tag, and how often tag 2 was seen."""
    eye = camera(
        position=(-1.0, -1.6, 0.1), size_px=(480, 360), params=[690, 690, 239.5, 179.5] + 4 * [0.0]
    )
    follower = Follower(eye, Watch.of(CONCAVE))
    images = Renderer(eye, scene_of(CONCAVE.tags, motion=turning), Look(noise=1.2), 3).frames(
        STAMPS
    )
    scores: dict[int, list[float]] = {1: [], 2: [], 4: []}
    for image, time_s in zip(images, STAMPS, strict=True):
        positions, rotations = turning(np.array([time_s]))
        for one in follower.look(image, time_s).sightings:
            tag = CONCAVE.tags[one.thing]
            seen = eye.to_camera(tag.corners_platform_m @ rotations[0].T + positions[0])
            error = one.rays - (seen[:, :2] / seen[:, 2:]).ravel()
            scores[tag.id].append(float(error @ np.linalg.solve(one.covariance, error)) / 8)
    return scores, len(scores[2])


def test_a_half_hidden_tag_is_left_out_and_comes_back() -> None:
    scores, seen = followed()
    assert 4 < seen < FRAMES - 4, f"the tag behind is used in {seen} of {FRAMES} frames"
    assert len(scores[1]) == len(scores[4]) == FRAMES, {k: len(v) for k, v in scores.items()}
    worst = max(max(one) for one in scores.values())
    assert worst < 8.0, f"an error squared is {worst:.1f} times its claim"


def test_taken_along_it_would_be_wrong_beyond_its_claim(monkeypatch) -> None:
    """The negative control: a strip over the border moves corners, and the pattern still fits."""
    monkeypatch.setattr(Plates, "hidden", lambda self, *_: np.zeros(len(self.read_m), dtype=bool))
    scores, _ = followed()
    assert max(scores[2]) > 20.0, f"worst {max(scores[2]):.1f} times the claim"


def test_tags_on_a_convex_body_never_hide_each_other() -> None:
    watch = Watch.of(Target(platform_tags(size_m=0.11)))
    plates = Plates.of(watch.tag_corners_m, np.full(6, 8.0))
    assert len(plates.pairs) == 0, plates.pairs


@pytest.mark.parametrize(("yaw", "expected"), [(0.0, False), (0.1, True)])
def test_the_nearer_plate_hides_the_farther_one_alone(yaw: float, expected: bool) -> None:
    watch = Watch.of(CONCAVE)
    plates = Plates.of(watch.tag_corners_m, np.full(3, 8.0))
    eye = camera(position=(-1.0, -1.6, 0.1))
    rotation = eye.T_camera_base[:3, :3] @ exp_rotation(np.array([0.0, 0.0, yaw]))
    found = plates.hidden(rotation, eye.T_camera_base[:3, 3])
    assert found.tolist() == [False, expected, False], found
