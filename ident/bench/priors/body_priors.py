"""What is known of a bench's bodies before any run: mass, centre, tensor, by the wires' spread."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.cdpr.robot import Array, Robot, spread_of
from freeswing.ident.bench.runs import Bench, BenchRun, Load
from freeswing.ident.bench.swing import IZZ
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown

WIDE_COM = 0.3  # of the attachments' spread: a body lies or hangs among its wires
UPRIGHT = 0.9  # of gravity along a platform axis: along it the centre may hang far down
CENTRED_COM = 0.02  # the same of a platform, across: its wires share the weight to 4 %
WIDE_TENSOR = 2.0  # of mass x spread^2: twice a hoop through the wires
WIDE_PRODUCTS = 0.3  # of its Izz: a body of 1 to 2.5 whose axes lie askew by 25 degrees
WIDE_MASS = 0.5  # of the declared mass, where payloads are to say it


def extent(robot: Robot) -> float:
    """How far the attachments spread, root mean square, at least 5 cm."""
    return max(0.05, spread_of(robot.attachments_m))


def platform_block(robot: Robot, bench: Bench, runs: Sequence[BenchRun], body: Array) -> Unknown:
    """The platform, from a first guess of its `BODY_NAMES` values, (10,)."""
    mass, size = body[0], extent(robot)
    payload = any(run.payloads for run in runs)
    std = bench.mass_std_kg or (WIDE_MASS * mass if payload else None)
    wide = wide_body(mass, size, body[IZZ])
    down = np.abs(robot.gravity_m_s2) / np.linalg.norm(robot.gravity_m_s2)
    wide[:3] *= np.where(down > UPRIGHT, 1.0, CENTRED_COM / WIDE_COM)
    spread = np.concatenate([[std or 1.0], wide])
    mean = np.concatenate([body[:7], np.zeros(3)])
    estimated = np.array([std is not None] + [True] * 9)
    scale = np.concatenate([[0.1 * mass], 0.5 * wide])
    prior = Gaussian(mean, spread, "a body of the attachments' spread")
    return Unknown("platform", body, scale, prior, estimated)


def wide_body(mass_kg: float, extent_m: float, izz_kg_m2: float) -> Array:
    """Prior spread of centre and tensor of a body of which nothing but its size is known, (9,).

    Source:
        Bishop 2006, Pattern Recognition and Machine Learning, sec. 2.3: a wide prior; sizes
        by m l^2.
    """
    tensor = np.full(3, WIDE_TENSOR * mass_kg * extent_m**2)
    products = np.full(3, WIDE_PRODUCTS * abs(izz_kg_m2))
    return np.concatenate([np.full(3, WIDE_COM * extent_m), tensor, products])


def load_block(load: Load, robot: Robot, body: Array) -> Unknown:
    """A load, from a first guess of its `BODY_NAMES` values, (10,)."""
    wide = wide_body(load.mass_kg, extent(robot), body[IZZ])
    if load.com_std_m is not None:
        wide[:3] = load.com_std_m
    mass_std = load.mass_std_kg or 0.0
    spread = np.concatenate([[mass_std or 1.0], wide])
    mean = np.concatenate([body[:7], np.zeros(3)])
    estimated = np.array([mass_std > 0.0] + [True] * 9)
    scale = np.concatenate([[mass_std or 1.0], 0.5 * wide])
    return Unknown(
        f"load.{load.name}", body, scale, Gaussian(mean, spread, "session.toml"), estimated
    )
