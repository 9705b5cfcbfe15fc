"""The budget of the full tier: what is spent is spent, and what was not run is said."""

from __future__ import annotations

import subprocess
import sys
import time

import pytest

from tests import budget
from tests.places import ROOT

TESTS = """
import pytest
@pytest.mark.parametrize("k", range(4))
def test_it(k):
    assert k != 1
"""


def run(tmp_path, *words):
    """Four made tests, the second of which fails, each process in one temporary folder."""
    (tmp_path / "test_made.py").write_text(TESTS, encoding="utf-8")
    fixed = ("-m", "pytest", "-q", "-p", "tests.budget", "-p", "no:cacheprovider")
    where = ("-c", "/dev/null", "--rootdir", str(tmp_path), str(tmp_path))
    return subprocess.run(
        [sys.executable, *fixed, *words, *where],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


def test_without_a_budget_all_are_run_and_a_failure_is_a_failure(tmp_path) -> None:
    done = run(tmp_path)
    assert done.returncode == 1, done.stdout
    assert "1 failed, 3 passed" in done.stdout, done.stdout
    assert "left no time for: 0" in done.stdout, done.stdout


@pytest.mark.slow
def test_processes_side_by_side_share_the_budget_and_say_what_they_left(tmp_path) -> None:
    pytest.importorskip("xdist", reason="pytest-xdist is not installed")
    done = run(tmp_path, "--minutes", "0", "-n", "2")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "left no time for: 4" in done.stdout, done.stdout + done.stderr
    assert "test_it[3]" in done.stdout, done.stdout


def test_no_test_starts_once_the_budget_is_spent(monkeypatch, request) -> None:
    monkeypatch.setenv(budget.UNTIL, repr(time.time() + 60.0))
    budget.pytest_runtest_setup(request.node)
    monkeypatch.setenv(budget.UNTIL, repr(time.time() - 1.0))
    with pytest.raises(pytest.skip.Exception, match="the budget of time was spent"):
        budget.pytest_runtest_setup(request.node)


def test_whole_sessions_come_first_and_long_files_next() -> None:
    named = [f"{path}::test" for path in budget.FIRST]
    assert sorted([*named[::-1], "tests/other.py::test"], key=budget.rank)[: len(named)] == named


def test_what_is_to_come_first_is_there() -> None:
    missing = [path for path in budget.FIRST if not (ROOT / path).is_file()]
    assert missing == []
