"""Tension distribution against a linear programme, an outside QP solver and each other."""

import daqp
import numpy as np
import pytest
from scipy.optimize import linprog

from freeswing.servo.tensions.loop_kernels import (
    BARYCENTRE,
    CLOSED_FORM,
    FEASIBLE,
    NEAREST,
    PAPER,
    SCALED,
    distribute,
)
from freeswing.servo.tensions.method_kernels import paper_point
from freeswing.servo.tensions.methods import METHODS, Demands, distribute_all
from freeswing.servo.tensions.polygon_kernels import basis_of, in_null_space, least_norm
from tests.servo.plants import cables, wrench_cases

CASES = wrench_cases(0, 250)


def largest_scale(A, b, offset, lower, upper):
    """By HiGHS; None where no scale will do."""
    n = len(lower)
    found = linprog(
        np.r_[np.zeros(n), -1.0],
        A_eq=np.column_stack([A, -b]),
        b_eq=-offset,
        bounds=[*zip(lower, upper, strict=True), (0.0, 1.0)],
    )
    return None if found.x is None else found.x[-1]


def by_daqp(A, b, offset, lower, upper, wish):
    n = len(wish)
    sense = np.r_[np.zeros(n), np.full(6, 5)].astype(np.int32)
    x, _, flag, _ = daqp.solve(
        np.eye(n), -wish, A.copy(), np.r_[upper, b - offset], np.r_[lower, b - offset], sense
    )
    return x if flag == 1 else None


SCALES = [largest_scale(*case[:5]) for case in CASES]


def test_the_cases_hold_feasible_and_infeasible_wrenches():
    feasible = sum(scale is not None and scale > 1 - 1e-9 for scale in SCALES)
    assert 60 < feasible < 200, feasible


@pytest.mark.parametrize("method", [NEAREST, BARYCENTRE, PAPER, CLOSED_FORM])
def test_what_is_called_feasible_is_and_gives_the_wrench(method):
    for case in CASES:
        A, b, offset, lower, upper, _ = case
        found = distribute(*case, method)
        if found.status in (FEASIBLE, SCALED):
            np.testing.assert_allclose(A @ found.x, found.scale * b - offset, atol=1e-9)
            assert (found.x > lower - 1e-9).all()
            assert (found.x < upper + 1e-9).all()


@pytest.mark.parametrize("method", [NEAREST, BARYCENTRE, PAPER])
def test_every_wrench_that_a_linear_programme_calls_feasible_is_solved(method):
    for case, scale in zip(CASES, SCALES, strict=True):
        found = distribute(*case, method)
        feasible = scale is not None and scale > 1 - 1e-9
        assert (found.status == FEASIBLE) == feasible, (scale, found)


def test_the_largest_scale_is_the_linear_programmes():
    for case, scale in zip(CASES, SCALES, strict=True):
        found = distribute(*case, NEAREST)
        if scale is None:
            assert np.isnan(found.scale)
        else:
            assert found.scale == pytest.approx(scale, abs=1e-9)


def test_the_cable_that_stops_a_scale_is_at_its_bound_and_gives_way():
    checked = 0
    for case in CASES:
        A, b, offset, lower, upper, wish = case
        found = distribute(*case, NEAREST)
        if found.status != SCALED:
            continue
        cable, high = divmod(found.stops, 2)
        bound = (upper if high else lower)[cable]
        assert found.x[cable] == pytest.approx(bound, abs=1e-8)
        wider = [lower.copy(), upper.copy()]
        wider[high][cable] += 0.05 if high else -0.05
        assert distribute(A, b, offset, *wider, wish, NEAREST).scale > found.scale
        checked += 1
    assert checked > 20


def test_the_nearest_point_is_daqps():
    worst = 0.0
    for case in CASES:
        found, outside = distribute(*case, NEAREST), by_daqp(*case)
        if found.status == FEASIBLE:
            worst = max(worst, np.abs(found.x - outside).max())
    assert worst < 1e-8, worst


def test_one_pass_of_the_papers_method_misses_feasible_wrenches():
    missed = total = 0
    for A, b, offset, lower, upper, wish in CASES:
        if distribute(A, b, offset, lower, upper, wish, NEAREST).status != FEASIBLE:
            continue
        basis = basis_of(A)
        x0 = least_norm(basis, b - offset) + in_null_space(basis.N, wish)
        total += 1
        missed += not paper_point(basis.N, lower - x0, upper - x0, 1e-11, False).found
        assert paper_point(basis.N, lower - x0, upper - x0, 1e-11, True).found
    assert 0.02 < missed / total < 0.25, (missed, total)


