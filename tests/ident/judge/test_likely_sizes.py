"""How large errors of several causes are: made-up numbers of which the sizes are known."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.ident.judge.likely_sizes import likely_sizes

ALONE = {"one": np.arange(36)}


@pytest.mark.parametrize(("size", "colour"), [(0.0, 1.0), (0.0, 8.0), (1.0, 1.0), (30.0, 8.0)])
def test_the_size_of_errors_is_found(size, colour):
    """Within what 36 numbers tell; none where there are none, whatever colour residuals have."""
    generator = np.random.default_rng(3)
    answers = np.geomspace(300.0, 1e-3, 36)
    for _ in range(20):
        seen = np.sqrt(colour) * generator.standard_normal(36)
        seen += size * answers * generator.standard_normal(36)
        found = likely_sizes(np.diag(answers), seen, ALONE, colour).sizes.get("one", 0.0)
        assert 0.5 * size <= found <= 2.0 * size, (found, size)


@pytest.mark.parametrize(("times", "sure"), [(3.60, False), (3.66, True)])
def test_chance_makes_errors_likelier_in_one_session_of_a_thousand(times, sure):
    """One number of many stands out; the rest settles the noise."""
    answers = np.zeros((401, 1))
    answers[0] = 1.0
    seen = np.append(times, np.ones(400))
    assert ("one" in likely_sizes(answers, seen, {"one": np.arange(1)}, 1.0).sizes) == sure


@pytest.mark.parametrize(("times", "sure"), [(4.17, False), (4.25, True)])
def test_ten_causes_are_asked_as_often_as_one(times, sure):
    answers = np.vstack([np.eye(10), np.zeros((400, 10))])
    seen = np.concatenate([[times], np.zeros(9), np.ones(400)])
    causes = {str(k): np.array([k]) for k in range(10)}
    assert bool(likely_sizes(answers, seen, causes, 1.0).sizes) == sure


@pytest.mark.parametrize("seed", range(10))
def test_what_is_there_is_asked_for_and_nothing_else(seed):
    """A tilt and a drag among six causes that answer alike in part."""
    generator = np.random.default_rng(seed)
    answers = generator.standard_normal((60, 12)) @ (np.eye(12) + 0.5)
    causes = {str(k): np.arange(2 * k, 2 * k + 2) for k in range(6)}
    true = np.zeros(12)
    true[2:4], true[8:10] = 30.0 * np.array([1.0, -1.0]), [-9.0, 15.0]
    seen = answers @ true + generator.standard_normal(60)
    found = likely_sizes(answers, seen, causes, 1.0)
    assert set(found.sizes) == {"1", "4"}
    assert 15.0 < found.sizes["1"] < 60.0
    assert 6.0 < found.sizes["4"] < 24.0
    assert found.rest == pytest.approx(1.0, abs=0.6)


def test_what_none_follows_is_left():
    generator = np.random.default_rng(4)
    answers = np.vstack([generator.standard_normal((60, 4)), np.zeros((0, 4))])
    seen = np.sqrt(6.0) * generator.standard_normal(60)
    found = likely_sizes(answers, seen, {"one": np.arange(4)}, 6.0)
    assert not found.sizes
    assert found.rest > 4.0


@pytest.mark.parametrize(("most", "size"), [(3.0, 3.0), (40.0, 10.0)])
def test_a_size_that_something_else_tells_is_at_most_that(most: float, size: float) -> None:
    answers = 100.0 * np.eye(60)[:, :40]
    seen = np.append(1000.0 * np.ones(40), np.ones(20))
    found = likely_sizes(answers, seen, {"one": np.arange(40)}, 2.0, {"one": most})
    assert found.sizes["one"] == pytest.approx(size, rel=0.05)
