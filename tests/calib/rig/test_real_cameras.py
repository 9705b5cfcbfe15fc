"""Calibration on recordings of real cameras, where the folder with them is beside the project."""

import csv
import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from freeswing.calib.board.board_corners import BoardDetector
from freeswing.calib.board.declared_board import Board
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.intrinsics import start_camera
from freeswing.calib.exchange import read
from freeswing.calib.rig.normal_equations import Problem
from freeswing.calib.rig.solve_rig import free_unknowns, refine
from freeswing.calib.rig.tie_by_shared_boards import pose_from_points, start_rig
from freeswing.calib.rig.triangulation import triangulate
from freeswing.calib.rig.views import make_views
from freeswing.calib.tags.corners import fit_tag, pixel_rays, rimmed_cells
from freeswing.calib.tags.tag_patterns import tag_dictionary
from freeswing.cdpr.rotation import log_rotation, matrix_from_quaternion, transform
from tests.places import REAL

needs_real = pytest.mark.skipif(not REAL.is_dir(), reason="needs ../shared/real")


def grey_image(file: Path) -> np.ndarray:
    return np.asarray(cv2.imread(str(file), cv2.IMREAD_GRAYSCALE), dtype=np.uint8)


def board_views(board: Board, files: list[Path]):
    detector = BoardDetector(board)
    found = [(file.name, detector.detect(grey_image(file))) for file in files]
    found = [(name, corners) for name, corners in found if corners is not None]
    pixels = np.array([corners.pixels for _, corners in found])
    names = tuple(name for name, _ in found)
    return make_views(np.zeros(len(found)), np.arange(len(found)), pixels, label=names)


@needs_real
@pytest.mark.slow
def test_false_chessboard_is_named_and_dropped():
    """cam01_06: the detector returns garbage; kept, it takes the error from 0.12 to 30 px."""
    folder = REAL / "pose2sim_qualisys4" / "intrinsics" / "int_cam01_img"
    board = Board("chessboard", 4, 7, 0.06)
    views = board_views(board, sorted(folder.glob("*.jpg")))
    assert "cam01_06_int.jpg" in views.label, "the detector no longer reports the false board"
    start = start_camera("cam01", (1088, 1920), "OPENCV", board.points_m, views)
    dropped = [drop.label for drop in start.dropped]
    assert dropped == ["cam01_06_int.jpg"], f"dropped {dropped}"
    assert start.rms_px < 0.2, f"{start.rms_px} px"
    assert start.camera.focal_px[0] == pytest.approx(1672.6, rel=0.01), start.camera.params


def wand_points() -> np.ndarray:
    """The wand's tag corners from its drawing, in the order of the corner file, (16, 3)."""
    import yaml

    document = yaml.safe_load((REAL / "tagslam_aviary8" / "tagslam.yaml").read_text())
    bodies = {name: entry for body in document["bodies"] for name, entry in body.items()}
    points = []
    for tag in sorted(bodies["wand"]["tags"], key=lambda entry: entry["id"]):
        half = 0.5 * tag["size"]
        pose = tag["pose"]
        turn = np.array([pose["rotation"][axis] for axis in "xyz"], dtype=float)
        shift = np.array([pose["position"][axis] for axis in "xyz"], dtype=float)
        corners = half * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
        rotation, _ = cv2.Rodrigues(turn)
        points.append(corners @ rotation.T + shift)
    return np.concatenate(points)


@needs_real
def test_aviary_wand_edges_have_their_length():
    """Eight cameras and the wand's poses adjusted together; edges triangulated freely after."""
    cameras = tuple(
        Camera(c.name, (1920, 1200), c.model, c.params, np.eye(4))
        for c in read(REAL / "tagslam_aviary8" / "cameras.yaml", "kalibr")
    )
    names = [camera.name for camera in cameras]
    points = wand_points()[:16]
    sightings: dict[tuple[int, int], np.ndarray] = {}
    with (REAL / "tagslam_aviary8" / "tag_corners.csv").open() as file:
        for row in csv.DictReader(file):
            if int(row["tag_id"]) > 3:
                continue
            key = (names.index(row["camera"]), int(row["stamp_ns"]))
            corners = sightings.setdefault(key, np.full((16, 2), np.nan))
            values = [[float(row[f"{axis}{k}"]) for axis in "xy"] for k in range(4)]
            corners[4 * int(row["tag_id"]) :][:4] = values
    stamps = sorted({stamp for _, stamp in sightings})
    moments = [stamps.index(stamp) for _, stamp in sightings]
    views = make_views([c for c, _ in sightings], moments, np.array(list(sightings.values())))
    found = [
        pose_from_points(cameras[index], points[seen], pixels[seen])
        for index, pixels, seen in zip(views.camera, views.pixels, views.seen, strict=True)
    ]
    good = np.array([pose is not None for pose in found])
    poses = np.array([np.eye(4) if pose is None else pose for pose in found])
    views, _ = views.select(good).compacted()
    start = start_rig(cameras, points, views, poses[good])
    free = free_unknowns(cameras, held_pose=start.reference, held_lenses=True)
    rig = refine(start.scene, Problem(points, views, None, free), start.reference)
    views = rig.problem.views
    pixels = np.full((8, views.moment.max() + 1, 16, 2), np.nan)
    pixels[views.camera, views.moment] = views.pixels
    corners = triangulate(rig.cameras, pixels).reshape(-1, 4, 3)
    lengths = 1e3 * np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)
    median = float(np.nanmedian(lengths))
    count = int(np.isfinite(lengths).sum())
    assert count > 400, f"{count} edges"
    assert abs(median - 119.86) < 0.3, f"median of {count} edges {median:.3f} mm, true 119.86"


