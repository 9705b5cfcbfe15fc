"""A plumb line gives the vertical with the deviation it claims, and says what is wrong with it."""

import json
import shutil

import numpy as np
import pytest

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import read_cameras
from freeswing.calib.camera.lens_models import PARAMETER_NAMES
from freeswing.calib.verdict.calibration_result import CameraCovariance
from freeswing.calib.verdict.plumb_line import StringView, find_vertical, vertical_entry
from freeswing.calib.verdict.plumb_line_file import read_plumb_line
from freeswing.cdpr.files.documents import DataError, InputError
from freeswing.cdpr.rotation import exp_rotation
from freeswing.main import main
from tests.calib import rigs
from tests.places import SAMPLES

G = 9.80665
DOWN = exp_rotation(np.array([0.03, -0.02, 0.0])) @ [0.0, 0.0, -1.0]
SAMPLE = SAMPLES / "filmed"


def string_views(cameras, strings, std_px=0.5, rng=None, down=DOWN):
    """Twelve points along each string, as every camera sees it; exact without a generator."""
    views = []
    for name, top in strings.items():
        points = np.array(top) + np.linspace(0.0, 0.8, 12)[:, None] * down
        for camera in cameras:
            pixels = camera.project(camera.to_camera(points))
            pixels = pixels if rng is None else pixels + std_px * rng.normal(size=pixels.shape)
            views.append(StringView(camera.name, name, pixels, np.full(len(pixels), std_px)))
    return tuple(views)


def known_rig(cameras, lens_std=(), turn_std_rad=0.0):
    """Covariance of a rig whose cameras err alone: lenses in the given steps, then rotations."""
    names, deviations = [], []
    for camera in cameras:
        lens = PARAMETER_NAMES[camera.model]
        turns = ("tx_m", "ty_m", "tz_m", "rx_rad", "ry_rad", "rz_rad")
        names += [f"{camera.name}.{entry}" for entry in (*lens, *turns)]
        deviations += [*(lens_std or [0.0] * len(lens)), *[0.0] * 3, *[turn_std_rad] * 3]
    return CameraCovariance(tuple(names), np.diag(np.square(deviations)))


def disturbed(camera, lens_std, turn_std_rad, rng):
    pose = camera.T_camera_base.copy()
    pose[:3, :3] = exp_rotation(turn_std_rad * rng.normal(size=3)) @ pose[:3, :3]
    params = camera.params + np.array(lens_std) * rng.normal(size=len(camera.params))
    return Camera(camera.name, camera.size_px, camera.model, params, pose)


def test_exact_points_give_the_exact_vertical():
    cameras = rigs.rig(3)
    views = string_views(cameras, {"a": (0.1, 0.0, 0.4), "b": (-0.2, 0.1, 0.35)})
    found = find_vertical(cameras, views, known_rig(cameras))
    error = float(np.linalg.norm(found.down_base - DOWN))
    assert error < 1e-8, f"{error} rad"
    assert found.degrees_of_freedom == 6 * 12 - 6 - 2
    assert found.scatter < 1e-4, found.scatter


@pytest.mark.slow
@pytest.mark.parametrize(("lens_share", "turn_std_rad"), [(0.0, 0.0), (1.0, 1.5e-3)])
def test_the_claimed_deviation_is_the_true_one(lens_share, turn_std_rad):
    """Normalised error squared of 150 draws against chi-square of two degrees, 3.5 deviations."""
    cameras, rng = rigs.rig(3), np.random.default_rng(5)
    lens_std = lens_share * np.array([3.0, 3.0, 2.0, 2.0, 3e-3, 3e-3, 2e-4, 2e-4])
    covariance = known_rig(cameras, list(lens_std), turn_std_rad)
    strings = {"a": (0.1, 0.0, 0.4)}
    squares = []
    for _ in range(150):
        views = string_views(cameras, strings, rng=rng)
        used = [disturbed(camera, lens_std, turn_std_rad, rng) for camera in cameras]
        found = find_vertical(used, views, covariance)
        error = DOWN - found.down_base
        squares.append(error @ np.linalg.pinv(found.covariance, rcond=1e-6) @ error)
    mean, band = float(np.mean(squares)), 3.5 * 2.0 / np.sqrt(150)
    assert abs(mean - 2.0) < band, f"mean normalised error squared {mean:.3f}, 2 expected"


