"""Damaged files of every kind through their readers, many of them.

    python -m tests.freeswing.hostile.campaign                  # 10,000 files
    python -m tests.freeswing.hostile.campaign 500 video mesh   # 500 of the kinds with these words

Each file is read or refused with a sentence; exit status 1 names whatever else came out. One
process a kind, so that one that dies or hangs is told from the others.
"""

from __future__ import annotations

import multiprocessing
import os
import random
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from freeswing.cdpr.files.problems import DataError, InputError
from tests.freeswing.hostile.hostile_files import vandalised
from tests.freeswing.hostile.more_files import more_cases
from tests.freeswing.hostile.text_files import Case, text_cases

LONGEST_S = 60  # for one file of some kilobytes; they take milliseconds, on a busy machine more
MOST_BYTES = 2**30
# A process of COLMAP for each, a page with all its figures for each.
SLOW_KINDS = ("colmap cameras.bin", "colmap images.bin", "result")
SHARE_OF_SLOW = 0.2


@dataclass(frozen=True)
class Told:
    """What became of a kind's damaged files.

    Attributes:
        read: how many were read all the same.
        refused: how many ended in a sentence.
        wrong: what the others ended in, and how often.
        slowest_s: of all.
        peak_bytes: most memory that the process had.
    """

    read: int
    refused: int
    wrong: dict[str, int]
    slowest_s: float
    peak_bytes: int


class HangError(Exception):
    """A file that took too long."""


def _hangs(*_: object) -> None:
    raise HangError


def one_kind(case: Case, count: int, seed: int, pipe: Any) -> None:
    """Reads so many damaged files of a kind, in a process of its own."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # what codecs print
    signal.signal(signal.SIGALRM, _hangs)
    chance, wrong = random.Random(seed), Counter[str]()
    read, refused, slowest = 0, 0, 0.0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "files"
        for k in range(count + 1):
            path = case.laid(folder, vandalised(case.data, chance) if k else case.data)
            begun = time.perf_counter()
            signal.alarm(LONGEST_S)
            try:
                case.read(path)
                read += 1
            except (InputError, DataError) as error:
                refused += 1
                if not k:
                    wrong[f"the whole file: {error}"] += 1
                if not 10 < len(str(error)) < 20_000:
                    wrong[f"{len(str(error))} letters: {str(error)[:80]}"] += 1
            except BaseException as error:  # noqa: BLE001
                frames = traceback.extract_tb(error.__traceback__)[-3:]
                where = " < ".join(f"{Path(f.filename).name}:{f.lineno}" for f in reversed(frames))
                wrong[f"{type(error).__name__}: {str(error)[:100]} ({where})"] += 1
            finally:
                signal.alarm(0)
            slowest = max(slowest, time.perf_counter() - begun)
    peak = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    pipe.send(Told(read, refused, dict(wrong), slowest, peak))


def campaign(cases: dict[str, Case], count: int, seed: int) -> dict[str, Told]:
    """So many damaged files over all kinds."""
    weights = {name: SHARE_OF_SLOW if name.startswith(SLOW_KINDS) else 1.0 for name in cases}
    told = {}
    fork = multiprocessing.get_context("fork")
    for k, (name, case) in enumerate(cases.items()):
        many = max(1, round(count * weights[name] / sum(weights.values())))
        mine, its = fork.Pipe(duplex=False)
        process = fork.Process(target=one_kind, args=(case, many, seed + k, its))
        process.start()
        its.close()
        try:
            hung = not mine.poll(LONGEST_S * 30)
            told[name] = mine.recv() if not hung else Told(0, 0, {"hung": 1}, LONGEST_S * 30, 0)
        except EOFError:
            process.join()
            told[name] = Told(0, 0, {f"died with {process.exitcode}": 1}, 0.0, 0)
        process.kill()
        process.join()
        one = told[name]
        print(  # noqa: T201
            f"{name:22} {one.read:4} read {one.refused:4} refused "
            f"{sum(one.wrong.values()):3} wrong {one.slowest_s:6.2f} s "
            f"{one.peak_bytes / 2**20:5.0f} MiB",
            *one.wrong.items(),
            sep="\n    ",
            flush=True,
        )
    return told


def main() -> int:
    words = sys.argv[1:]
    count = int(words.pop(0)) if words and words[0].isdecimal() else 10_000
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cases = {**text_cases(folder), **more_cases(folder)}
        chosen = {k: c for k, c in cases.items() if not words or any(w in k for w in words)}
        told = campaign(chosen, count, 22)
    wrong = sum(sum(one.wrong.values()) for one in told.values())
    peak = max(one.peak_bytes for one in told.values())
    number = sum(one.read + one.refused for one in told.values()) + wrong
    slowest = max(one.slowest_s for one in told.values())
    print(  # noqa: T201
        f"{number} files of {len(told)} kinds: {wrong} wrong, slowest {slowest:.2f} s, "
        f"most memory {peak / 2**20:.0f} MiB"
    )
    return 1 if wrong or peak > MOST_BYTES else 0


if __name__ == "__main__":
    sys.exit(main())
