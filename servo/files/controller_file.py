"""controller.json, and the same controller for programs that read other things."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from freeswing.cdpr.files.documents import load_json
from freeswing.cdpr.files.problems import InputError
from freeswing.servo.design.controller import Controller
from freeswing.servo.design.mpc import Predictor
from freeswing.servo.synthesis.loop import Loop
from freeswing.servo.synthesis.state_space import Array, StateSpace

FORMAT = "freeswing-controller/1"
LARGEST_FILE_BYTES = 64 * 2**20


def to_document(found: Controller) -> dict[str, Any]:
    """What controller.json says of a controller."""
    k = found.sampled
    loop = found.undelayed
    document: dict[str, Any] = {
        "format": FORMAT,
        "method": found.method,
        "gamma": found.gamma,
        "order": k.order,
        "sample_rate_hz": round(1.0 / (k.period_s or np.nan)),
        "A": k.A.tolist(),
        "B": k.B.tolist(),
        "C": k.C.tolist(),
        "D": k.D.tolist(),
        "margins": _pair(loop, "modulus_margin"),
        "bandwidth_rad_s": _pair(loop, "bandwidth_rad_s"),
        "static_error": _pair(loop, "static_error"),
        "stable": loop.stable,
        "delay_margin_s": loop.delay_margin_s,
        "with_delay": {
            "delay_s": found.delay_s,
            "stable": found.delayed.stable,
            "margins": _pair(found.delayed, "modulus_margin"),
            "bandwidth_rad_s": _pair(found.delayed, "bandwidth_rad_s"),
        },
        "operating_point": {
            "position_m": found.at[:3].tolist(),
            "angles_rad": found.at[3:].tolist(),
            "wrench": found.wrench.tolist(),
        },
        "warnings": list(found.warnings),
    }
    if found.carried:
        document["carried_by_encoders"] = True
    if found.predictor is not None:
        parts = {one.name: getattr(found.predictor, one.name) for one in fields(Predictor)}
        document["predictor"] = {name: matrix.tolist() for name, matrix in parts.items()}
    document |= {key: value for key, value in found.facts.items() if key != "gamma"}
    return document


def _pair(loop: Loop, key: str) -> dict[str, float]:
    return {
        "position": getattr(loop.position, key),
        "orientation": getattr(loop.orientation, key),
    }


@dataclass(frozen=True, slots=True)
class Stored:
    """A controller as a file gives it.

    Attributes:
        method: its name.
        system: sampled, pose error to wrench.
        wrench: F_ev that holds the pose of the design, (6,).
        joint: it works on the motors' angles instead of the pose.
        carried: it was designed for poses that the encoders carry on to now.
        at: the pose of the design, (6,).
        predictor: of a predictive controller, else None.
    """

    method: str
    system: StateSpace
    wrench: Array
    joint: bool = False
    carried: bool = False
    at: Array = field(default_factory=lambda: np.zeros(6))
    predictor: Predictor | None = None


def read_controller(path: Path | str) -> Stored:
    """Read controller.json.

    Raises:
        InputError: unreadable, of another kind, or matrices that do not fit together.
    """
    table = load_json(path, FORMAT, LARGEST_FILE_BYTES, "freeswing design writes such a file")
    try:
        rate = float(table["sample_rate_hz"])
        matrices = [np.array(table[key], dtype=np.float64) for key in "ABCD"]
        order = int(table["order"])
        shapes = ((order, order), (order, 6), (6, order), (6, 6))
        A, B, C, D = (m.reshape(s) for m, s in zip(matrices, shapes, strict=True))
        point = table["operating_point"]
        wrench = np.array(point["wrench"], dtype=np.float64).reshape(6)
        at = np.array([*point["position_m"], *point["angles_rad"]], dtype=np.float64).reshape(6)
        system = StateSpace(A, B, C, D, 1.0 / rate)
        method = str(table.get("method", "hinf"))
        predictor = _predictor(table.get("predictor"), order)
    except (KeyError, TypeError, ValueError, OverflowError, ZeroDivisionError) as error:
        raise InputError(
            f"{path}: not a controller of 6 errors and 6 wrenches: {error!r}"
        ) from error
    carried = table.get("carried_by_encoders") is True
    return Stored(method, system, wrench, method == "joint-pid", carried, at, predictor)


def _predictor(table: Mapping[str, Any] | None, order: int) -> Predictor | None:
    """The matrices of a predictive controller.

    Raises:
        KeyError, TypeError, ValueError: where one is missing or of another shape.
    """
    if table is None:
        return None
    m, n = 12, order
    shapes = {
        "A": (n, n), "B": (n, 6), "C": (6, n), "observer": (n, 6), "step_A": (m, m),
        "step_B": (m, 6), "gain": (6, m), "state_cost": (m, m), "wrench_cost": (6, 6),
        "end_cost": (m, m), "by_pose": (m + 6, 6), "by_outside": (m + 6, 6),
    }  # fmt: skip
    parts = {}
    for name, shape in shapes.items():
        matrix = np.array(table[name], dtype=np.float64)
        if matrix.shape != shape or not np.isfinite(matrix).all():
            raise ValueError(f"predictor.{name} must be {shape[0]} by {shape[1]} finite numbers")
        parts[name] = matrix
    return Predictor(**parts)


def npz_bytes(found: Controller) -> bytes:
    """The sampled and the continuous matrices, for numpy."""
    buffer = io.BytesIO()
    np.savez(buffer, **_arrays(found))
    return buffer.getvalue()


def mat_bytes(found: Controller) -> bytes:
    """The same as a MATLAB file, version 5."""
    from scipy.io import savemat

    buffer = io.BytesIO()
    savemat(buffer, {key: np.atleast_2d(value) for key, value in _arrays(found).items()})
    return buffer.getvalue()


def _arrays(found: Controller) -> dict[str, Any]:
    k, c = found.sampled, found.system
    return {
        "A": k.A, "B": k.B, "C": k.C, "D": k.D, "period_s": np.array(k.period_s),
        "Ac": c.A, "Bc": c.B, "Cc": c.C, "Dc": c.D,
        "at": found.at, "wrench": found.wrench,
    }  # fmt: skip


def c_header(found: Controller) -> str:
    """A header without dependencies: constants, a state, one step."""
    k = found.sampled
    tables = "\n".join(
        _c_table(f"freeswing_{name}", matrix)
        for name, matrix in (
            ("A", k.A), ("B", k.B), ("C", k.C), ("D", k.D), ("rest_wrench", found.wrench[None, :])
        )
    )  # fmt: skip
    return _HEADER.format(
        method=found.method, order=k.order, period=f"{k.period_s!r}", tables=tables
    )


def _c_table(name: str, matrix: Array) -> str:
    rows = ",\n".join("  {" + ", ".join(repr(float(v)) for v in row) + "}" for row in matrix)
    shape = f"[{matrix.shape[0]}][{matrix.shape[1]}]"
    return f"static const double {name}{shape} = {{\n{rows}\n}};"


_HEADER = """\
/* {method} controller of order {order}. Each {period} s call
     freeswing_step(x, error, wrench)
   with error = pose asked for minus pose, [x y z roll pitch yaw] in m and rad. The wrench is the
   force in N and the moment in N m, base axes, that the motors are to make (W_I I of the paper's
   eq. (13)); it holds the platform's own rest wrench. x is FREESWING_ORDER doubles, all 0 at the
   start. */
#ifndef FREESWING_CONTROLLER_H
#define FREESWING_CONTROLLER_H
#define FREESWING_ORDER {order}
#define FREESWING_PERIOD_S {period}
{tables}
static void freeswing_step(double x[FREESWING_ORDER], const double error[6], double wrench[6]) {{
  double next[FREESWING_ORDER];
  int i, j;
  for (i = 0; i < 6; ++i) {{
    wrench[i] = freeswing_rest_wrench[0][i];
    for (j = 0; j < FREESWING_ORDER; ++j) wrench[i] += freeswing_C[i][j] * x[j];
    for (j = 0; j < 6; ++j) wrench[i] += freeswing_D[i][j] * error[j];
  }}
  for (i = 0; i < FREESWING_ORDER; ++i) {{
    next[i] = 0.0;
    for (j = 0; j < FREESWING_ORDER; ++j) next[i] += freeswing_A[i][j] * x[j];
    for (j = 0; j < 6; ++j) next[i] += freeswing_B[i][j] * error[j];
  }}
  for (i = 0; i < FREESWING_ORDER; ++i) x[i] = next[i];
}}
#endif
"""
