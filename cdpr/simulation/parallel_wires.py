"""Closed forms of a platform on parallel wires, whose yaw the classic formula describes."""

from __future__ import annotations


def bending(top_m: float, bottom_m: float, length_m: float, specific_izz: float) -> float:
    """How the frequency of yaw on parallel wires changes with its amplitude, 1/rad^2.

    omega(A) = omega (1 + k A^2), k = -1/16 + 3 p / (16 L^2) - p^2 / (4 L^2 s), with p the product
    of the radii and s inertia over mass: the pendulum's part, what wires that lean add to the
    potential, and the platform's own rise and fall, which wide benches feel most.

    Source:
        Landau, Lifshitz, Mechanics, sec. 28, for the energy m g (L - sqrt(L^2 - 2 p (1 - cos chi)))
        + m (s + (p sin chi / L)^2) chi'^2 / 2.
    """
    product = top_m * bottom_m
    lean = 3.0 * product / (16.0 * length_m**2)
    return -1.0 / 16.0 + lean - product**2 / (4.0 * length_m**2 * specific_izz)
