"""`freeswing track` killed without warning and started again: the same bytes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.vision.loops import small_cameras, write_looped_session

FRAMES = 450  # two pieces a camera


@pytest.fixture(scope="module")
def session(tmp_path_factory) -> Path:
    return write_looped_session(tmp_path_factory.mktemp("killed"), small_cameras(2), FRAMES)


def command(session: Path, results: Path, workers: int) -> list[str]:
    return [
        sys.executable, "-m", "freeswing", "track", str(session), "--results", str(results),
        "--workers", str(workers), "--quiet",
    ]  # fmt: skip


def pieces(results: Path) -> list[Path]:
    return sorted(results.rglob("*.npz"))


def killed_after_a_piece(session: Path, results: Path, workers: int) -> int:
    """Kills the command (its workers are left to find out) once a piece is there; how many are."""
    process = subprocess.Popen(command(session, results, workers))
    deadline = time.monotonic() + 120.0
    while not pieces(results) and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.002)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert process.returncode == -signal.SIGKILL, f"ended by itself: {process.returncode}"
    return len(pieces(results))


@pytest.fixture(scope="module")
def whole(session, tmp_path_factory) -> Path:
    results = tmp_path_factory.mktemp("whole")
    subprocess.run(command(session, results, 1), check=True)
    return results


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_kill_9_in_the_middle_leaves_the_same_result(session, whole, tmp_path, workers) -> None:
    done = killed_after_a_piece(session, tmp_path, workers)
    assert 1 <= done < 4, f"{done} of 4 pieces were there when it was killed"
    assert not (tmp_path / "tracking.json").exists(), "killed too late"
    before = {path: path.stat().st_mtime_ns for path in pieces(tmp_path)[:1]}
    subprocess.run(command(session, tmp_path, workers), check=True)
    for path, written in before.items():
        assert path.stat().st_mtime_ns == written, f"{path.name} was made again"
    for name in ("tracking.json", "tracks/long.csv"):
        assert (tmp_path / name).read_bytes() == (whole / name).read_bytes(), f"{name} differs"