def test_a_barycentre_is_the_mean_of_the_polygon():
    A, b, offset, lower, upper, wish = next(
        case for case in CASES if distribute(*case, NEAREST).status == FEASIBLE
    )
    centre = distribute(A, b, offset, lower, upper, wish, BARYCENTRE).x
    N, x0 = basis_of(A).N, distribute(A, b, offset, lower, upper, wish, NEAREST).x
    rng = np.random.default_rng(0)
    points = rng.uniform(-3, 3, (400_000, 2))
    x = x0 + points @ N.T
    inside = ((x >= lower) & (x <= upper)).all(axis=1)
    assert inside.sum() > 500
    spread = points[inside].std(axis=0) / np.sqrt(inside.sum())
    gap = np.abs((centre - x0) @ N - points[inside].mean(axis=0))
    assert (gap < 5 * spread).all(), (gap, spread)


@pytest.mark.parametrize("method", [NEAREST, BARYCENTRE])
def test_tensions_are_continuous_along_a_path(method):
    def at(s):
        lengths, J = cables(np.array([0.2 * np.sin(s), 0.1 * np.cos(2 * s), 0.1, 0, 0, 0.05]))
        wrench = 0.8 * np.array([2.5 * np.sin(3 * s), 2.0 * np.cos(s), 2.8, 0, 0.1 * np.sin(s), 0])
        ends = np.full(8, 1.48), np.full(8, 18.5)
        return distribute(np.ascontiguousarray(-J.T), wrench, np.zeros(6), *ends, lengths, method)

    steps = []
    for count in (200, 400, 800):
        rows = [at(s) for s in np.linspace(0.0, 6.0, count)]
        assert all(row.status == FEASIBLE for row in rows)
        touched = any((row.x < 1.4801).any() for row in rows)
        assert touched or method == BARYCENTRE
        steps.append(np.abs(np.diff([row.x for row in rows], axis=0)).max())
    # Halving the step halves the largest jump: nothing jumps.
    assert steps[1] < 0.7 * steps[0]
    assert steps[2] < 0.7 * steps[1]


def rows_of(n: int, count: int = 40, seed: int = 1) -> Demands:
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((count, 6, n))
    middle = rng.uniform(3, 12, (count, n))
    b = np.einsum("kij,kj->ki", A, middle) * rng.uniform(0.5, 3.0, (count, 1))
    ends = np.full((count, n), 1.0), np.full((count, n), 15.0)
    return Demands(A, b, np.zeros((count, 6)), *ends, np.full((count, n), 8.0))


@pytest.mark.parametrize("n", [6, 7, 8, 9, 11])
def test_every_number_of_spare_cables(n):
    demands = rows_of(n)
    shares, checked = distribute_all(demands), distribute_all(demands, "qp")
    assert shares.status == checked.status
    assert len(set(shares.status)) > 1, shares.status
    np.testing.assert_allclose(shares.scale, checked.scale, atol=1e-8)
    same = np.array(shares.status) == "feasible"
    np.testing.assert_allclose(shares.x[same], checked.x[same], atol=1e-8)
    for k in np.flatnonzero(same):
        outside = by_daqp(*[getattr(demands, key)[k] for key in
                            ("A", "b", "offset", "lower", "upper", "wish")])  # fmt: skip
        np.testing.assert_allclose(shares.x[k], outside, atol=1e-7)


def test_fewer_than_six_cables_are_refused():
    with pytest.raises(ValueError, match=r"r = -1 < 0"):
        rows_of(5)


def test_methods_say_what_they_take():
    with pytest.raises(ValueError, match="one of nearest"):
        distribute_all(rows_of(8), "best")
    for method in METHODS:
        if method not in ("nearest", "qp"):
            with pytest.raises(ValueError, match="6 to 8 cables"):
                distribute_all(rows_of(9), method)


def test_cables_that_lose_a_direction_are_singular():
    demands = rows_of(8, 3)
    A = demands.A.copy()
    A[1, 5] = A[1, 4]
    rest = [getattr(demands, key) for key in ("b", "offset", "lower", "upper", "wish")]
    for method in ("nearest", "qp"):
        assert distribute_all(Demands(A, *rest), method).status[1] == "singular"


def test_bounds_that_cross_are_impossible_and_named():
    A, b, offset, lower, upper, wish = CASES[0]
    lower = lower.copy()
    lower[3] = upper[3] + 0.1
    found = distribute(A, b, offset, lower, upper, wish, NEAREST)
    assert np.isnan(found.scale)
    assert found.stops // 2 == 3
