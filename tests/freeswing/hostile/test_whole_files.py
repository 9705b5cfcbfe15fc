"""A write that is stopped half-way leaves the old result as it was."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from freeswing.cdpr.files.documents import InputError, write_json
from freeswing.main import main

WRITER = """
import sys
from pathlib import Path
from freeswing.cdpr.files.documents import replace_file
path = Path(sys.argv[1])
print("ready", flush=True)
while True:
    for letter in (b"a", b"b"):
        replace_file(path, letter * 4_000_000)
"""


@pytest.mark.parametrize("delay_s", [0.0, 0.011, 0.023, 0.041])
def test_kill_9_leaves_one_whole_file(tmp_path: Path, delay_s: float) -> None:
    path = tmp_path / "results" / "identification.json"
    path.parent.mkdir()
    path.write_bytes(b"a" * 4_000_000)
    writer = subprocess.Popen([sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE)
    assert writer.stdout is not None
    assert writer.stdout.readline() == b"ready\n"
    time.sleep(delay_s)
    writer.send_signal(signal.SIGKILL)
    writer.wait()
    writer.stdout.close()
    found = path.read_bytes()
    assert (len(found), len(set(found))) == (4_000_000, 1), (len(found), set(found))


def test_a_full_disk_leaves_the_old_result(
    session: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    result = session / "results" / "check.json"
    write_json(result, {"format": "freeswing-check/1", "findings": []})
    old = result.read_bytes()

    def full(_descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    assert main(["check", str(session)]) == 2
    assert "No space left on device" in capsys.readouterr().err
    assert result.read_bytes() == old
    assert sorted(path.name for path in result.parent.iterdir()) == ["check.json"]


def test_results_that_cannot_be_written_are_named(
    session: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (session / "results").write_text("a file in the way", encoding="utf-8")
    assert main(["report", str(session)]) == 2
    assert "Traceback" not in capsys.readouterr().err


def test_nan_never_reaches_a_result(tmp_path: Path) -> None:
    write_json(tmp_path / "a.json", {"value": float("nan")})
    assert "NaN" not in (tmp_path / "a.json").read_text(encoding="utf-8")
    with pytest.raises(InputError):
        write_json(tmp_path / "a.json" / "b.json", {})
