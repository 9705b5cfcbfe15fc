"""A killed process leaves no worker behind."""

import os
import signal
import subprocess
import sys
import time

WITH_A_WORKER = """
import os, time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from freeswing.cdpr.system.lifeline import tie_to
pool = ProcessPoolExecutor(1, get_context("fork"), initializer=tie_to, initargs=(os.getpid(),))
print(pool.submit(os.getpid).result(), flush=True)
time.sleep(60)
"""


def is_alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    state = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True)
    return state.stdout.strip()[:1] not in ("", "Z")


def test_a_killed_process_leaves_no_worker():
    command = [sys.executable, "-c", WITH_A_WORKER]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as started:
        worker = int(started.stdout.readline())
        assert is_alive(worker)
        started.send_signal(signal.SIGKILL)
        started.wait()
    until = time.monotonic() + 20.0
    while is_alive(worker) and time.monotonic() < until:
        time.sleep(0.1)
    assert not is_alive(worker)
