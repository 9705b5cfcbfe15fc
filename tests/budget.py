"""A budget of time for the full tier: the most telling tests first, none started once it is spent.

Then the longest files: a file is run by one process, and one that began last would leave the other
core idle to its end.

    python -m pytest -p tests.budget --minutes 40 -m slow -n 2 --dist loadfile

What was not started is skipped by name and counted in the last lines. Without --minutes there is
no end: that is the whole tier.
"""

from __future__ import annotations

import os
import time

import pytest

UNTIL = "FREESWING_TESTS_UNTIL"
NOT_STARTED = "not started: the budget of time was spent"

# Whole sessions before parts of them, real recordings before made ones, the fast before the slow.
TELLING = (
    "tests/samples/test_filmed.py",
    "tests/samples/test_samples.py",
    "tests/freeswing/test_demo.py",
    "tests/ident/test_bologna.py",
    "tests/calib/rig/test_real_cameras.py",
    "tests/vision/test_identified.py",
    "tests/ident/likelihood/test_monte_carlo.py",
    "tests/freeswing/test_installed.py",
    "tests/ident/fidim/test_payload_mass.py",
    "tests/ident/test_identify.py",
)

# Processor seconds of their slow tests; all others take less than 55.
LONG = (
    "tests/ident/drive/test_drive_diagnosis.py",  # 160
    "tests/ident/bench/test_bench_diagnosis.py",  # 135
    "tests/vision/untagged/test_untagged_identified.py",  # 115
    "tests/samples/test_driven.py",  # 70
    "tests/vision/footage/test_phones.py",  # 60
    "tests/freeswing/starter/test_two_cameras.py",  # 58
)
FIRST = (*TELLING, *LONG)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--minutes", type=float, help="start no test after so many minutes")


def pytest_configure(config: pytest.Config) -> None:
    """The first process says until when; those that xdist starts hear it from the environment."""
    minutes = config.getoption("minutes")
    if minutes is not None and not hasattr(config, "workerinput"):
        os.environ[UNTIL] = repr(time.time() + 60.0 * minutes)
    if hasattr(config.option, "loadscopereorder"):
        config.option.loadscopereorder = False


def rank(nodeid: str) -> int:
    """Where a test's file stands; those that are not named come last, in their own order."""
    path = nodeid.partition("::")[0]
    return FIRST.index(path) if path in FIRST else len(FIRST)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: rank(item.nodeid))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    until = os.environ.get(UNTIL)
    if until is not None and time.time() > float(until):
        pytest.skip(NOT_STARTED)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    skipped = terminalreporter.stats.get("skipped", [])
    late = [report.nodeid for report in skipped if NOT_STARTED in str(report.longrepr)]
    terminalreporter.write_line(f"tests that the budget left no time for: {len(late)}")
    for name in late:
        terminalreporter.write_line(f"  {name}")
