"""Which swings of a bench of parallel wires tell an object's Izz best: a plan by its error budget.

Yaw of a centred platform: omega^2 = g M R r / (I L) (du Bois, Lieven, Adhikari 2009, Error analysis
in trifilar inertia measurements, eq. 1), its frequency changing with amplitude. Runs of three kinds
(empty, known mass, object) tell platform, object and what is wrong with M R r / L.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.robot import Array, Robot, spread_of
from freeswing.cdpr.simulation.parallel_wires import bending

GRAVITY_M_S2 = 9.80665
KINDS = ("empty", "known mass", "object")
UNKNOWNS = ("platform", "object", "mass", "object's mass", "wires", "radii", "clock", "amplitude")
STEP = 1e-5  # relative, for slopes: the function is smooth, its third derivatives of order one
ENOUGH = 1.02  # of the least deviation
CHOICES: Mapping[str, tuple[float, ...]] = {
    "twist_deg": (2.0, 4.0, 6.0, 8.0, 12.0, 16.0),
    "duration_s": (10.0, 20.0, 40.0, 80.0),
    "known_at": (0.25, 0.5, 0.75, 1.0),
    "length_m": (0.5, 1.0, 1.5, 2.0, 3.0),
    "radius": (0.5, 0.75, 1.0, 1.5),
}

HOOP = 0.5  # of mass x radius^2: the platform's inertia where none is given, a full disc's
SMALL = 0.1  # the same of an object that lies on it


@dataclass(frozen=True, slots=True)
class BenchCase:
    """A bench, how well it is known, and how it is swung.

    Attributes:
        mass_kg: of the platform; mass_std_kg: how well it is weighed.
        izz_kg_m2: a guess of its inertia.
        load_kg: of the object; load_std_kg: how well it is weighed.
        load_izz_kg_m2: a guess of its inertia.
        known_kg: of the known mass.
        radius_m: of the wires' ends about the middle; radius_std_m: how well.
        length_m: of the wires; length_std_m: how well.
        com_std_m: how far the platform's centre of mass may be beside the middle, each way.
        clock_std: relative error of the frame rate.
        gain_std: relative error of the amplitude (0: yaw itself is measured).
        noise_rad: of yaw, one sample; rate_hz: samples a second.
        decay_1_s: of the amplitude.
        rehanging: of Izz, what hanging, placing and twisting anew scatter from run to run.
        runs: of each kind.
        twist_deg: first amplitude; duration_s: of a run.
        known_at: distance of the known mass from the middle, over the radius.
        radius: factor on the radius, the platform's inertia going with its square.
    """

    mass_kg: float
    izz_kg_m2: float
    load_kg: float
    load_izz_kg_m2: float
    radius_m: float
    length_m: float
    known_kg: float
    mass_std_kg: float = 0.05
    load_std_kg: float = 5e-4
    radius_std_m: float = 5e-4
    length_std_m: float = 1e-3
    com_std_m: float = 0.002
    clock_std: float = 1e-4
    gain_std: float = 0.0
    noise_rad: float = 5e-4
    rate_hz: float = 50.0
    decay_1_s: float = 0.01
    rehanging: float = 5e-4
    runs: int = 3
    twist_deg: float = 6.0
    duration_s: float = 20.0
    known_at: float = 1.0
    radius: float = 1.0

    def __post_init__(self) -> None:
        for name in ("mass_kg", "izz_kg_m2", "load_kg", "load_izz_kg_m2", "radius_m", "length_m"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} is {getattr(self, name):g}, must be > 0")


def _frequencies(case: BenchCase, shift: Array) -> Array:
    """Yaw frequencies (3,) of the three kinds of runs, rad/s, with `UNKNOWNS` off by `shift`."""
    reach = case.radius * case.radius_m
    platform = case.izz_kg_m2 * case.radius**2 * (1.0 + shift[0])
    load = case.load_izz_kg_m2 * (1.0 + shift[1])
    mass, added = case.mass_kg * (1.0 + shift[2]), case.load_kg * (1.0 + shift[3])
    known = case.known_kg * (case.known_at * reach) ** 2
    masses = mass + np.array([0.0, case.known_kg, added])
    inertias = platform + np.array([0.0, known, load])
    stiffness = GRAVITY_M_S2 * masses * (reach * (1.0 + shift[5])) ** 2
    stiffness = stiffness / (case.length_m * (1.0 + shift[4]))
    bent = [bending(reach, reach, case.length_m, one) for one in inertias / masses]
    grown = 1.0 + np.array(bent) * (np.deg2rad(case.twist_deg) * (1.0 + shift[7])) ** 2
    return np.asarray(np.sqrt(stiffness / inertias) * grown * (1.0 + shift[6]))


def frequency_std(case: BenchCase, omega: float) -> float:
    """Cramer-Rao bound of a decaying sine's frequency from one run, rad/s.

    Phase, amplitude and zero unknown (Rife, Boorstyn 1974, eq. 17, with the decay put in).
    """
    count = max(8, int(case.duration_s * case.rate_hz))
    times = (np.arange(count) / case.rate_hz)[:, None]
    fall = np.exp(-case.decay_1_s * times)
    cosine, sine = fall * np.cos(omega * times), fall * np.sin(omega * times)
    amplitude = np.deg2rad(case.twist_deg)
    slopes = np.hstack([-amplitude * times * sine, cosine, sine, np.ones((count, 1))])
    scale = np.linalg.norm(slopes, axis=0)
    inverse = np.linalg.inv((slopes / scale).T @ (slopes / scale))
    return float(case.noise_rad * np.sqrt(inverse[0, 0]) / scale[0])


def deviations(case: BenchCase) -> dict[str, float]:
    """Standard deviations of the object's Izz by source, kg m2, and `total`.

    A source's share is what knowing it exactly would take away, as in results/identification.json.
    """
    at = np.zeros(len(UNKNOWNS))
    slopes = np.stack(
        [
            (_frequencies(case, at + step) - _frequencies(case, at - step)) / (2.0 * STEP)
            for step in STEP * np.eye(len(at))
        ],
        axis=1,
    )
    omegas = _frequencies(case, at)
    noise = np.array([frequency_std(case, omega) for omega in omegas])
    noise = np.hypot(noise, 0.5 * case.rehanging * omegas) / np.sqrt(case.runs)
    white = slopes / noise[:, None]
    believed = {
        "mass": case.mass_std_kg / case.mass_kg,
        "object's mass": case.load_std_kg / case.load_kg,
        "wires": case.length_std_m / case.length_m,
        "radii": case.radius_std_m / (case.radius * case.radius_m),
        "clock": case.clock_std,
        "amplitude": case.gain_std,
    }
    # What is believed exactly keeps a spread that adds nothing, so that all can be inverted.
    spread = np.array([max(believed.get(name, 1e3), 1e-9) for name in UNKNOWNS])
    covariance = np.linalg.inv(white.T @ white + np.diag(1.0 / spread**2))
    load = UNKNOWNS.index("object")
    total, found = float(covariance[load, load]), {}
    for name in believed:
        k = UNKNOWNS.index(name)
        found[name] = float(covariance[load, k] ** 2 / covariance[k, k])
    places = [UNKNOWNS.index(name) for name in believed]
    side, inner = covariance[load, places], covariance[np.ix_(places, places)]
    scale = np.sqrt(np.diag(inner))
    explained = (side / scale) @ np.linalg.solve(inner / np.outer(scale, scale), side / scale)
    found["samples and rehanging"] = max(total - float(explained), 0.0)
    found["centre of mass"] = _beside(case) ** 2
    shares = {name: case.load_izz_kg_m2 * float(np.sqrt(part)) for name, part in found.items()}
    whole = np.sqrt(total + found["centre of mass"])
    return {**shares, "total": case.load_izz_kg_m2 * float(whole)}


def _beside(case: BenchCase) -> float:
    """Share of the object's Izz that a centre of mass beside the middle may hide (second order)."""
    mass = case.load_kg * case.mass_kg / (case.load_kg + case.mass_kg)
    reach = case.radius * case.radius_m
    ratio = case.izz_kg_m2 * case.radius**2 / (case.mass_kg * reach**2)
    hidden = mass * abs(1.0 - ratio) * np.sqrt(8.0) * case.com_std_m**2
    return float(hidden / case.load_izz_kg_m2)


