"""How an initial state follows from what an experimenter sets: free coordinates and lengths.

`cdpr.simulation.sensitivity` differentiates a motion by its whole initial state. With the winches
locked only the free coordinates, their rates and the cable lengths can be chosen; the rest follows.
"""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.model.batch import evaluate, with_jacobian
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.free_motion import split_coordinates
from freeswing.cdpr.robot import Array, finite


def start_slopes(
    model: Model,
    free: tuple[str, ...],
    zeta: Array,
    rates: Array,
    inertia: Array,
    values: Array | None = None,
    time_s: float = 0.0,
) -> Array:
    """Derivatives of [zeta; rates] by [free coordinates; their rates; lengths; inertia; values].

    Args:
        model: the robot.
        free: names of the 6 - n free coordinates.
        zeta: pose at the start, (6,).
        rates: admissible rates, (6,).
        inertia: `INERTIA_NAMES` values, (9,).
        values: effect values, (k,).
        time_s: time of the start.

    Returns:
        (12, 2 (6 - n) + n + 9 + k). Lengths are those that the winches tell.

    Raises:
        ValueError: for wrong shapes, and when the free coordinates do not determine the pose.

    Source:
        FIDIM 2022, eqs. (5), (44), by the implicit function theorem: Rudin 1976, Principles
        of Mathematical Analysis, ch. 9.
    """
    n = model.robot.n_cables
    chosen, _ = split_coordinates(model, free)
    values = model.start_values if values is None else values
    arguments = (time_s, finite("zeta", zeta, 6), finite("rates", rates, 6), inertia, values)
    slopes = np.vstack(
        [
            evaluate(with_jacobian(function, (1, 2, 3, 4)), *arguments)[1]
            for function in (model.told, model.slip)
        ]
    )
    given = [*chosen, *(6 + i for i in chosen)]
    follow = [i for i in range(12) if i not in given]
    block = slopes[:, follow]
    singular = np.linalg.svd(block, compute_uv=False)
    if singular[-1] < 1e-9 * singular[0]:
        raise ValueError(
            f"free coordinates {free} do not determine the pose (singular values of the dependent "
            f'block {singular[-1] / singular[0]:.1e} apart); use free_coordinates = "auto"'
        )
    lengths = np.vstack([np.eye(n), np.zeros((n, n))])
    right = np.hstack([-slopes[:, given], lengths, -slopes[:, 12:]])
    result = np.zeros((12, right.shape[1]))
    result[given, np.arange(len(given))] = 1.0
    result[follow] = np.linalg.solve(block, right)
    return result


def by_free_coordinates(change: Array, slopes: Array) -> Array:
    """Derivatives of a motion by what `start_slopes` differentiates by.

    Args:
        change: by [zeta_0; rates_0; inertia; values], (..., 6, 21 + k), of `Linearised.at`.
        slopes: of `start_slopes`.

    Returns:
        (..., 6, 2 (6 - n) + n + 9 + k).

    Source:
        Rudin 1976, Principles of Mathematical Analysis, ch. 9: the chain rule.
    """
    through = change[..., :12] @ slopes
    shared = change.shape[-1] - 12
    through[..., -shared:] += change[..., 12:]
    return through