def test_two_strings_in_one_camera_are_enough():
    """Images of parallel strings meet in the vertical's vanishing point."""
    cameras, rng = rigs.rig(1), np.random.default_rng(1)
    down = np.array([-0.4, 0.0, -0.9165])
    strings = {"a": (0.3, 0.6, 0.3), "b": (0.3, -0.6, 0.3)}
    views = string_views(cameras, strings, 0.2, rng, down / np.linalg.norm(down))
    found = find_vertical(cameras, views, known_rig(cameras))
    error = float(np.linalg.norm(found.down_base - down / np.linalg.norm(down)))
    claimed = float(np.sqrt(np.linalg.eigvalsh(found.covariance)[-1]))
    assert error < 4.0 * claimed, f"{error} rad, claimed {claimed}"


def test_one_plane_is_refused():
    """Two strings one behind the other, and one string clicked twice in one camera."""
    cameras, rng = rigs.rig(1), np.random.default_rng(2)
    views = string_views(cameras, {"a": (0.1, 0.0, 0.4)}, rng=rng)
    again = string_views(cameras, {"again": (0.1, 0.0, 0.4)}, rng=rng)
    with pytest.raises(DataError, match=r"nearly one.*from another side, or a second string"):
        find_vertical(cameras, (*views, *again), known_rig(cameras))


def test_a_string_clicked_upwards_is_named():
    cameras = rigs.rig(2)
    first, second = string_views(cameras, {"a": (0.1, 0.0, 0.4)})
    upwards = StringView(second.camera, "a", second.pixels[::-1], second.std_px)
    with pytest.raises(DataError, match=r"'a' in camera cam1 clicked in the other direction"):
        find_vertical(cameras, (first, upwards), known_rig(cameras))


@pytest.mark.parametrize(
    ("down", "verdict", "said"),
    [
        (DOWN, "agrees", "agree within 3 deviations"),
        ([0.0, 0.0, -1.0], "differs", "set gravity_m_s2 = ["),
        (-DOWN, "differs", "from the bottom up, or set gravity_m_s2"),
    ],
)
def test_declared_gravity_is_judged(down, verdict, said):
    cameras = rigs.rig(3)
    views = string_views(cameras, {"a": (0.1, 0.0, 0.4)}, rng=np.random.default_rng(3))
    found = find_vertical(cameras, views, known_rig(cameras))
    entry = vertical_entry(found, views, G * np.array(down))
    assert entry["verdict"] == verdict, entry["sentence"]
    assert said in entry["sentence"], entry["sentence"]
    true_mrad = 1e3 * np.arccos(np.clip(np.dot(DOWN, down), -1.0, 1.0))
    off, limit = abs(entry["angle_to_gravity_mrad"] - true_mrad), 4.0 * entry["angle_std_mrad"]
    assert off < limit, f"{off} mrad from the true angle, limit {limit}"
    set_to = np.array(entry["gravity_m_s2"])
    assert np.linalg.norm(set_to) == pytest.approx(G)
    assert np.linalg.norm(set_to / G - DOWN) < limit * 1e-3, set_to


