"""The processes that follow recordings end with the command, however that ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

WITH_TWO_WORKERS = """
import os, sys, time
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from tests.vision.test_workers import say_and_sleep
from freeswing.vision.jobs import Job, run_jobs
if __name__ == "__main__":
    run_jobs([Job(str(k), say_and_sleep, (sys.argv[1], k)) for k in range(2)], 2, None)
"""


def say_and_sleep(folder: str, job: int) -> None:
    (Path(folder) / str(job)).write_text(str(os.getpid()), encoding="utf-8")
    time.sleep(600.0)


def is_alive(pid: int) -> bool:
    state = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True)
    return state.stdout.strip()[:1] not in ("", "Z")


def test_a_killed_command_leaves_no_worker(tmp_path: Path) -> None:
    (tmp_path / "made").mkdir()
    script = tmp_path / "two.py"
    script.write_text(WITH_TWO_WORKERS, encoding="utf-8")
    root = str(Path(__file__).parents[2])
    command = [sys.executable, str(script), str(tmp_path / "made"), root]
    with subprocess.Popen(command) as started:
        until = time.monotonic() + 60.0
        while len(list((tmp_path / "made").iterdir())) < 2 and time.monotonic() < until:
            time.sleep(0.02)
        started.send_signal(signal.SIGKILL)
    pids = [int(path.read_text(encoding="utf-8") or 0) for path in (tmp_path / "made").iterdir()]
    assert len(pids) == 2
    until = time.monotonic() + 20.0
    while any(map(is_alive, pids)) and time.monotonic() < until:
        time.sleep(0.05)
    assert not any(map(is_alive, pids))
