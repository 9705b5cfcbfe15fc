"""One rule for all controllers: as fast as margins and noise allow.

Each controller has two speeds, of positions and of orientations; those of H-infinity are the
rates of its weights, as shares of those given. Each is made as
large as it can be while, with the poses as old as they are and white noise on them, the modulus
margin of its half stays above `LEAST_MARGIN` and the wrench that the noise alone commands stays
below `MOST_NOISE`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from freeswing.servo.design.plant import Plant
from freeswing.servo.synthesis.four_block import bare
from freeswing.servo.synthesis.state_space import Array, Complex, StateSpace, close

# 6 dB, the paper's own goal, is 0.5; a tenth less is what its design keeps with its camera.
LEAST_MARGIN = 0.45
# 10 % apart; beyond 12 rad/s a step of 0.2 m asks for more force than eight motors of 3 A have.
SPEEDS_RAD_S = np.geomspace(0.2, 12.0, 44)
# Force and moment, rms: a twentieth of what the cables of samples/inca-6d give about its centre.
MOST_NOISE = np.array([0.5, 0.05])
RATES_RAD_S = np.geomspace(0.01, 1000.0, 300)


@dataclass(frozen=True, slots=True)
class Noise:
    """White noise of poses that come every `period_s` and are held."""

    std: Array
    period_s: float


@dataclass(frozen=True, slots=True)
class Look:
    """What the rule looks at: margins of positions and orientations, noise-borne force, moment."""

    stable: bool
    margins: tuple[float, float]
    noise: tuple[float, float]


def look(
    plant: Plant, response: Complex, controller: StateSpace, late: float, noise: Noise
) -> Look:
    """Margins and noise at `RATES_RAD_S`, where the plant's `response` is given."""
    K = controller.at(RATES_RAD_S)
    delay = np.exp(-1j * RATES_RAD_S * late)[:, None, None]
    S = np.linalg.inv(np.eye(6) + response @ K * delay)
    margins = tuple(
        float(1.0 / np.linalg.norm(S[:, half, half], 2, axis=(1, 2)).max())
        for half in (slice(0, 3), slice(3, 6))
    )
    # Held white noise has the spectrum std^2 period sinc^2; two-sided over rates.
    held = np.sinc(RATES_RAD_S * noise.period_s / (2.0 * np.pi))[:, None, None]
    squared = np.abs(K @ S * held * noise.std) ** 2
    power = noise.period_s / np.pi * np.trapezoid(squared.sum(axis=2), RATES_RAD_S, axis=0)
    rms = np.sqrt(power)
    sizes = (float(rms[:3].max()), float(rms[3:].max()))
    stable = close(bare(plant.delayed()).plant, controller).is_stable()
    return Look(stable, (margins[0], margins[1]), sizes)


def fastest(
    make: Callable[[Array], StateSpace],
    plant: Plant,
    late: float,
    noise: Noise,
    *,
    tied: bool = False,
    grid: Array = SPEEDS_RAD_S,
) -> Array:
    """The speeds of the rule, (6,): the largest that keep it, looked for from above.

    Args:
        make: controller of six speeds.
        plant: what it is for.
        late: age of poses when they are used.
        noise: of the poses.
        tied: positions and orientations have one speed.
        grid: speeds to choose from, rising; in rad/s, or as shares of a design's own.

    Raises:
        ValueError: where none keeps the rule.

    Source:
        Skogestad, Postlethwaite 2005, Multivariable Feedback Control, sec. 2.4: margins as
        limits.
    """
    response = plant.system.at(RATES_RAD_S)

    def keeps(position: int, orientation: int) -> bool:
        speeds = grid[[position] * 3 + [orientation] * 3]
        seen = look(plant, response, make(speeds), late, noise)
        small = np.array(seen.noise) <= MOST_NOISE
        return seen.stable and min(seen.margins) >= LEAST_MARGIN and bool(small.all())

    falling = range(len(grid) - 1, -1, -1)
    position = next((i for i in falling if keeps(i, i if tied else 0)), None)
    if position is None:
        raise ValueError(
            f"no speed from {grid[0]:g} to {grid[-1]:g} keeps a modulus "
            f"margin of {LEAST_MARGIN} at {1e3 * late:.1f} ms with a noise-borne wrench below "
            f"{MOST_NOISE[0]:g} N and {MOST_NOISE[1]:g} N m"
        )
    orientation = position if tied else next(i for i in falling if keeps(position, i))
    return grid[[position] * 3 + [orientation] * 3]
