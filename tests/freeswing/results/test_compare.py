"""Results side by side, through the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from freeswing.cdpr.files.documents import write_json
from freeswing.main import main
from freeswing.results.common import Parameter
from freeswing.results.comparison import NOTABLE_Z, Side, compare


def left(folder: Path, com_x_m: float, std: float = 1e-5) -> str:
    rows = [{"name": "com_x_m", "value": com_x_m, "std": std}]
    estimates = {"ml_full": {"parameters": rows}, "fidim_free": {"parameters": rows}}
    document = {"format": "freeswing-identification/1", "estimates": estimates}
    write_json(folder / "results" / "identification.json", document)
    return str(folder)


def side(name: str, value: float, std: float | None) -> Side:
    return Side(name=name, parameters=(Parameter(name="com_x_m", value=value, std=std),))


@pytest.mark.parametrize(("shift", "word"), [(-0.01, "agree"), (0.01, "differ")])
def test_the_limit_from_both_sides(shift: float, word: str) -> None:
    spread = 5.0  # of 3 and 4
    found = compare([side("a", 0.0, 3.0), side("b", (NOTABLE_Z + shift) * spread, 4.0)])
    assert found.rows[0].z == (pytest.approx(NOTABLE_Z + shift),)
    assert word in found.verdicts[0], found.verdicts


def test_without_deviations_nothing_is_said_of_agreement() -> None:
    assert (
        "nothing to compare by" in compare([side("a", 0.0, None), side("b", 1.0, None)]).verdicts[0]
    )


def test_sessions_are_compared(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before, after = left(tmp_path / "a", 0.002), left(tmp_path / "b", 0.003)
    assert main(["compare", before, f"{after}:fidim_free"]) == 0
    told = capsys.readouterr().out
    assert "differ beyond 3 standard deviations in com_x_m" in told, told
    assert "70.7" in told, told
    assert main(["compare", before, after, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["format"] == "freeswing-comparison/1"
    assert document["rows"][0]["values"] == [0.002, 0.003]


@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_one_picture_shows_all(tmp_path: Path, suffix: str) -> None:
    sides = [left(tmp_path / name, value) for name, value in (("a", 0.002), ("b", 0.003))]
    picture = tmp_path / f"both.{suffix}"
    assert main(["compare", *sides, "--picture", str(picture), "--quiet"]) == 0
    assert picture.stat().st_size > 3000, picture.stat().st_size
    assert main(["compare", *sides, "--picture", str(tmp_path / "both.doc")]) == 2


def test_the_picture_names_sides_and_what_differs(tmp_path: Path) -> None:
    sides = [left(tmp_path / name, value) for name, value in (("a", 0.002), ("b", 0.003))]
    picture = tmp_path / "both.svg"
    assert main(["compare", *sides, "--picture", str(picture), "--quiet"]) == 0
    text = picture.read_text(encoding="utf-8")
    assert "com x (mm)" in text
    assert "z = 70.7" in text
    assert f"{sides[1]} (ml_full)" in text


@pytest.mark.parametrize(
    "table",
    [
        {"parameters": {"com_x_m": 0.0021, "Ixx_m2": 0.05}},
        {"com_m": [0.0021, 0.0, 0.2], "specific_inertia_m2": [0.05, 0.07, 0.04, 0, 0, 0]},
    ],
    ids=["of the demonstration", "of a sample"],
)
def test_a_truth_is_a_side_without_deviations(
    table: dict, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = left(tmp_path / "a", 0.002)
    write_json(tmp_path / "truth.json", table)
    assert main(["compare", found, str(tmp_path / "truth.json"), "--json"]) == 0
    row = json.loads(capsys.readouterr().out)["rows"][0]
    assert row["values"] == [0.002, 0.0021]
    assert row["stds"] == [1e-5, None]
    assert row["z"] == [pytest.approx(10.0)]


def test_what_cannot_be_compared_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = left(tmp_path / "a", 0.002)
    assert main(["compare", before]) == 2
    assert main(["compare", before, str(tmp_path / "b")]) == 2
    assert main(["compare", before, f"{before}:ml_free"]) == 2
    told = capsys.readouterr().err
    assert "at least two" in told
    assert "run freeswing identify first" in told
    assert "it holds ml_full, fidim_free" in told
