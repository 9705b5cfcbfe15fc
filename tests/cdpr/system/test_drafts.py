"""Drafts become their file whole; what a killed writer left goes, what is being written stays."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from freeswing.cdpr.files.documents import replace_file
from freeswing.cdpr.system.confine import results_folder
from freeswing.cdpr.system.drafts import clear_leftovers, draft_of, is_draft

HALF_WAY = """
import sys, time
from pathlib import Path
from freeswing.cdpr.system.drafts import draft_of
with draft_of(Path(sys.argv[1])) as file:
    file.write(b"half")
    file.flush()
    print("half", flush=True)
    time.sleep(600)
"""


@pytest.fixture
def leftover(tmp_path: Path) -> Path:
    """A draft whose writer was killed."""
    with subprocess.Popen(
        [sys.executable, "-c", HALF_WAY, str(tmp_path / "deep" / "a.bin")], stdout=subprocess.PIPE
    ) as writer:
        assert writer.stdout is not None
        assert writer.stdout.readline() == b"half\n"
        writer.send_signal(signal.SIGKILL)
    (found,) = (tmp_path / "deep").iterdir()
    assert is_draft(found.name)
    assert found.read_bytes() == b"half"
    return found


def test_the_next_writer_clears_the_folder(leftover: Path) -> None:
    replace_file(leftover.with_name("b.bin"), b"whole")
    assert [path.name for path in leftover.parent.iterdir()] == ["b.bin"]


def test_the_next_command_clears_its_results(leftover: Path) -> None:
    results_folder(leftover.parents[1], leftover.parents[1])
    assert list(leftover.parent.iterdir()) == []


def test_what_another_process_writes_stays(tmp_path: Path) -> None:
    with draft_of(tmp_path / "a.bin") as file:
        file.write(b"one")
        clear_leftovers(tmp_path)
        results_folder(tmp_path, tmp_path)
        replace_file(tmp_path / "b.bin", b"two")
        assert len(list(tmp_path.iterdir())) == 2
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {
        "a.bin": b"one",
        "b.bin": b"two",
    }


def test_a_draft_taken_for_a_leftover_is_begun_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between its creation and its lock another process may clear it away."""
    import fcntl

    lock, taken = fcntl.flock, []

    def late(file: object, how: int) -> None:
        if not taken:
            taken.append(next(tmp_path.iterdir()))
            taken[0].unlink()
        lock(file, how)

    monkeypatch.setattr(fcntl, "flock", late)
    replace_file(tmp_path / "a.bin", b"whole")
    assert len(taken) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["a.bin"]


def test_a_failure_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(TypeError):
        replace_file(tmp_path / "a.bin", iter([b"half", "a mistake"]))  # pyright: ignore[reportArgumentType]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["a.part", ".a.part", ".0123456789abcdef.partial", ".git"])
def test_other_files_are_nobodys_drafts(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"mine")
    os.utime(tmp_path / name, (0, 0))
    replace_file(tmp_path / "b.bin", b"whole")
    results_folder(tmp_path, tmp_path)
    assert (tmp_path / name).read_bytes() == b"mine"
