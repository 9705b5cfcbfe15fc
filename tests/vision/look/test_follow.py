"""One camera's tracker: speed-ups that must not cost tags, and frames that must be refused."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.calib.tags.corners import lens_rays
from freeswing.cdpr.measured.target import Tag, Target
from freeswing.vision.look.detect import TagFinder, detect_tags
from freeswing.vision.look.follow import COVERED, NOTHING, OVEREXPOSED, USED, Follower, FrameView
from freeswing.vision.look.watched_target import Watch
from freeswing.vision.render.patterns import plain_patch, tag_patch
from freeswing.vision.render.render_scene import Look, Renderer, Scene, still
from tests.vision.scenes import camera, facing, platform_tags, scene_of, swing

VIEW = camera()
TARGET = Target(platform_tags())
WATCH = Watch.of(TARGET)
TIMES = np.arange(12) / 100.0


@pytest.fixture(scope="module")
def frames():
    return list(Renderer(VIEW, scene_of(TARGET.tags), Look(), seed=4).frames(TIMES))


def positions_in_camera(times_s) -> np.ndarray:
    return VIEW.to_camera(swing(times_s)[0])


def place_of(view: FrameView) -> np.ndarray:
    assert view.pose is not None
    return view.pose[1]


def test_every_tag_is_followed_and_the_pose_is_right(frames) -> None:
    follower = Follower(VIEW, WATCH)
    views = [follower.look(image, t) for image, t in zip(frames, TIMES, strict=True)]
    seen = [len(view.sightings) for view in views]
    places = [place_of(view) for view in views]
    error = np.array(places) - positions_in_camera(TIMES)
    assert min(seen) == 6, f"tags seen {seen}"
    assert {view.status for view in views} == {USED}
    assert np.abs(error).max() < 3e-4, f"{1e3 * np.abs(error).max():.3f} mm"
    assert len(follower.past) == 3, "the motion is predicted from three poses"


def test_tags_of_several_sizes_are_followed_as_if_alone() -> None:
    """Eight cells a side and six: those of one size are fitted at one call."""
    tags = list(platform_tags())
    tags[1:4:2] = (Tag("4x4_50", k, 0.09, tags[k].T_platform_tag) for k in (1, 3))
    renderer = Renderer(VIEW, scene_of(tuple(tags)), Look(), seed=4)
    images = list(renderer.frames(TIMES[:6]))
    together = Follower(VIEW, Watch.of(Target(tuple(tags))))
    apart = [Follower(VIEW, Watch.of(Target((tag,)))) for tag in tags]
    for image, t in zip(images, TIMES, strict=False):
        rays = {s.thing: s.rays for s in together.look(image, t).sightings}
        alone = [one.look(image, t).sightings[0] for one in apart]
        assert sorted(rays) == list(range(len(tags)))
        off = max(np.abs(rays[k] - one.rays).max() for k, one in enumerate(alone)) * 1300.0
        assert off < 0.01, f"{off:.4f} px"


def test_it_searches_only_when_lost(frames, monkeypatch) -> None:
    searches = []
    follower = Follower(VIEW, WATCH)
    search = Follower._search
    monkeypatch.setattr(
        Follower, "_search", lambda self, image: searches.append(1) or search(self, image)
    )
    dark = np.full_like(frames[0], 7)
    statuses = [follower.look(image, t).status for image, t in zip(frames[:5], TIMES, strict=False)]
    statuses += [follower.look(dark, 0.05 + 0.01 * k).status for k in range(4)]
    statuses += [follower.look(frames[9], 0.09).status]
    assert statuses == [USED] * 5 + [COVERED] * 4 + [USED], statuses
    assert len(searches) == 1 + 4 + 1, f"{len(searches)} searches"


def test_overexposed_frames_are_refused(frames) -> None:
    white = np.clip(frames[0].astype(int) * 3 - 60, 0, 255).astype(np.uint8)
    view = Follower(VIEW, WATCH).look(white, 0.0)
    assert view.status == OVEREXPOSED, view.status
    assert not view.sightings, f"{len(view.sightings)} sightings"


def test_an_empty_room_is_nothing_found() -> None:
    image = Renderer(VIEW, Scene((), still()), Look()).frame(0.0)
    view = Follower(VIEW, WATCH).look(image, 0.0)
    assert view.status == NOTHING, view.status


def test_hidden_and_half_hidden_tags_are_left_out() -> None:
    tags = platform_tags()
    front = tags[2].T_platform_tag.copy()
    front[:3, 3] += 0.02 * front[:3, 2]
    half = tags[3].T_platform_tag.copy()
    half[:3, 3] += 0.02 * half[:3, 2] + 0.08 * half[:3, 0]
    hiding = (
        plain_patch(0.4, (0.2, 0.2), front, "platform"),
        plain_patch(0.4, (0.14, 0.2), half, "platform"),
    )
    renderer = Renderer(VIEW, scene_of(tags, extra=hiding), Look())
    follower = Follower(VIEW, WATCH)
    views = [follower.look(renderer.frame(t, k), t) for k, t in enumerate(TIMES[:5])]
    things = {s.thing for s in views[-1].sightings}
    error = np.abs(place_of(views[-1]) - positions_in_camera(TIMES[4:5])[0]).max()
    assert 2 not in things, things
    assert error < 4e-4, f"{1e3 * error:.3f} mm"


def test_several_families_at_once() -> None:
    families = ("tag36h11", "DICT_5X5_100", "tag25h9", "aruco_mip_36h12")
    keys = [(family, 3) for family in families]
    patches = tuple(
        tag_patch(family, 3, 0.15, facing((0.3 * k - 0.45, 0.0, 0.0)))
        for k, family in enumerate(families)
    )
    image = Renderer(VIEW, Scene(patches, still()), Look()).frame(0.0)
    found = detect_tags(image, VIEW, lens_rays(VIEW), keys, TagFinder.of(keys))
    assert set(found) == set(keys), sorted(found)
    for k, family in enumerate(families):
        tag = Tag(family, 3, 0.15, facing((0.3 * k - 0.45, 0.0, 0.0)))
        truth = VIEW.project(VIEW.to_camera(tag.corners_platform_m))
        rays = np.column_stack([found[family, 3].rays, np.ones(4)])
        worst = np.abs(VIEW.project(rays) - truth).max()
        assert worst < 0.05, f"{family}: {worst:.4f} px"


def test_one_tag_seen_twice_is_misread_and_left_out() -> None:
    patches = tuple(tag_patch("tag36h11", 5, 0.15, facing((x, 0.0, 0.0))) for x in (-0.3, 0.3))
    image = Renderer(VIEW, Scene(patches, still()), Look()).frame(0.0)
    keys = [("tag36h11", 5)]
    found = detect_tags(image, VIEW, lens_rays(VIEW), keys, TagFinder.of(keys))
    assert not found, sorted(found)
