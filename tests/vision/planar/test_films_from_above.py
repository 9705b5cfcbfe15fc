"""`track --planar` from a film to kg m2, and what is wrong with a film by name."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from freeswing.calib.camera.cameras_file import write_cameras
from freeswing.cdpr.files.trajectory_csv import read_csv
from freeswing.main import main
from freeswing.session.session_file import read_session
from freeswing.vision.planar.two_dots import COLUMNS
from freeswing.vision.render.patterns import Sphere
from tests.oracle.recorded.benches import PLATFORM_COM_M, PLATFORM_KG_M2
from tests.vision.planar.benches_from_above import (
    bench_motion,
    bright_dots,
    film,
    known_dots,
    phone,
    phone_below,
    plate_tag,
    true_coordinates,
    write_bench,
)

SHORT_S = 3.0
MASS_KG = 1.26  # as the oracle's platform has it
RUNS = {"a": 11, "b": 12}


def track(folder: Path) -> int:
    """The command, as a user gives it."""
    return main(["track", str(folder), "--planar", "--workers", "1"])


@pytest.mark.slow
def test_one_phone_above_a_trifilar_bench_gives_its_inertia(tmp_path: Path, capsys) -> None:
    """No cameras.toml, one tag, a phone that leans: film, track --planar, identify."""
    tag = plate_tag()
    write_bench(tmp_path, tuple(RUNS), [tag], MASS_KG)
    motions = {run: bench_motion(seed, 8.0) for run, seed in RUNS.items()}
    for run, motion in motions.items():
        film(tmp_path / "runs" / run, motion, 7.9, [tag])
    assert track(tmp_path) == 0, capsys.readouterr().err
    assert "the lens is not known" in capsys.readouterr().out
    for run, motion in motions.items():
        found = read_csv(tmp_path / "results" / "tracks" / f"{run}.csv")
        assert found.coordinates == ("x", "y", "chi")
        off = found.values - found.values.mean(axis=0) - true_coordinates(motion, found.times_s)
        assert off[:, 2].std() < 8e-4, off[:, 2].std()
        assert off[:, :2].std(axis=0).max() < 1.5e-4, off[:, :2].std(axis=0)
        assert found.standard_deviations() is not None
    assert main(["identify", str(tmp_path)]) == 0, capsys.readouterr().err
    told = json.loads((tmp_path / "results" / "identification.json").read_text())
    rows = {row["name"]: row for row in told["objects"][0]["parameters"]}
    izz = PLATFORM_KG_M2[2] + MASS_KG * float(np.sum(PLATFORM_COM_M[:2] ** 2))
    found_izz = rows["Izz_P_kg_m2"]
    assert abs(found_izz["value"] / izz - 1.0) < 0.01, found_izz
    assert abs(found_izz["value"] - izz) < 3.0 * found_izz["std"], found_izz


@pytest.mark.slow
@pytest.mark.parametrize("camera", [phone, phone_below])
def test_dots_at_known_places_from_above_and_from_below(tmp_path: Path, capsys, camera) -> None:
    """Three dots, nothing calibrated, nobody says from which side they are seen."""
    dots = known_dots()
    write_bench(tmp_path, tuple(RUNS), (), MASS_KG, dots)
    spheres = [Sphere(one.position_m, 0.016) for one in dots]
    motions = {run: bench_motion(seed, 8.0) for run, seed in RUNS.items()}
    for run, motion in motions.items():
        film(tmp_path / "runs" / run, motion, 7.9, spheres=spheres, camera=camera)
    assert track(tmp_path) == 0, capsys.readouterr().err
    for run, motion in motions.items():
        found = read_csv(tmp_path / "results" / "tracks" / f"{run}.csv")
        true = true_coordinates(motion, found.times_s)
        off = found.values - found.values.mean(axis=0) - true
        assert off[:, 2].std() < 8e-4, off[:, 2].std()
        assert off[:, :2].std(axis=0).max() < 1.5e-4, off[:, :2].std(axis=0)
    assert main(["identify", str(tmp_path)]) == 0, capsys.readouterr().err
    told = json.loads((tmp_path / "results" / "identification.json").read_text())
    found_izz = {row["name"]: row for row in told["objects"][0]["parameters"]}["Izz_P_kg_m2"]
    izz = PLATFORM_KG_M2[2] + MASS_KG * float(np.sum(PLATFORM_COM_M[:2] ** 2))
    assert abs(found_izz["value"] / izz - 1.0) < 0.01, found_izz
    assert abs(found_izz["value"] - izz) < 3.0 * found_izz["std"], found_izz


@pytest.mark.slow
@pytest.mark.parametrize("lens_known", [False, True])
@pytest.mark.parametrize("seen", ["tag", "dots"])
def test_two_wires_from_above(tmp_path: Path, capsys, seen: str, lens_known: bool) -> None:
    """Yaw nearly as slow as sway, roll beside it: film, track --planar, identify."""
    tags = [plate_tag()] if seen == "tag" else []
    dots = known_dots() if seen == "dots" else ()
    write_bench(tmp_path, tuple(RUNS), tags, MASS_KG, dots, wires=2)
    if lens_known:
        write_cameras(tmp_path / "cameras.toml", (phone(),))
        path = tmp_path / "session.toml"
        path.write_text(path.read_text().replace("planar", 'cameras = "cameras.toml"\nplanar'))
    spheres = [Sphere(one.position_m, 0.016) for one in dots]
    for run, seed in RUNS.items():
        film(tmp_path / "runs" / run, bench_motion(seed, 8.0, wires=2), 7.9, tags, spheres=spheres)
    assert track(tmp_path) == 0, capsys.readouterr().err
    assert ("the lens is not known" in capsys.readouterr().out) != lens_known
    assert main(["identify", str(tmp_path)]) == 0, capsys.readouterr().err
    told = json.loads((tmp_path / "results" / "identification.json").read_text())
    found_izz = {row["name"]: row for row in told["objects"][0]["parameters"]}["Izz_P_kg_m2"]
    izz = PLATFORM_KG_M2[2] + MASS_KG * float(np.sum(PLATFORM_COM_M[:2] ** 2))
    assert abs(found_izz["value"] / izz - 1.0) < 0.005, found_izz
    assert abs(found_izz["value"] - izz) < 3.0 * found_izz["std"], found_izz


def test_two_dots_without_a_target_become_channels_of_the_session(tmp_path: Path, capsys) -> None:
    """The block is printed, and written where asked; identify then reads the columns."""
    write_bench(tmp_path, ["a"])
    motion = bench_motion(5, SHORT_S)
    film(tmp_path / "runs" / "a", motion, SHORT_S, spheres=bright_dots())
    assert track(tmp_path) == 0, capsys.readouterr().err
    printed = capsys.readouterr().out
    assert 'column = "dot1_px"' in printed
    assert "are not looked for by one camera from above" in printed
    header = (tmp_path / "results" / "tracks" / "a.csv").read_text().splitlines()[0]
    assert header == "t_s,dot1_px,dot2_px,std_dot1_px,std_dot2_px"
    assert main(["track", str(tmp_path), "--write-channels", "--workers", "1"]) == 0
    assert [one.column for one in read_session(tmp_path).channels] == list(COLUMNS)
    rows = np.genfromtxt(tmp_path / "results" / "tracks" / "a.csv", delimiter=",", names=True)
    chi = true_coordinates(motion, rows["t_s"])[:, 2]
    apart = rows[COLUMNS[1]] - rows[COLUMNS[0]]  # sway moves both alike
    assert abs(np.corrcoef(apart, chi)[0, 1]) > 0.999, np.corrcoef(apart, chi)


@pytest.mark.parametrize(
    ("printed", "declared", "said"),
    [
        ((plate_tag(7),), (plate_tag(3),), "there are tag36h11 7: correct family and id"),
        (
            (plate_tag(3), plate_tag(3, 0.1, (-0.12, 0.0, 0.0))),
            (plate_tag(3),),
            "tag36h11 3 is there twice",
        ),
        ((plate_tag(3, 0.1),), (plate_tag(3, 0.2),), "times what it is"),
    ],
)
def test_what_is_wrong_with_the_tags_is_named(
    tmp_path: Path, capsys, printed, declared, said: str
) -> None:
    """Another id, one id twice, a size of twice."""
    write_bench(tmp_path, ["a"], declared)
    film(tmp_path / "runs" / "a", bench_motion(5, SHORT_S), SHORT_S, printed)
    assert track(tmp_path) == 1
    assert said in capsys.readouterr().err


def test_a_phone_that_is_knocked_is_named(tmp_path: Path, capsys) -> None:
    """By 8 mm at 3.4 s: the run is refused with the time, and serves before it."""
    tag = plate_tag()
    write_bench(tmp_path, ["a"], [tag])
    film(tmp_path / "runs" / "a", bench_motion(5, 6.0), 6.0, [tag], knocked_s=3.4)
    assert track(tmp_path) == 1
    told = capsys.readouterr().err
    assert "at 3.4" in told, told
    assert "camera was moved" in told, told
    path = tmp_path / "session.toml"
    path.write_text(path.read_text() + "window_s = [0.0, 3.3]\n")
    assert track(tmp_path) == 0, capsys.readouterr().err


def test_a_film_from_above_takes_one_camera(tmp_path: Path, capsys) -> None:
    """Two recordings of one run are for calibrated cameras."""
    tag = plate_tag()
    write_bench(tmp_path, ["a"], [tag])
    film(tmp_path / "runs" / "a", bench_motion(5, SHORT_S), 0.2, [tag])
    (tmp_path / "runs" / "a" / "other.mkv").write_bytes(
        (tmp_path / "runs" / "a" / "phone.mkv").read_bytes()
    )
    assert track(tmp_path) == 2
    assert "--planar takes one camera a run" in capsys.readouterr().err
