"""Threads share independent work and change nothing of it."""

import threading
import time
from functools import cache

import casadi as ca
import numpy as np
import pytest

from freeswing.cdpr.compiled import interpreter as compiled
from freeswing.cdpr.model import batch
from freeswing.cdpr.model.batch import evaluate, tape_of, with_jacobian
from freeswing.cdpr.system.threads import side_by_side, threads

x = ca.SX.sym("x", 3)
SWING = ca.Function("swing", [x], [ca.sin(x) * ca.sumsqr(x)], ["x"], ["column"])


def one_point(place):
    return evaluate(SWING, place)[0]


def slopes(place):
    return evaluate(with_jacobian(SWING, (0,)), np.array([place, place + 1.0]))[1]


@pytest.mark.parametrize("call", [one_point, slopes])
def test_threads_give_what_a_loop_gives(call):
    places = np.random.default_rng(1).normal(size=(400, 3))
    expected = [call(place) for place in places]
    with threads(4):
        found = side_by_side(call, places)
    np.testing.assert_array_equal(found, expected)


def test_only_what_is_allowed_runs_at_once_and_no_thread_stays():
    def waits(_, barrier):
        barrier.wait(timeout=20.0)
        return threading.current_thread() is threading.main_thread()

    with threads(2):
        both = threading.Barrier(2)
        assert side_by_side(waits, (1, 2), (both, both)) == [False, False]
    alone = threading.Barrier(1)
    assert side_by_side(waits, (1, 2), (alone, alone)) == [True, True]
    assert not any("ThreadPool" in thread.name for thread in threading.enumerate())


def test_the_first_failure_in_order_is_raised():
    def fails(k):
        if k > 1:
            raise ValueError(f"run {k}")
        return k

    with threads(3), pytest.raises(ValueError, match="run 2"):
        side_by_side(fails, range(6))


def test_machine_code_is_made_by_one_thread_and_lives_as_long_as_it_runs(monkeypatch):
    made, made_here = [], compiled.interpreter.__wrapped__

    @cache
    def slowly(lanes):
        made.append(lanes)
        time.sleep(0.05)
        return made_here(lanes)

    monkeypatch.setattr(batch, "interpreter", slowly)
    tape, points = tape_of(SWING), np.ones((12, 3))
    assert tape is not None
    together = threading.Barrier(4)

    def run(_):
        together.wait(timeout=20.0)
        return tape.run(points)

    with threads(4):
        found = side_by_side(run, range(4))
    assert len(made) == 1, made
    results = np.empty((12, tape.outputs))
    bound = tape.bound(points, results)
    slowly.cache_clear()
    bound()
    np.testing.assert_array_equal(results, found[0])
