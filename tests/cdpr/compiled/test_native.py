"""Machine code against CasADi's interpreter: the same bits."""

import gc

import casadi as ca
import numba
import numpy as np
import pytest

from freeswing.cdpr.compiled.emit import BINARY, COMPARED, LIBRARY, VECTOR, intermediate
from freeswing.cdpr.compiled.native import call_at, native
from freeswing.cdpr.driven.slopes import directed_slope, motion_slope
from freeswing.cdpr.model.batch import evaluate
from tests.cdpr.driven_robots import inca, random_states


@numba.njit
def called(address, inputs, outputs):
    call_at(address, inputs.ctypes.data, outputs.ctypes.data)


def results(function, inputs, lanes):
    """Outputs one after another for inputs (lanes, n_in), (lanes, n_out)."""
    code = native(function, lanes)
    assert code.n_in == inputs.shape[1]
    outputs = np.zeros((code.n_out, lanes))
    called(code.address, np.ascontiguousarray(inputs.T), outputs)
    return outputs.T


def interpreted(function, inputs):
    ends = np.cumsum([function.nnz_in(i) for i in range(function.n_in())])[:-1]
    rows = [function.call(np.split(row, ends)) for row in inputs]
    return np.array([np.concatenate([np.array(o).T.ravel() for o in row]) for row in rows])


@pytest.mark.parametrize("lanes", [1, 4])
def test_the_equations_of_motion_are_the_interpreters_bit_by_bit(lanes):
    model, generator = inca(), np.random.default_rng(0)
    rows = [random_states(lanes), generator.uniform(0, 2, (lanes, 8))]
    inputs = np.hstack([*rows, np.tile(model.declared, (lanes, 1))])
    assert np.array_equal(results(model.motion, inputs, lanes), interpreted(model.motion, inputs))


def operations():
    """Every operation that can be compiled, of two numbers."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    one = [ca.exp, ca.log, ca.sin, ca.cos, ca.tan, ca.asin, ca.acos, ca.atan, ca.sinh, ca.cosh]
    one += [ca.tanh, ca.asinh, ca.atanh, ca.erf, ca.log1p, ca.expm1, ca.sqrt, ca.fabs, ca.floor]
    one += [ca.ceil, ca.sign, lambda a: -a, lambda a: 1 / a, lambda a: a * a, lambda a: a + a]
    one += [lambda a: a**3.5, lambda a: ca.acosh(1 + a), ca.logic_not]
    two = [ca.atan2, ca.fmin, ca.fmax, ca.fmod, ca.copysign, ca.hypot, lambda a, b: a**b]
    two += [lambda a, b: a < b, lambda a, b: a <= b, lambda a, b: a == b, lambda a, b: a != b]
    two += [ca.logic_and, ca.logic_or]
    two += [lambda a, b: ca.if_else(a < b, a, b), lambda a, b: a - b, lambda a, b: a / b]
    two += [lambda a, b: a * b, lambda a, b: a + b]
    return ca.Function("all", [x, y], [f(x) for f in one] + [f(x, y) for f in two])


@pytest.mark.parametrize("lanes", [1, 2])
def test_every_operation_is_the_interpreters(lanes):
    function = operations()
    seen = {function.instruction_id(k) for k in range(function.n_instructions())}
    missing = {*BINARY, *VECTOR, *LIBRARY, *COMPARED} - seen
    assert missing <= {ca.OP_POW, ca.OP_CONSTPOW}, missing  # one of the two stands for a power
    for first in ([0.3, 0.7], [0.7, 0.3], [0.5, 0.5], [0.2, -0.0]):
        inputs = np.tile(first, (lanes, 1))
        found, expected = results(function, inputs, lanes), interpreted(function, inputs)
        assert np.array_equal(found, expected, equal_nan=True), first


@pytest.mark.slow
def test_code_that_is_given_up_leaves_the_rest_alone():
    x = ca.SX.sym("x")
    kept = native(ca.Function("kept", [x], [ca.sin(x)]))
    for k in range(80):  # more than are kept: engines come and go
        code = native(ca.Function("passing", [x], [x + k]))
        gc.collect()
        outputs = np.zeros(1)
        called(code.address, np.ones(1), outputs)
        assert outputs[0] == 1.0 + k
    called(kept.address, np.ones(1), outputs)
    assert outputs[0] == np.sin(1.0)


def test_what_is_not_of_scalars_is_refused():
    x = ca.SX.sym("x")
    with pytest.raises(ValueError, match="not one of scalars"):
        intermediate(ca.Function("odd", [x], [ca.erfinv(x)]), "odd")


def test_derivatives_backwards_are_those_forwards():
    model, chosen = (
        inca(("spring_constant",)),
        ("arm_m", "Ixx_kg_m2", "spring_constant.added_5_N_m"),
    )
    state, currents = random_states(1, seed=3)[0], np.linspace(0, 1, 8)
    forwards = evaluate(motion_slope(model, chosen), state, currents, model.declared)
    whole = np.hstack(forwards[1:])
    for k, direction in enumerate(np.eye(6)):
        found = evaluate(directed_slope(model, chosen), state, currents, model.declared, direction)
        gap = np.abs(found[0] - whole[k]).max() / np.abs(whole[k]).max()
        assert gap < 1e-12, f"row {k}: {gap:.1e} apart"
