"""The regressor of the internal dynamics along a motion of a given model (FIDIM 2022, sec. 3.1)."""

from __future__ import annotations

from dataclasses import dataclass

from freeswing.cdpr.frozen import freeze
from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.model.free_motion import free_basis
from freeswing.cdpr.model.internal_dynamics import body_regressor, internal_regressor, twist_of
from freeswing.cdpr.robot import Array
from freeswing.cdpr.rotation import matrix_from_angles


@dataclass(frozen=True, slots=True)
class SwingMotion:
    """The platform's motion along a run, as far as the regressor needs it.

    Attributes:
        run: its name.
        free: names of the free coordinates.
        times_s: (n,).
        zetas: pose coordinates, (n, 6).
        rates: (n, 6).
        accelerations: (n, 6).
        lengths_m: cable lengths held, (n_cables,).
    """

    run: str
    free: tuple[str, ...]
    times_s: Array
    zetas: Array
    rates: Array
    accelerations: Array
    lengths_m: Array

    def __post_init__(self) -> None:
        freeze(self, "times_s", "zetas", "rates", "accelerations", "lengths_m")


def regressor(model: Model, motion: SwingMotion) -> Array:
    """W'_EE along a motion (eqs. 19-22), (n, 6 - n_cables, 10)."""
    zetas, rates, accelerations = motion.zetas, motion.rates, motion.accelerations
    turn, turn_rate = evaluate(model.twist_map, zetas, rates)
    twist, twist_rate = twist_of(turn, turn_rate, rates, accelerations)
    body = body_regressor(
        matrix_from_angles(zetas[:, 3:]),
        twist_rate[:, :3],
        twist[:, 3:],
        twist_rate[:, 3:],
        model.robot.gravity_m_s2,
    )
    basis = free_basis(model, motion.free, zetas, rates, model.start_values)
    return internal_regressor(body, basis.xi_perp)
