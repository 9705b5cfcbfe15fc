"""What makes a platform's points and their frame, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.files.documents import DataError, InputError
from freeswing.cdpr.measured.target import Marker, Untagged, read_target
from freeswing.cdpr.rotation import exp_rotation, log_rotation, transform
from freeswing.main import main
from freeswing.vision.fuse.calibration_share import frame_causes
from freeswing.vision.fuse.poses import Poses
from freeswing.vision.untagged.adjusted_points import PointSums
from freeswing.vision.untagged.feature_matches import matched
from freeswing.vision.untagged.named_points import WORST_NAMED_M, rigid
from freeswing.vision.untagged.pose_by_matches import LEAST_MATCHES, agreed_pose
from freeswing.vision.untagged.rest_model import (
    CHANGED_GREY,
    CHANGED_SHARE,
    moving_part,
    rest_model,
)
from freeswing.vision.untagged.still_pose import still_pose
from freeswing.vision.untagged.track_untagged import frame_of_platform
from tests.vision.untagged import boxes

STATED = np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.3, 0.0], [0.1, 0.1, 0.2]])
NAMES = ["A", "B", "C", "D"]


def test_named_points_give_the_frame() -> None:
    T = transform(exp_rotation(np.array([0.3, -0.5, 1.0])), np.array([0.4, 0.1, 1.0]))
    places = STATED[:3] @ T[:3, :3].T + T[:3, 3]
    np.testing.assert_allclose(rigid(STATED[:3], places, "clicks.csv", NAMES), T, atol=1e-12)


@pytest.mark.parametrize(
    ("off", "refused"), [(0.5 * WORST_NAMED_M, False), (4.0 * WORST_NAMED_M, True)]
)
def test_a_named_point_that_does_not_fit_is_named(off, refused) -> None:
    places = STATED + np.array([0.0, 0.0, 1.0])
    places[3, 2] += off
    if refused:
        with pytest.raises(DataError, match=r"clicks.csv: point D lies \d+\.\d mm from where"):
            rigid(STATED, places, "clicks.csv", NAMES)
        return
    assert np.abs(rigid(STATED, places, "clicks.csv", NAMES)[:3, 3] - [0, 0, 1]).max() < off


def test_marks_place_the_platform_and_say_how_well() -> None:
    """Repeated marks scatter as their covariance says: 6 numbers, 60 times."""
    rng, cameras = np.random.default_rng(2), boxes.cameras()
    T = transform(exp_rotation(np.array([0.02, -0.03, 0.05])), boxes.HOME_M)
    points = np.array(list(boxes.NAMED.values()))
    camera_of, which = (a.ravel() for a in np.meshgrid(np.arange(3), np.arange(5), indexing="ij"))
    true = np.concatenate(
        [c.project(c.to_camera(points @ T[:3, :3].T + T[:3, 3])) for c in cameras]
    )
    std, chi2 = np.full(15, 0.3), []
    for _ in range(60):
        marks = true + 0.3 * rng.normal(size=true.shape)
        found, covariance = still_pose(cameras, camera_of, points[which], marks, std, T)
        error = found[:3, 3] - T[:3, 3]
        chi2.append(error @ np.linalg.solve(covariance[:3, :3], error))
    assert 2.0 < np.mean(chi2) < 4.2, np.mean(chi2)  # 3 +- 0.32


def test_the_platform_is_where_most_frames_differ() -> None:
    rest = np.full((60, 80), 100, np.uint8)
    rest[20:40, 30:50] = 180
    frames = []
    for k in range(10):
        frame = np.full((60, 80), 100, np.uint8)
        if k < 3:  # it passes by on the left
            frame[20:40, 5:25] = 180
        frames.append(frame)
    mask = moving_part(rest, frames)
    assert mask[25:35, 35:45].all()
    assert not mask[25:35, 8:22].any(), "three frames of ten are no rest"
    assert CHANGED_SHARE > 0.3
    faint = np.where(rest > 150, 100 + CHANGED_GREY - 2, 100).astype(np.uint8)
    assert not moving_part(faint, frames).any(), "less than the noise allows is no change"
    strong = np.where(rest > 150, 100 + CHANGED_GREY + 3, 100).astype(np.uint8)
    assert moving_part(strong, frames[3:]).any()


def test_features_match_where_each_is_clearly_the_others_nearest() -> None:
    rng = np.random.default_rng(0)
    first = rng.normal(size=(6, 128)).astype(np.float32)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = first[[3, 1, 4]] + 0.02 * rng.normal(size=(3, 128)).astype(np.float32)
    second /= np.linalg.norm(second, axis=1, keepdims=True)
    rows, columns = matched(first, second)
    assert list(zip(rows.tolist(), columns.tolist(), strict=True)) == [(1, 1), (3, 0), (4, 2)]
    twice = np.concatenate([second, second[:1]])
    assert 3 not in matched(first, twice)[0].tolist(), "two that look alike tell nothing"


def made_matches(good: int, wrong: int) -> tuple[np.ndarray, np.ndarray, Camera, np.ndarray]:
    rng, camera = np.random.default_rng(5), boxes.cameras()[1]
    points = rng.uniform(-0.15, 0.15, (good + wrong, 3))
    T = camera.T_camera_base @ transform(np.eye(3), boxes.HOME_M)
    inside = points @ T[:3, :3].T + T[:3, 3]
    rays = inside[:, :2] / inside[:, 2:]
    rays[good:] += rng.choice([-1, 1], (wrong, 2)) * rng.uniform(0.02, 0.06, (wrong, 2))
    return points, rays, camera, T


def test_a_pose_is_what_most_matches_agree_on() -> None:
    points, rays, camera, T = made_matches(20, 12)
    found = agreed_pose(points, rays, camera)
    assert found is not None
    (rotation, position), inside = found
    assert sorted(inside.tolist()) == list(range(20))
    np.testing.assert_allclose(rotation, T[:3, :3], atol=1e-6)
    np.testing.assert_allclose(position, T[:3, 3], atol=1e-6)


@pytest.mark.parametrize(("good", "known"), [(LEAST_MATCHES - 1, False), (LEAST_MATCHES, True)])
def test_few_matches_give_no_pose(good, known) -> None:
    points, rays, camera, _ = made_matches(good, 3)
    assert (agreed_pose(points, rays, camera) is not None) == known


def test_points_are_put_right_by_their_sightings() -> None:
    true, cameras = np.array([[0.1, 0.02, 0.05], [0.0, -0.1, 0.1]]), boxes.cameras()
    points = true + 0.002
    for _ in range(3):
        sums = PointSums(points)
        for camera in cameras:
            T = camera.T_camera_base @ transform(np.eye(3), boxes.HOME_M)
            inside = true[:1] @ T[:3, :3].T + T[:3, 3]
            sums.add(np.array([0]), T[None], inside[:, :2] / inside[:, 2:])
        points = sums.moved()
    np.testing.assert_allclose(points[0], true[0], atol=1e-9)
    np.testing.assert_allclose(points[1], true[1] + 0.002, atol=1e-15)  # never seen: as it was


def test_an_error_of_the_frame_goes_with_the_platform() -> None:
    """Poses of a frame that is a little off at rest, against what each cause says it does."""
    rng = np.random.default_rng(4)
    root = 1e-5 * rng.normal(size=(6, 6))
    rest = transform(exp_rotation(np.array([0.3, -0.4, 0.8])), boxes.HOME_M)
    covariance = frame_of_platform(root @ root.T, rest)
    places, turns = boxes.swing(np.linspace(0.0, 1.0, 7))
    still = np.zeros((7, 12))
    poses = Poses(np.arange(7.0), places, turns, np.zeros((0, 6, 6)), np.ones(7, bool), still)
    causes = frame_causes(poses, covariance)
    told = causes @ np.swapaxes(causes, 1, 2)
    for k in range(7):
        moved = np.zeros((6, 6))
        for cause in root.T:
            wrong = transform(exp_rotation(cause[3:]) @ rest[:3, :3], rest[:3, 3] + cause[:3])
            frame = np.linalg.inv(rest) @ wrong
            turn = log_rotation(turns[k] @ frame[:3, :3] @ turns[k].T)
            moved += np.outer(error := np.concatenate([turns[k] @ frame[:3, 3], turn]), error)
        np.testing.assert_allclose(told[k], moved, atol=1e-3 * np.abs(moved).max())


def untagged(folder) -> Untagged:
    markers = tuple(Marker(name, np.array(p)) for name, p in boxes.NAMED.items())
    return Untagged(folder / "rest", folder / "clicks.csv", markers)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("camera,u_px\n", "line 1: no column point, v_px"),
        ("camera,point,u_px,v_px\ncam7,A,1,2\n", "line 2: camera 'cam7' is not one of cam0, cam1"),
        ("camera,point,u_px,v_px\ncam0,Z,1,2\n", "line 2: point 'Z' is not one of A, B"),
        ("camera,point,u_px,v_px\ncam0,A,x,2\n", "line 2: u_px, v_px or std_px is not a number"),
        ("camera,point,u_px,v_px,std_px\ncam0,A,1,2,0\n", "must be pixels, std_px 0"),
        ("camera,point,u_px,v_px\ncam0,A,1,2\n", "0 named points are marked in two cameras"),
    ],
)
def test_marks_that_make_no_sense_are_refused(tmp_path, text, said) -> None:
    (tmp_path / "clicks.csv").write_text(text)
    blank = {camera.name: np.zeros((480, 640), np.uint8) for camera in boxes.cameras()}
    with pytest.raises((InputError, DataError), match=said):
        rest_model(boxes.cameras(), blank, {}, untagged(tmp_path))


def test_a_platform_that_shows_nothing_is_refused(tmp_path) -> None:
    rows = ["camera,point,u_px,v_px"]
    for camera in boxes.cameras():
        for name, place in boxes.NAMED.items():
            u, v = camera.project(camera.to_camera(boxes.HOME_M + place))
            rows.append(f"{camera.name},{name},{u},{v}")
    (tmp_path / "clicks.csv").write_text("\n".join(rows))
    blank = {camera.name: np.full((480, 640), 90, np.uint8) for camera in boxes.cameras()}
    with pytest.raises(
        DataError, match="0 points of the platform are seen by two cameras, need 30"
    ):
        rest_model(boxes.cameras(), blank, {}, untagged(tmp_path))


def test_named_points_on_a_line_are_no_frame(tmp_path) -> None:
    rows = ['format = "freeswing-target/1"', "[untagged]", 'rest = "rest"', 'clicks = "c.csv"']
    for k in range(3):
        rows += ["[[untagged.points]]", f'name = "{k}"', f"position_m = [0.{k}, 0.0, 0.0]"]
    (tmp_path / "target.toml").write_text("\n".join(rows))
    with pytest.raises(InputError, match="three that are not on one line give the frame"):
        read_target(tmp_path / "target.toml")


def test_the_command_says_what_target_toml_lacks(tmp_path, capsys) -> None:
    (tmp_path / "session.toml").write_text(
        'format = "freeswing-session/1"\nname = "a"\nrobot = "robot.toml"\ntarget = "target.toml"\n'
        '[[runs]]\nname = "a"\nrole = "identify"\nvideo = "runs/a"\n'
    )
    (tmp_path / "target.toml").write_text(
        'format = "freeswing-target/1"\n[[tags]]\nfamily = "tag36h11"\nid = 1\nsize_m = 0.1\n'
        "q_platform_tag = [1.0, 0.0, 0.0, 0.0]\nt_platform_tag_m = [0.0, 0.0, 0.0]\n"
    )
    from freeswing.calib.camera.cameras_file import write_cameras

    write_cameras(tmp_path / "cameras.toml", boxes.cameras())
    assert main(["track", str(tmp_path), "--no-tags"]) == 2
    assert "--no-tags needs [untagged]" in capsys.readouterr().err
