"""`diagnose` on independent simulated benches: what the files do not say is named, and mended."""

from __future__ import annotations

from pathlib import Path

import pytest

from freeswing.main import main
from tests.oracle.recorded.benches import CLEAN, PLATFORM_COM_M, Hidden, make_bench
from tests.samples.expectations import result

MASS_KG = 1.2  # of the platform, for which effects over the mass are told


def diagnosed(folder: Path, hidden: Hidden, wires: int = 3) -> tuple[dict, float, float]:
    """The result of a session, and by how much the object's Izz is off before and after."""
    truth = make_bench(folder, 3, wires, duration_s=6.0, counts=(2, 1, 2), hidden=hidden)
    out = folder / "out"
    assert main(["diagnose", str(folder), "--results", str(out), "--quiet"]) == 0
    told = result(out, "diagnosis")
    off = []
    for key in ("objects_before", "objects_after"):
        rows = {row["name"]: row for row in told[key][1]["parameters"]}
        off.append(abs(rows["Izz_kg_m2"]["value"] / truth.load_izz - 1.0))
    deviations = off[1] * truth.load_izz / rows["Izz_kg_m2"]["std"]
    assert deviations < 3.0, rows["Izz_kg_m2"]
    return told, off[0], off[1]


def accepted(told: dict) -> dict[str, dict[str, float]]:
    return {
        one["effect"]: {row["name"]: row["value"] for row in one["parameters"]}
        for one in told["accepted"]
    }


@pytest.mark.slow
@pytest.mark.parametrize("wires", [2, 3])
def test_a_clean_bench_lacks_nothing(tmp_path: Path, wires: int) -> None:
    told, _, _ = diagnosed(tmp_path, CLEAN, wires)
    assert told["accepted"] == [], told["accepted"]
    assert not told["unexplained"]["present"], told["unexplained"]


@pytest.mark.slow
def test_undeclared_drag(tmp_path: Path) -> None:
    told, before, after = diagnosed(tmp_path, Hidden(0.0, 1.0, 2e-3, 0.02))
    found = accepted(told)
    assert found["rotational_drag"]["rate_m2_s"] == pytest.approx(2e-3 / MASS_KG, rel=0.05), found
    assert "cable_length_bias" not in found, found
    assert after < before, (before, after)
    assert after < 0.005, after
    assert told["after"]["prediction_rmse_rad"] < 0.5 * told["before"]["prediction_rmse_rad"]


@pytest.mark.slow
@pytest.mark.parametrize("wires", [2, 3])
def test_a_wire_that_is_2_mm_long(tmp_path: Path, wires: int) -> None:
    """What it cannot be told from is said, with the measurement that would."""
    told, _, _ = diagnosed(tmp_path, Hidden(0.002, 1.0, 0.0, 0.0), wires)
    (one,) = told["accepted"]
    assert (one["effect"], one["part"]) == ("cable_length_bias", "1"), one
    assert one["parameters"][0]["value"] == pytest.approx(0.002, rel=0.1), one
    (row,) = [row for row in told["candidates"] if row["effect"] == "cable_length_bias"]
    assert "attachment_offset" in row["confounded_with"], row
    assert "exchange the wires" in row["experiment"], row


@pytest.mark.slow
def test_a_bench_that_is_not_level(tmp_path: Path) -> None:
    told, before, after = diagnosed(tmp_path, Hidden(0.0, 1.0, 0.0, 0.0, (0.01, -0.006)))
    found = accepted(told)
    tilt = found["gravity_tilt"]
    assert tilt["tilt_x_rad"] == pytest.approx(0.01, abs=3e-4), tilt
    assert tilt["tilt_y_rad"] == pytest.approx(-0.006, abs=3e-4), tilt
    assert after < 0.5 * before, (before, after)
    assert after < 0.005, after


@pytest.mark.slow
def test_wires_that_stretch(tmp_path: Path) -> None:
    """EA of 2.5 kN: 1.9 mm under the platform, 3.1 mm with the object."""
    told, before, after = diagnosed(tmp_path, Hidden(0.0, 1.0, 0.0, 0.0, stiffness_ea_n=2500.0))
    found = accepted(told)
    stretch = found["cable_elasticity"]["mass_over_stiffness_s2_m"]
    assert stretch == pytest.approx(MASS_KG / 2500.0, rel=0.15), found
    assert after <= before + 1e-4, (before, after)
    assert after < 0.005, after


@pytest.mark.slow
def test_an_eccentric_clamp(tmp_path: Path) -> None:
    """The first wire's lower end 5 mm beside its place: named, to a tenth of a millimetre."""
    hidden = Hidden(0.0, 1.0, 0.0, 0.0, eccentric_m=(0.003, -0.004, 0.0))
    told, before, after = diagnosed(tmp_path, hidden)
    (one,) = told["accepted"]
    assert (one["effect"], one["part"]) == ("attachment_offset", "1"), one
    values = [row["value"] for row in one["parameters"]]
    assert values == pytest.approx([0.003, -0.004], abs=1e-4), one
    assert after < 0.005, (before, after)