def test_a_swaying_string_gives_no_advice():
    cameras, rng = rigs.rig(3), np.random.default_rng(4)
    still = string_views(cameras[:2], {"a": (0.1, 0.0, 0.4)}, rng=rng)
    tilted = exp_rotation(np.array([0.0, 0.05, 0.05])) @ DOWN
    moved = string_views(cameras[2:], {"a": (0.1, 0.0, 0.4)}, rng=rng, down=tilted)
    found = find_vertical(cameras, (*still, *moved), known_rig(cameras))
    entry = vertical_entry(found, (*still, *moved), np.array([0.0, 0.0, -G]))
    assert entry["verdict"] == "inconsistent", entry
    assert "set gravity" not in entry["sentence"], entry["sentence"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("camera,u_px\nleft,1\n", "no column v_px"),
        ("camera,u_px,v_px\n", "holds no string"),
        ("camera,u_px,v_px\nleft,1,2\nleft,1,300\n", "only string '1' in camera left; click"),
        ("camera,u_px,v_px\nmiddle,1,2\n", "camera 'middle' is not one of left, right"),
        ("camera,u_px,v_px\nleft,1,nan\n", "below 1e6"),
        ("camera,u_px,v_px\nleft,1\n", "line 2: u_px, v_px or std_px is not a number"),
        ("camera,u_px,v_px,std_px\nleft,1,2,0\n", "std_px from"),
        ("camera,u_px,v_px\nleft,1,2\nleft,1,9\n", "7.0 px apart, which is less than 10.0"),
    ],
)
def test_files_that_make_no_sense_are_refused(tmp_path, text, said):
    path = tmp_path / "plumb_line.csv"
    path.write_text(text)
    with pytest.raises(InputError) as refusal:
        read_plumb_line(path, ("left", "right"))
    assert said in str(refusal.value), refusal.value


def write_clicks(path, views):
    rows = [f"{v.camera},{v.line},{u:.4f},{w:.4f}" for v in views for u, w in v.pixels]
    path.write_text("\n".join(["camera,line,u_px,v_px", *rows]) + "\n")


def test_what_is_written_is_read(tmp_path):
    views = string_views(rigs.rig(2), {"a": (0.1, 0.0, 0.4), "b": (-0.2, 0.1, 0.35)})
    write_clicks(tmp_path / "plumb_line.csv", views)
    found = read_plumb_line(tmp_path / "plumb_line.csv", ("cam0", "cam1"))
    assert sorted(map(str, found)) == sorted(map(str, views))
    np.testing.assert_allclose(found[0].pixels, views[0].pixels, atol=1e-4)
    assert (found[0].std_px == 0.5).all()


def test_a_camera_that_is_not_there_stops_the_command(tmp_path, capsys):
    shutil.copytree(SAMPLE, tmp_path / "filmed", ignore=shutil.ignore_patterns("runs"))
    (tmp_path / "filmed/calibration/plumb_line.csv").write_text("camera,u_px,v_px\ntop,1,2\n")
    assert main(["calibrate", str(tmp_path / "filmed"), "--quiet"]) == 2
    said = capsys.readouterr().err
    assert "camera 'top' is not one of left, right" in said


@pytest.mark.slow
def test_a_tilted_world_is_told_through_the_command_line(tmp_path, capsys):
    """The filmed sample with strings along another vertical than its robot.toml declares."""
    folder = tmp_path / "filmed"
    shutil.copytree(SAMPLE, folder, ignore=shutil.ignore_patterns("runs"))
    cameras = read_cameras(SAMPLE / "truth" / "cameras.toml")
    strings = {"a": (1.0, 0.6, 0.2), "b": (1.6, 0.3, 0.2)}
    views = string_views(cameras, strings, rng=np.random.default_rng(6))
    write_clicks(folder / "calibration/plumb_line.csv", views)
    assert main(["calibrate", str(folder), "--quiet"]) == 0
    said = capsys.readouterr().err
    document = json.loads((folder / "results/calibration.json").read_text())
    entry = document["vertical"]
    assert entry["verdict"] == "differs", entry
    assert entry["sentence"] in said, said
    error_mrad = 1e3 * float(np.linalg.norm(np.array(entry["down_base"]) - DOWN))
    limit_mrad = 4.0 * 1e3 * float(np.sqrt(np.linalg.eigvalsh(entry["covariance"])[-1]))
    assert error_mrad < limit_mrad, f"{error_mrad} mrad, limit {limit_mrad}"
    read = document["provenance"]["inputs"]
    assert {"robot.toml", "calibration/plumb_line.csv"} <= set(read), sorted(read)
