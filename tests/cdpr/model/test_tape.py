"""Tapes give what CasADi's own interpreter gives, to the bit."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from freeswing.cdpr.compiled.interpreter import KNOWN, SIZES, lanes_for
from freeswing.cdpr.effects import catalogue
from freeswing.cdpr.model.batch import Bound, evaluate, tape_of
from freeswing.cdpr.model.equations import build_model
from tests.cdpr.model_cases import ring

x, y = ca.SX.sym("x"), ca.SX.sym("y")
ONE = [
    -x, x * x, 2 * x, 1 / x, ca.sqrt(x), ca.sin(x), ca.cos(x), ca.tan(x), ca.asin(x / 9),
    ca.acos(x / 9), ca.atan(x), ca.tanh(x), ca.exp(x), ca.log(x), ca.fabs(x), ca.sign(x),
    ca.logic_not(x), x**3.5, ca.sinh(x), ca.cosh(x), ca.asinh(x), ca.acosh(1 + x), ca.atanh(x / 9),
    ca.erf(x), ca.log1p(x), ca.expm1(x), ca.floor(x), ca.ceil(x),
]  # fmt: skip
TWO = [
    x * y, x + y, x - y, x / y, ca.atan2(x, y), x**y, ca.fmin(x, y), ca.fmax(x, y), x < y, x <= y,
    x == y, x != y, ca.logic_and(x, y), ca.logic_or(x, y), ca.if_else(x < y, x, y),
    ca.fmod(x, y), ca.copysign(x, y), ca.hypot(x, y),
]  # fmt: skip
POINTS = np.array(
    [[a, b] for a in (-2.5, -0.0, 0.0, 1.0, 3.0, np.nan) for b in (-2.5, 0.0, 1.0, 3.0, np.nan)]
)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("expression", [*ONE, *TWO], ids=str)
def test_every_operation_is_casadis_own(expression: ca.SX) -> None:
    function = ca.Function("f", [x, y], [expression])
    tape = tape_of(function)
    assert tape is not None
    expected = [float(function(*point)) for point in POINTS]
    np.testing.assert_array_equal(tape.run(POINTS)[:, 0], expected)


def test_operations_are_all_tried() -> None:
    function = ca.Function("f", [x, y], [*ONE, *TWO])
    seen = {function.instruction_id(k) for k in range(function.n_instructions())}
    assert set(KNOWN) - seen <= {ca.OP_ASSIGN}


@pytest.mark.parametrize("count", [1, 12, 16, 17, 63, 64, 65, 197])
def test_blocks_of_any_length_are_whole(count: int) -> None:
    symbols = ca.SX.sym("z", 3)
    function = ca.Function(
        "f", [x, symbols], [ca.sin(symbols) * x, ca.jacobian(symbols * symbols[0], symbols)],
        ["scalar_time", "z"], ["column", "matrix_slopes"],
    )  # fmt: skip
    dense = ca.Function(
        "f", [x, symbols], [ca.densify(one) for one in function(x, symbols)],
        ["scalar_time", "z"], ["column", "matrix_slopes"],
    )  # fmt: skip
    times = np.linspace(-1.0, 2.0, count)
    states = np.random.default_rng(1).normal(size=(count, 3))
    columns, slopes = evaluate(dense, times, states)
    bound = Bound(dense, count)
    bound.inputs[0][:, 0], bound.inputs[1][:] = times, states
    bound.run()
    for k in range(count):
        column, matrix = dense(times[k], states[k])
        np.testing.assert_array_equal(columns[k], np.array(column)[:, 0])
        np.testing.assert_array_equal(slopes[k], np.array(matrix))
        np.testing.assert_array_equal(bound.outputs[0][k], columns[k])
        np.testing.assert_array_equal(bound.outputs[1][k].T, slopes[k])


def test_blocks_fit_the_number_of_points() -> None:
    assert [lanes_for(count) for count in (2, 12, 16, 24, 64, 336)] == [16, 16, 16, 16, 64, 64]
    assert all(lanes_for(count) in SIZES for count in range(1, 400))


def test_what_a_tape_does_not_know_goes_through_casadi() -> None:
    unknown = ca.Function("f", [x], [ca.remainder(x, 0.3)])
    assert tape_of(unknown) is None
    numbers = np.array([[0.1], [0.5], [2.0]])
    found = evaluate(unknown, numbers)[0]
    np.testing.assert_array_equal(found[:, 0], [float(unknown(one)) for one in numbers[:, 0]])
    matrix = ca.MX.sym("m", 2)
    assert tape_of(ca.Function("g", [matrix], [2 * matrix])) is None


def test_a_model_with_every_effect_has_tapes() -> None:
    quick = tuple(name for name in catalogue() if not catalogue()[name].needs_tension)
    model = build_model(ring(4), quick)
    for name in ("acceleration", "pulled", "told", "slip", "measured", "cables", "cable_rates"):
        assert tape_of(getattr(model, name)) is not None, name
