"""What gives a map scale and frame, and what refuses it, on a made-up map: no COLMAP needed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from freeswing.calib.camera.camera import Camera
from freeswing.calib.rig.normal_equations import Problem
from freeswing.calib.scene.calibrate_scene import calibrate_scene, refuse_untied
from freeswing.calib.scene.chosen_points import chosen_points
from freeswing.calib.scene.clicked_points import Click, clicked, read_clicks
from freeswing.calib.scene.frame_by_survey import roughly_in_base, similarity, tied_to_survey
from freeswing.calib.scene.lab_map import LabMap
from freeswing.calib.scene.scale_by_distances import DISTANCE_SIGMAS, scale_of, with_distances
from freeswing.calib.scene.scene_rig import rig_of_map, rig_part
from freeswing.calib.scene.scene_verdict import (
    SceneChecks,
    growth_of,
    halves_of,
    judge_scene,
)
from freeswing.calib.scene.source import SceneSource
from freeswing.calib.scene.stills import Still, walk_stills
from freeswing.calib.scene.tape_measured import Distance, SurveyedPoint
from freeswing.cdpr.files.documents import DataError, InputError
from freeswing.cdpr.rotation import exp_rotation, transform
from freeswing.main import main
from tests.calib.scene import rooms

NOISE_PX, RIG = 0.1, 2
PLACES = {"A": (-1.9, -0.4, 0.7), "B": (-0.3, -1.9, 0.5), "C": (-1.0, -1.2, 0.0)}


def cameras() -> tuple[Camera, ...]:
    """Two cameras of the rig, side by side for once, and eight images of the walk."""
    two = [
        replace(one, name=f"cam{k}", T_camera_base=rooms.looking(eye, (-1.2, -1.2, 0.5)))
        for k, (one, eye) in enumerate(
            zip(rooms.rig(2), ((1.7, 1.2, 2.1), (0.6, 1.7, 1.2)), strict=True)
        )
    ]
    eyes = [
        (1.5 * np.cos(a), 1.5 * np.sin(a), 1.0 + 0.1 * k)
        for k, a in enumerate(np.linspace(-0.3, 1.9, 8))
    ]
    look = [(-1.3, -1.0 - 0.05 * k, 0.4 + 0.05 * k) for k in range(8)]
    carried = [
        Camera(f"walk{k}", rooms.PHONE_PX, "OPENCV", rooms.PHONE, rooms.looking(e, a, 0.1 * k))
        for k, (e, a) in enumerate(zip(eyes, look, strict=True))
    ]
    return (*two, *carried)


@pytest.fixture(scope="module")
def made():
    """Images, the map that COLMAP could have made of them, and clicks."""
    random = np.random.default_rng(3)
    true, flat = (
        cameras(),
        random.uniform(-1.0, 1.0, (400, 3)) * (0.9, 0.9, 0.6) + (-1.0, -1.0, 0.6),
    )
    side = random.integers(0, 3, 400)
    flat[side == 0, 0], flat[side == 1, 1], flat[side == 2, 2] = -2.0, -2.0, 0.0
    turn, scale = (
        transform(exp_rotation(np.array([0.3, -0.2, 0.9])), np.array([1.0, 2.0, 3.0])),
        0.31,
    )
    rows, clicks, poses = [], [], []
    for k, camera in enumerate(true):
        inside = camera.to_camera(flat)
        pixels = camera.project(inside) + NOISE_PX * random.normal(size=(400, 2))
        seen = np.flatnonzero(camera.sees(inside))
        rows += [(k, p, *pixels[p]) for p in seen.tolist()]
        for name, place in PLACES.items():
            at = camera.to_camera(np.array([place]))
            if camera.sees(at)[0]:
                pixel = camera.project(at)[0] + NOISE_PX * random.normal(size=2)
                clicks.append(Click(camera.name, name, pixel, NOISE_PX))
        pose = camera.T_camera_base @ np.linalg.inv(turn)
        pose[:3, 3] *= scale
        poses.append(pose)
    seen = np.array(rows)
    points = scale * (flat @ turn[:3, :3].T + turn[:3, 3])
    start = np.array([camera.params * (1.002 if k > 3 else 1.0) for camera in true for k in [0]])
    found = LabMap(
        np.array(poses), start, seen[:, 0].astype(int), seen[:, 1].astype(int), seen[:, 2:],
        np.full(len(seen), 1.0), points, np.zeros((len(true), len(true))),
    )  # fmt: skip
    stills = [
        Still(camera.name, np.zeros(camera.size_px[::-1], np.uint8), walk=k >= RIG)
        for k, camera in enumerate(true)
    ]
    return true, stills, found, clicks, rig_of_map(found, stills, "OPENCV")


def test_all_images_of_the_walk_have_one_lens(made) -> None:
    _, _, _, _, rig = made
    walk = [camera.params for camera in rig.cameras[RIG:]]
    np.testing.assert_array_equal(walk, np.tile(walk[0], (len(walk), 1)))
    problem: Problem = rig.problem
    assert problem.equal is not None
    assert problem.equal.shape == (2, 8 * 7)


def test_a_known_distance_gives_the_scale_and_its_deviation(made) -> None:
    true, _, _, clicks, rig = made
    sigma = rig.adjustment.sigma_px
    marks = clicked(rig.cameras, sigma, [SurveyedPoint(k, np.zeros(3)) for k in "AB"], clicks)
    length = float(np.linalg.norm(np.subtract(PLACES["A"], PLACES["B"])))
    found = with_distances(rig, marks, [Distance(("A", "B"), length, 0.002)])
    apart = np.linalg.norm(found.cameras[1].position_base_m - found.cameras[0].position_base_m)
    truth = np.linalg.norm(true[1].position_base_m - true[0].position_base_m)
    t = found.cameras[1].T_camera_base[:3, 3]
    own = slice(16 + 8, 16 + 11)
    std = float(np.sqrt(t @ found.adjustment.covariance[own, own] @ t)) / apart
    assert abs(apart - truth) < 3.0 * std, (apart, truth, std)
    assert std > 0.9 * 0.002 / length * apart, std
    assert std < 0.02, std


def test_a_survey_gives_the_frame(made) -> None:
    true, _, _, clicks, rig = made
    points = [SurveyedPoint(name, np.array(place), 0.0005) for name, place in PLACES.items()]
    fixed = clicked(rig.cameras, rig.adjustment.sigma_px, points, clicks)
    found = tied_to_survey(roughly_in_base(rig, fixed), fixed)
    part = rig_part(found, RIG)
    for k, camera in enumerate(part.cameras):
        own = slice(16 * k + 8, 16 * k + 11)
        error = camera.T_camera_base[:3, 3] - true[k].T_camera_base[:3, 3]
        chi2 = error @ np.linalg.solve(part.adjustment.covariance[own, own], error)
        assert chi2 < 16.3, (camera.name, error, chi2)  # one in 1000 by chance


def test_halves_of_white_noise_do_not_grow_deviations_much(made) -> None:
    _, _, _, _, rig = made
    free = rig_part(rig, RIG).problem.free
    growth = growth_of(*halves_of(rig, RIG), free)
    assert 1.0 <= growth < 2.0, growth


def test_points_on_a_line_give_no_frame() -> None:
    line = np.outer(np.arange(4.0), [1.0, 2.0, 0.5])
    with pytest.raises(DataError, match="three that are not on one line"):
        similarity(line, line)


@pytest.mark.parametrize(
    ("sigmas", "refused"), [(DISTANCE_SIGMAS - 1.0, False), (DISTANCE_SIGMAS + 4.0, True)]
)
def test_distances_that_disagree_are_named(sigmas, refused) -> None:
    std = np.array([0.001, 1e-5])
    arguments = (
        np.array([2.0 * (1.0 + sigmas * 0.001), 2.0]),
        np.zeros((2, 3)),
        np.eye(3),
        std,
        ["A to B", "B to C"],
    )
    if refused:
        with pytest.raises(DataError, match=r"distance A to B is \+0.80 % off"):
            scale_of(*arguments)
        return
    scale, _, known = scale_of(*arguments)
    assert scale == pytest.approx(2.0, rel=1e-5)
    assert known == pytest.approx(1e-5, rel=0.01)


def test_the_camera_that_could_not_be_tied_in_is_named(made) -> None:
    _, stills, found, _, _ = made
    poses = found.poses.copy()
    poses[1] = np.nan
    shared = found.shared.copy()
    shared[1, 4] = 11
    with pytest.raises(
        DataError, match=r"camera cam1 could not be tied in: .*walk/walk2.png, 11 feat"
    ):
        refuse_untied(replace(found, poses=poses, shared=shared), stills)
    refuse_untied(found, stills)


def test_points_seen_most_often_are_chosen() -> None:
    camera = np.array([0, 0, 1, 1, 2, 2, 2, 3])
    point = np.array([0, 1, 0, 1, 0, 1, 2, 0])
    np.testing.assert_array_equal(chosen_points(camera, point, np.zeros(4, bool)), [0, 1])


@pytest.mark.parametrize(
    ("points", "refuses"), [(39, True), (40, False), (199, False), (200, None)]
)
def test_few_points_warn_and_very_few_refuse(made, points, refuses) -> None:
    _, _, _, _, rig = made
    part = rig_part(rig, RIG)
    checks = SceneChecks(1.0, 1e-4, 1e-4, np.ones(3), np.ones(RIG), np.array([points, 1000]))
    said = [
        one.refuses for one in judge_scene(part, checks) if "points of the laboratory" in one.text
    ]
    assert said == ([] if refuses is None else [refuses])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("image,u_px\n", "line 1: no column point, v_px"),
        ("image,point,u_px,v_px\ncam9,A,1,2\n", "line 2: image 'cam9' is none of them: cam0"),
        ("image,point,u_px,v_px\ncam0,Z,1,2\n", "line 2: point 'Z' is in no surveyed point"),
        ("image,point,u_px,v_px\ncam0,A,x,2\n", "line 2: u_px, v_px or std_px is not a number"),
        ("image,point,u_px,v_px,std_px\ncam0,A,1,2,0\n", "line 2: u_px, v_px must be pixels"),
    ],
)
def test_marks_that_make_no_sense_are_refused(tmp_path, text, said) -> None:
    path = tmp_path / "clicks.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        read_clicks(path, ["cam0"], ["A"])


def test_nothing_that_gives_a_scale_is_said_before_anything_is_read() -> None:
    with pytest.raises(InputError, match="nothing gives the laboratory its size"):
        calibrate_scene(SceneSource(Path("nowhere")), (), Path("kept"))


def test_a_walk_that_is_not_there(tmp_path) -> None:
    with pytest.raises(InputError, match="no such folder of stills, and no video"):
        walk_stills(tmp_path / "walk")


def test_the_command_says_what_the_session_lacks(tmp_path, capsys) -> None:
    (tmp_path / "session.toml").write_text(
        'format = "freeswing-session/1"\nname = "a"\nrobot = "robot.toml"\n'
        '[[runs]]\nname = "a"\nrole = "identify"\nvideo = "runs/a"\n'
    )
    assert main(["calibrate", str(tmp_path), "--scene"]) == 2
    assert "--scene needs [calibration.scene]" in capsys.readouterr().err