@pytest.mark.slow
def test_a_clamp_that_holds_yaw_is_named_with_the_mass_that_looks_alike(tmp_path: Path) -> None:
    """20 mN m a radian. One run with the known mass tells it from nothing, not from a mass."""
    hidden = Hidden(0.0, 1.0, 0.0, 0.0, hold_n_m=0.02)
    truth = make_bench(tmp_path, 3, duration_s=6.0, counts=(2, 1, 2), hidden=hidden)
    out = tmp_path / "out"
    assert main(["diagnose", str(tmp_path), "--results", str(out), "--quiet"]) == 0
    (one,) = result(out, "diagnosis")["accepted"]
    assert (one["effect"], one["confounded_with"]) == ("torsion_spring", ["platform_mass"]), one
    stiffness = one["parameters"][0]
    true = 0.02 / truth.platform_kg
    assert abs(stiffness["value"] - true) < 3.0 * stiffness["std"], (stiffness, true)


@pytest.mark.slow
def test_yaw_alone_says_what_it_would_not_show(tmp_path: Path) -> None:
    """The same clamp, seen by yaw alone: nothing is named, and the inertia is as unsure as that."""
    truth = make_bench(
        tmp_path, 3, 3, "chi", 6.0, (2, 1, 2), Hidden(0.0, 1.0, 0.0, 0.0, hold_n_m=0.02)
    )
    out = tmp_path / "out"
    assert main(["diagnose", str(tmp_path), "--results", str(out), "--quiet"]) == 0
    told = result(out, "diagnosis")
    assert told["accepted"] == [], told["accepted"]
    rows = {row["effect"]: row for row in told["candidates"]}
    for name in ("torsion_spring", "attachment_offset", "cable_elasticity"):
        assert rows[name]["verdict"] == "not_identifiable", rows[name]
    assert any("cannot tell whether these are there" in note for note in told["notes"])
    body = {row["name"]: row for row in told["objects_after"][1]["parameters"]}["Izz_kg_m2"]
    assert abs(body["value"] - truth.load_izz) < 3.0 * body["std"], body


@pytest.mark.slow
@pytest.mark.parametrize("seen", ["poses", "plane"])
@pytest.mark.parametrize(
    "hidden",
    [
        Hidden(0.0, 1.0, 0.0, 0.0, yields_n_m=2000.0),
        Hidden(0.0, 1.0, 0.0, 0.0, yields_n_m=500.0, yielding=1),
    ],
    ids=["all hooks", "one hook"],
)
def test_hooks_that_yield_sideways_are_never_wrong_and_sure(
    tmp_path: Path, seen: str, hidden: Hidden
) -> None:
    """Wires seem longer by tension over stiffness, without sagging: 2 mm, 8 mm of one of them.

    Nothing is named that is not there, and what Izz and the centre of mass may be off by is
    claimed: com_x was 3.9 deviations off.
    """
    truth = make_bench(tmp_path, 3, 3, seen, 6.0, (2, 1, 2), hidden)
    out = tmp_path / "out"
    assert main(["diagnose", str(tmp_path), "--results", str(out), "--quiet"]) == 0
    told = result(out, "diagnosis")
    assert set(accepted(told)) <= {"yielding_clamp"}, told["accepted"]
    platform, load = (
        {row["name"]: row for row in one["parameters"]} for one in told["objects_after"]
    )
    izz, own = platform["Izz_P_kg_m2"], load["Izz_kg_m2"]
    assert abs(izz["value"] - truth.platform_izz_p) < 3.0 * izz["std"], izz
    assert abs(own["value"] - truth.load_izz) < 3.0 * own["std"], own
    centre = platform["com_x_m"]
    assert abs(centre["value"] - PLATFORM_COM_M[0]) < 3.0 * centre["std"], centre


@pytest.mark.slow
@pytest.mark.parametrize("wires", [2, 3])
@pytest.mark.parametrize("seen", ["chi", "plane"])
def test_clean_benches_without_poses_raise_no_alarm(tmp_path: Path, seen: str, wires: int) -> None:
    """Yaw alone, and yaw with x and y: nothing found, nothing unexplained, Izz as claimed."""
    truth = make_bench(tmp_path, 3, wires, seen, 6.0, (2, 1, 2), CLEAN)
    out = tmp_path / "out"
    assert main(["diagnose", str(tmp_path), "--results", str(out), "--quiet"]) == 0
    told = result(out, "diagnosis")
    assert told["accepted"] == [], told["accepted"]
    assert not told["unexplained"]["present"], told["unexplained"]
    for one, true in zip(
        told["objects_after"], (truth.platform_izz_p, truth.load_izz), strict=True
    ):
        rows = {row["name"]: row for row in one["parameters"]}
        izz = rows["Izz_P_kg_m2" if one["name"] == "platform" else "Izz_kg_m2"]
        assert abs(izz["value"] - true) < 3.0 * izz["std"], izz


@pytest.mark.slow
@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_wires_in_each_others_place_seen_by_angles_alone(
    tmp_path: Path, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """The first wire is 30 mm long, the second is told to be: phi and theta show it."""
    make_bench(tmp_path, 3, 3, "angles", 6.0, (2, 1, 2), Hidden(0.03, 1.0, 0.0, 0.0))
    path = tmp_path / "session.toml"
    stated = path.read_text(encoding="utf-8")
    path.write_text(stated.replace("[1.2, 1.2, 1.2]", "[1.2, 1.23, 1.2]"), encoding="utf-8")
    assert main([command, str(tmp_path)]) == 1
    said = capsys.readouterr().err
    assert "run tare-01: cable_lengths_m: the lengths of cables 1 and 2, up to 30 mm" in said
    path.write_text(stated.replace("[1.2, 1.2, 1.2]", "[1.23, 1.2, 1.2]"), encoding="utf-8")
    assert main([command, str(tmp_path)]) == 0