@needs_real
@pytest.mark.slow
def test_charuco_poses_against_the_robot():
    """The board on a robot's flange: camera poses and robot poses agree to the robot's few mm."""
    import yaml

    folder = REAL / "robot_charuco16"
    board = Board("charuco", 5, 7, 0.036195, 0.018256, "DICT_6X6_250")
    files = [folder / "images" / f"{k}.png" for k in range(16)]
    views = board_views(board, files)
    start = start_camera("cam", (1600, 1200), "OPENCV", board.points_m, views)
    assert start.rms_px < 0.8, f"{start.rms_px} px"
    flange = []
    for label in start.views.label:
        pose = yaml.safe_load((folder / "poses" / label.replace("png", "yaml")).read_text())
        rotation = matrix_from_quaternion([pose[key] for key in ("qw", "qx", "qy", "qz")])
        flange.append(transform(rotation, [pose[key] for key in "xyz"]))
    robot, seen = np.array(flange), start.T_camera_boards
    # the angle of a relative turn does not depend on how camera and board are mounted
    differences = []
    for i in range(len(robot)):
        for j in range(i):
            by_robot = np.linalg.inv(robot[i]) @ robot[j]
            by_camera = np.linalg.inv(seen[i]) @ seen[j]
            angles = [np.linalg.norm(log_rotation(T[:3, :3])) for T in (by_robot, by_camera)]
            differences.append(np.degrees(abs(angles[0] - angles[1])))
    median = float(np.median(differences))
    assert median < 0.5, f"board turns differ from the robot's by {median:.3f} degrees (median)"


@needs_real
def test_tags_of_25_px_with_known_corners():
    """A drawn frame of 154 tags: nearly all are fitted, nearer the truth than OpenCV's corners.

    The frame's inner cells are painted on half pixels and its truth is that of the outer border,
    so that neither can come nearer than about 0.15 px.
    """
    folder = REAL / "icra2020_frame0037"
    image = grey_image(folder / "0037.png")
    tags = json.loads((folder / "0037.json").read_text())["tags"]
    # listed BR BL TL TR by the pixel's corner; here TL TR BR BL by its centre
    true = {tag["tag_id"]: np.roll(tag["corners"][::-1], 2, axis=0) - 0.5 for tag in tags}
    parameters = cv2.aruco.DetectorParameters()
    parameters.minMarkerPerimeterRate = 0.01
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.ArucoDetector(tag_dictionary("tag36h11"), parameters)
    quads, ids, _ = detector.detectMarkers(image)
    theirs = [np.reshape(q, (4, 2)) - true[i] for q, i in zip(quads, np.ravel(ids), strict=True)]
    rng, grid = np.random.default_rng(0), pixel_rays((image.shape[1], image.shape[0]))
    ours = []
    for tag_id, corners in true.items():
        guess = corners + rng.normal(0.0, 0.3, (4, 2))
        fit = fit_tag(image, grid, guess, guess, rimmed_cells("tag36h11", tag_id))
        ours += [] if fit is None else [fit.rays - corners]
    error, cv_error = (float(np.sqrt(np.mean(np.square(e)))) for e in (ours, theirs))
    said = f"{len(ours)} tags to {error:.3f} px; OpenCV {len(theirs)} to {cv_error:.3f} px"
    assert len(ours) >= 150, said
    assert error < min(0.22, cv_error), said
    assert np.abs(np.mean(ours, axis=(0, 1))).max() < 0.03, said
