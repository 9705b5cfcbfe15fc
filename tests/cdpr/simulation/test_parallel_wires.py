"""Yaw on parallel wires: the frequency's dependence on amplitude, by quadrature of its energy."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.cdpr.simulation.parallel_wires import bending


@pytest.mark.parametrize(
    ("radius_m", "length_m", "izz"), [(0.25, 1.2, 0.032), (1.0, 0.995, 0.28), (0.2, 2.0, 0.01)]
)
def test_the_frequencys_bending_is_that_of_the_energy(
    radius_m: float, length_m: float, izz: float
) -> None:
    """T = 4 int sqrt(mass / (2 (E - V))) over a quarter, with chi = A sin u."""
    product = radius_m**2

    def hanging(chi: np.ndarray) -> np.ndarray:
        return np.sqrt(length_m**2 - 4.0 * product * np.sin(chi / 2.0) ** 2)

    def frequency(amplitude: float) -> float:
        angles = (np.arange(2000) + 0.5) / 2000 * np.pi / 2.0
        chi, end = amplitude * np.sin(angles), np.array(amplitude)
        mass = izz + (product * np.sin(chi) / hanging(chi)) ** 2
        # cos chi - cos A as a product: nothing cancels
        left = 2.0 * np.sin((end + chi) / 2.0) * np.sin((end - chi) / 2.0)
        energy = 2.0 * 9.81 * 2.0 * product * left / (hanging(chi) + hanging(end))
        quarter = np.mean(np.sqrt(mass / energy) * amplitude * np.cos(angles)) * np.pi / 2.0
        return float(np.pi / 2.0 / quarter)

    small, large = 0.002, 0.03
    slope = (frequency(large) / frequency(small) - 1.0) / (large**2 - small**2)
    assert slope == pytest.approx(bending(radius_m, radius_m, length_m, izz), rel=0.01)
