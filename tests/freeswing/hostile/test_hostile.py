"""Broken and hostile files through the command line: a plain sentence, never a traceback."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.cameras_file import write_cameras
from freeswing.cdpr.measured.target import Tag, Target, write_target
from freeswing.main import main
from freeswing.vision.look.video import write_video

ONE_FOLDER = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]


def png(width: int, height: int) -> bytes:
    """A grey PNG that says it is this large and holds next to nothing."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    body = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(bytes(1000))) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + body


@pytest.fixture
def filmed(session: Path) -> Path:
    """The small session with its first run filmed; the recordings are up to the test."""
    text = (session / "session.toml").read_text(encoding="utf-8")
    text = text.replace('trajectory = "runs/swing-01.csv"', 'video = "runs/swing-01"')
    text = text.replace('robot = "robot.toml"', 'robot = "robot.toml"\ntarget = "target.toml"')
    (session / "session.toml").write_text(text, encoding="utf-8")
    write_target(session / "target.toml", Target((Tag("tag36h11", 0, 0.1, np.eye(4)),)))
    lens = np.array([300.0, 300.0, 159.5, 119.5])
    write_cameras(
        session / "cameras.toml", (Camera("cam0", (320, 240), "PINHOLE", lens, np.eye(4)),)
    )
    (session / "runs" / "swing-01").mkdir()
    return session


def said_plainly(capsys: pytest.CaptureFixture[str], session: Path, command: str) -> str:
    more = ["--workers", "1"] if command == "track" else []
    status = main([command, str(session), *more])
    said = capsys.readouterr().err
    assert status in (1, 2), f"status {status}: {said}"
    assert "Traceback" not in said
    assert "not foreseen" not in said
    return said


def recording(session: Path) -> Path:
    return session / "runs" / "swing-01" / "cam0.mkv"


@pytest.mark.parametrize("data", [b"", b"\x1a\x45\xdf\xa3", bytes(range(256)) * 40])
def test_what_is_no_video(filmed: Path, capsys: pytest.CaptureFixture[str], data: bytes) -> None:
    recording(filmed).write_bytes(data)
    assert "cam0" in said_plainly(capsys, filmed, "track")


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_truncated_video(filmed: Path, capsys: pytest.CaptureFixture[str], share: float) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (12, 240, 320), dtype=np.uint8)
    write_video(recording(filmed), iter(noise), np.arange(12) / 40.0)
    whole = recording(filmed).read_bytes()
    recording(filmed).write_bytes(whole[: int(share * len(whole))])
    said_plainly(capsys, filmed, "track")


def test_an_image_is_refused_by_its_size(filmed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """13,000 x 13,000 pixels could be decoded, and would take 169 MB from a file of 1 kB."""
    folder = filmed / "runs" / "swing-01" / "cam0"
    folder.mkdir()
    (folder / "000000.png").write_bytes(png(13_000, 13_000))
    said = said_plainly(capsys, filmed, "track")
    assert "13000 x 13000 pixels, more than" in said


@pytest.mark.parametrize("command", ["check", "identify", "diagnose", "report", "run", "export"])
def test_only_the_session_is_written_to(
    session: Path, command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    more = ["--urdf"] if command == "export" else []
    assert main([command, str(session), "--quiet", *more]) in (0, 1)
    assert list(elsewhere.iterdir()) == []
    assert sorted(path.name for path in tmp_path.iterdir()) == ["elsewhere", "session"]


def test_a_camera_cannot_name_a_file_elsewhere(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lens = np.array([300.0, 300.0, 159.5, 119.5])
    names = ("../evil", "right")
    cameras = tuple(Camera(name, (320, 240), "PINHOLE", lens, np.eye(4)) for name in names)
    write_cameras(tmp_path / "cameras.toml", cameras)
    words = ["convert", str(tmp_path / "cameras.toml"), str(tmp_path / "infos"), "--to", "ros"]
    assert main(words) == 2
    assert "becomes a file name" in capsys.readouterr().err
    assert not (tmp_path / "evil.yaml").exists()


@pytest.mark.parametrize("size", [(60_000, 60_000), (320, 240), (2**31 - 1, 2**31 - 1)])
def test_images_that_explode_or_lie(
    filmed: Path, capsys: pytest.CaptureFixture[str], size: tuple[int, int]
) -> None:
    folder = filmed / "runs" / "swing-01" / "cam0"
    folder.mkdir()
    (folder / "000000.png").write_bytes(png(*size))
    said_plainly(capsys, filmed, "track")


def test_no_recording_at_all(filmed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "swing-01" in said_plainly(capsys, filmed, "track")


@settings(max_examples=40, deadline=None, suppress_health_check=ONE_FOLDER)
@given(place=st.integers(0, 4000), piece=st.binary(min_size=1, max_size=12))
def test_broken_trajectories(
    session: Path, capsys: pytest.CaptureFixture[str], place: int, piece: bytes
) -> None:
    path = session / "runs" / "swing-01.csv"
    data = path.read_bytes()
    try:
        path.write_bytes(data[:place] + piece + data[place + len(piece) :])
        status = main(["check", str(session), "--quiet"])
    finally:
        path.write_bytes(data)
    said = capsys.readouterr().err
    assert status in (0, 1), said
    assert "Traceback" not in said
    assert "not foreseen" not in said


@pytest.mark.parametrize("name", ["robot.toml", "session.toml", "target.toml", "cameras.toml"])
@pytest.mark.parametrize("data", [b"\xff\xfe\x00", b"a = " * 5, b'format = "freeswing-robot/9"\n'])
def test_broken_documents(
    filmed: Path, capsys: pytest.CaptureFixture[str], name: str, data: bytes
) -> None:
    (filmed / name).write_bytes(data)
    said = said_plainly(capsys, filmed, "track" if name != "robot.toml" else "identify")
    assert name in said