@dataclass(frozen=True, slots=True)
class PlanRow:
    """One row of the plan: what is chosen, and the deviation with it, all else as the best has it.

    Attributes:
        what: one of `CHOICES`.
        value: of it.
        percent: the deviation of the object's Izz.
        best: whether this is the plan.
    """

    what: str
    value: float
    percent: float
    best: bool


def planned(case: BenchCase, fixed: tuple[str, ...] = ()) -> tuple[BenchCase, list[PlanRow]]:
    """The best swings among `CHOICES`, and what each other choice would cost.

    One choice after the other is made best until none changes: the deviation is monotonous or has
    one valley in each, so few rounds suffice.

    Args:
        case: the bench as it stands, and the start.
        fixed: choices that stay as they are.

    Returns:
        The case with the best choices, and the table.
    """
    free = {name: values for name, values in CHOICES.items() if name not in fixed}
    best = case
    for _ in range(10):
        before = best
        for name, values in free.items():
            tried = [
                replace(best, **{name: value}) for value in sorted({*values, getattr(best, name)})
            ]
            totals = [deviations(one)["total"] for one in tried]
            # The smallest that does: neither time nor wire for a fiftieth of a deviation.
            best = tried[int(np.argmax(np.array(totals) <= ENOUGH * min(totals)))]
        if best == before:
            break
    rows = []
    for name, values in CHOICES.items():
        mine = getattr(best, name)
        for value in sorted({*values, mine} if name in free else {mine}):
            total = deviations(replace(best, **{name: value}))["total"]
            percent = 100.0 * total / case.load_izz_kg_m2
            rows.append(PlanRow(name, float(value), percent, value == mine))
    return best, rows


def bench_case(
    robot: Robot,
    load_kg: float | None,
    load_izz: float | None,
    mass_kg: float | None = None,
) -> BenchCase:
    """The case of a robot file whose wires hang parallel.

    Args:
        robot: two or three parallel wires.
        load_kg: of the object; None: as heavy as the platform.
        load_izz: a guess of its inertia, kg m2; None: a small object's.
        mass_kg: of the platform; None: the robot file's.

    Raises:
        DataError: when the platform's mass is not given.
    """
    mass = mass_kg or robot.platform.mass_kg
    if mass is None:
        raise DataError("mass_kg of the platform is not given: weigh it with all that hangs on it")
    radius = spread_of(robot.attachments_m)
    length = float(np.mean(np.linalg.norm(robot.entries_m - robot.attachments_m, axis=1)))
    given = robot.platform.specific_inertia_m2
    izz = mass * (HOOP * radius**2 if given is None else float(given[2]))
    load = load_kg or mass
    return BenchCase(
        mass_kg=mass,
        izz_kg_m2=izz,
        load_kg=load,
        load_izz_kg_m2=load_izz or SMALL * load * radius**2,
        radius_m=radius,
        length_m=length,
        known_kg=0.5 * load,
    )
