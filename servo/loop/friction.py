"""Coulomb friction fed forward: the current that each motor needs to overcome its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from freeswing.servo.synthesis.state_space import Array


@dataclass(frozen=True, slots=True)
class FrictionFeed:
    """A current towards where each motor should turn.

    A motor that turns needs f_c against its turning; one that sticks needs it towards the angle
    that is asked for. Both in one: the sign, smoothed, of `rate + pull * (angle asked - angle)`.

    Attributes:
        coulomb_N_m: the identified f_c, (n,).
        torque_N_m_A: k_em, (n,).
        share: of f_c that is fed: less than all of it, so that an f_c identified too large does
            not drive the motor by itself.
        pull_per_s: how fast an angle error is to be run down.
        width_rad_s: of the smoothed sign.
    """

    coulomb_N_m: Array
    torque_N_m_A: Array
    share: float = 0.9
    pull_per_s: float = 10.0
    width_rad_s: float = 0.3

    def currents(self, rates_rad_s: Array, errors_rad: Array) -> Array:
        """Currents to add, (n,).

        Args:
            rates_rad_s: measured, (n,).
            errors_rad: angle asked for minus angle measured, (n,).
        """
        towards = rates_rad_s + self.pull_per_s * errors_rad
        size = self.share * self.coulomb_N_m / self.torque_N_m_A
        return size * np.tanh(towards / self.width_rad_s)
