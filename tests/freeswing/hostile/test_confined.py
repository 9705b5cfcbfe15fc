"""Links never lead a command out of its folder, neither to read nor to write."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from freeswing.main import main
from tests.places import SAMPLES

PLACES = (
    "results",
    "results/tracks",
    "results/print",
    "results/overlay",
    "results/tracks/.sightings/swing-01",
    "results/identification.json",
    "results/a/folder/that/nobody/needs",
)


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    folder = tmp_path / "outside"
    folder.mkdir()
    (folder / "kept.txt").write_text("mine", encoding="utf-8")
    return folder


def refused(capsys: pytest.CaptureFixture[str], *words: str | Path) -> str:
    assert main([*map(str, words), "--quiet"]) == 2, words
    said = capsys.readouterr().err
    assert "Traceback" not in said
    return said


def only_what_was_there(outside: Path) -> None:
    assert [path.name for path in outside.iterdir()] == ["kept.txt"]
    assert (outside / "kept.txt").read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize("place", PLACES)
def test_nothing_is_written_through_links(
    session: Path, place: str, outside: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (session / place).parent.mkdir(exist_ok=True, parents=True)
    (session / place).symlink_to(outside)
    for command in ("check", "report", "identify", "track", "run", "board"):
        assert "a link that leads out of" in refused(capsys, command, session)
    only_what_was_there(outside)


def test_a_link_is_followed_through_links(
    session: Path, outside: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """results/tracks leads to a folder of the session, and that out of it."""
    (session / "kept").mkdir()
    (session / "kept" / "deeper").symlink_to(outside)
    (session / "results").mkdir()
    (session / "results" / "tracks").symlink_to(session / "kept")
    assert "deeper: a link that leads out of" in refused(capsys, "identify", session)


def test_links_that_stay_inside_serve(session: Path) -> None:
    (session / "elsewhere").mkdir()
    (session / "results").symlink_to(session / "elsewhere")
    (session / "elsewhere" / "again").symlink_to(session / "elsewhere")  # round and round
    assert main(["check", str(session), "--quiet"]) == 0
    assert (session / "elsewhere" / "check.json").is_file()


def test_a_named_results_folder_binds_what_is_in_it(
    session: Path, outside: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    named = tmp_path / "named"
    named.mkdir()
    (named / "tracks").symlink_to(outside)
    assert "leads out of" in refused(capsys, "check", session, "--results", named)
    only_what_was_there(outside)


@pytest.mark.parametrize(
    "words", [("home",), ("excite",), ("linearise",), ("home", "--advise")], ids=" ".join
)
def test_commands_of_one_robot_stay_beside_it(
    words: tuple[str, ...], outside: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sample = "inca-6d" if "linearise" in words else "homing"
    folder = tmp_path / sample
    shutil.copytree(SAMPLES / sample, folder, ignore=shutil.ignore_patterns("results"))
    (folder / "results").symlink_to(outside)
    file = folder if words == ("home",) else folder / "robot.toml"
    command, *flags = words
    assert "results: a link that leads out of" in refused(capsys, command, file, *flags)
    only_what_was_there(outside)


@pytest.mark.parametrize("name", ["cam0.mkv", "cam0.csv", "cam0"])
def test_recordings_are_not_read_through_links(
    session: Path, name: str, outside: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (session / "session.toml").read_text(encoding="utf-8")
    text = text.replace('trajectory = "runs/swing-01.csv"', 'video = "runs/film"')
    (session / "session.toml").write_text(text, encoding="utf-8")
    (session / "runs" / "film").mkdir()
    (session / "runs" / "film" / name).symlink_to(outside / "kept.txt")
    said = refused(capsys, "track", session)
    assert f"{name}: a link that leads out of" in said, said
    assert "mine" not in said


def test_cameras_are_not_read_through_a_link(
    session: Path, outside: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (session / "cameras.toml").symlink_to(outside / "kept.txt")
    assert "leads out of" in refused(capsys, "check", session)


@pytest.mark.parametrize("mesh", ["/etc", "../outside/kept.txt", "linked"])
def test_a_mesh_is_not_read_from_elsewhere(
    session: Path, mesh: str, outside: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (session / "linked").symlink_to(outside)
    robot = session / "robot.toml"
    text = robot.read_text(encoding="utf-8")
    robot.write_text(text.replace("[platform]", f'[platform]\nmesh = "{mesh}"'), encoding="utf-8")
    said = refused(capsys, "identify", session)
    assert "must be relative to" in said or "leads out of" in said, said
    assert not (session / "results" / "identification.json").exists()
