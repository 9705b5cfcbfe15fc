"""Effects that no catalogue of the product names: the right answer is "none of these"."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from tests.oracle.scenes.effects import Effect, Scene, changed, random_direction

OUTSIDE_MAGNITUDES: dict[str, tuple[str, float, float, float]] = {
    "hanging_bob": ("mass_kg", 0.05, 0.15, 0.4),
    "contact": ("stiffness_n_m", 100.0, 400.0, 1500.0),
    "magnet": ("force_at_0.3_m_n", 2.0, 8.0, 25.0),
    "winch_hunting": ("amplitude_m", 5e-5, 2e-4, 6e-4),
    "negative_damping": ("rate_1_s", -0.003, -0.01, -0.03),
    "chirp_force": ("amplitude_n", 0.05, 0.15, 0.5),
    "spinning_rotor": ("angular_momentum_nms", 0.05, 0.2, 0.6),
    "turbulence": ("rms_n", 0.03, 0.1, 0.3),
    "clock_rate": ("share", 1e-3, 3e-3, 1e-2),
}


def _hanging_bob(scene: Scene, mass: float, rng: np.random.Generator):
    """A ball on a string below the platform: two more pendulum coordinates."""
    pivot = np.array([0.12, 0.12, 0.05]) * rng.uniform(-1.0, 1.0, 3)
    length = rng.uniform(0.1, 0.3)
    drawn = {"bob_length": length, "bob_pivot": pivot, "bob_damping": 0.05 * mass}
    return changed(scene, bob_mass=mass, **drawn), drawn


def _contact(scene: Scene, stiffness: float, rng: np.random.Generator):
    """A padded stop, set up afresh in every run, that the centre of mass runs into."""
    scene = changed(scene, wall_stiffness=stiffness, wall_damping=0.02 * stiffness)
    return replace(scene, stop_share=0.5), {"stop_at_share_of_displacement": 0.5}


def _magnet(scene: Scene, force: float, rng: np.random.Generator):
    """Attraction of the centre of mass to a pole below, strength over distance^4."""
    place = scene.centre_m + np.array([*rng.uniform(-0.2, 0.2, 2), -0.4])
    strength = force * 0.3**4
    return changed(scene, magnet=place, magnet_strength=strength), {"place_m": place}


def _winch_hunting(scene: Scene, amplitude: float, rng: np.random.Generator):
    """One held length oscillates; its phase is new in every run."""
    k, hz = int(rng.integers(scene.n_cables)), rng.uniform(0.5, 2.5)
    hunting = np.zeros(scene.n_cables)
    hunting[k] = amplitude
    scene = replace(changed(scene, hunting=hunting, hunting_hz=hz), random_phase=True)
    return scene, {"cable": k, "frequency_hz": hz}


def _negative_damping(scene: Scene, rate: float, rng: np.random.Generator):
    """A draught that feeds the swing: drag of the wrong sign."""
    return changed(scene, drag=rate * scene.world.mass), {}


def _chirp_force(scene: Scene, amplitude: float, rng: np.random.Generator):
    """A motor that runs up: a horizontal force of rising frequency at P."""
    direction = random_direction(rng, flat=True)
    row = np.array([[0.8, 0.0, *(amplitude * direction), 0.22]])
    scene = replace(changed(scene, oscillators=row), random_phase=True)
    return scene, {"from_hz": 0.8, "slope_hz_s": 0.22, "direction": direction}


def _spinning_rotor(scene: Scene, momentum: float, rng: np.random.Generator):
    """Gyroscopic moment -omega x h of a rotor fixed to the platform."""
    rotor = momentum * random_direction(rng)
    return changed(scene, rotor=rotor), {"angular_momentum_nms_vector": rotor}


def _turbulence(scene: Scene, rms: float, rng: np.random.Generator):
    """Random broad-band force at P, 0.2 to 5 Hz."""
    count = 24
    rows = np.zeros((count, 6))
    rows[:, 0] = np.exp(rng.uniform(math.log(0.2), math.log(5.0), count))
    rows[:, 2:5] = rng.normal(0.0, rms * math.sqrt(2.0 / count), (count, 3))
    return replace(changed(scene, oscillators=rows), random_phase=True), {"lines": count}


def _clock_rate(scene: Scene, share: float, rng: np.random.Generator):
    """Time stamps run fast, which free motion cannot tell from weaker gravity."""
    return replace(scene, clock_rate=share), {}


OUTSIDE: dict[str, Effect] = {
    "hanging_bob": _hanging_bob,
    "contact": _contact,
    "magnet": _magnet,
    "winch_hunting": _winch_hunting,
    "negative_damping": _negative_damping,
    "chirp_force": _chirp_force,
    "spinning_rotor": _spinning_rotor,
    "turbulence": _turbulence,
    "clock_rate": _clock_rate,
}
