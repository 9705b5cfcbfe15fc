"""Benches of two or three wires with an object on them, as a user would have recorded them.

What the files do not say: drag, one wire 2 mm longer than told, a platform 5 % heavier than told.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.oracle.mechanics.equilibrium import settle
from tests.oracle.mechanics.newton_euler import Motion, simulate
from tests.oracle.mechanics.world import Array, Body, World, plain_world
from tests.oracle.recorded.session_files import write_samples
from tests.oracle.recorded.sessions import tait_bryan

GRAVITY = 9.80665
DECLARED_KG, HEAVIER = 1.2, 1.05
WIRE_M, LONGER_M = 1.2, 0.002
RADIUS_M = {3: 0.25, 2: 0.2}
DRAG_N_M_S, QUADRATIC = 6e-4, 0.02
PLATFORM_COM_M = np.array([0.003, -0.002, -0.05])
PLATFORM_KG_M2 = np.array([0.021, 0.024, 0.040])  # about its centre
LOAD_KG, LOAD_KG_M2 = 0.8, np.array([0.0062, 0.0071, 0.0093])
LOAD_COM_M = np.array([0.004, -0.006, 0.01])
WEIGHT_KG, WEIGHT_M = 0.4, np.array([0.12, 0.0, -0.02])
BOTH_SIDES_M = (WEIGHT_M, WEIGHT_M * [-1.0, 1.0, 1.0], WEIGHT_M * [0.0, 1.0, 1.0])  # and middle
_BESIDE_KG_M = DECLARED_KG * HEAVIER * PLATFORM_COM_M + LOAD_KG * LOAD_COM_M
LEVEL_M = np.array([0.0, -_BESIDE_KG_M[1] / LOAD_KG, 0.0])  # there two wires hang it level
RATE_HZ = 50.0
UNWANTED_M_S = 0.02  # sway of a twist by hand: a centimetre
STIFF_EA_N = 1e5  # stretches a wire by 0.05 mm


@dataclass(frozen=True, slots=True)
class Hidden:
    """What is true and not told, beside which loads lie how on the platform.

    Attributes:
        longer_m: the first wire over what is told.
        heavier: the platform over what is told.
        drag_n_m_s: against turning.
        quadratic: drag against moving, N s2/m2.
        tilt_rad: of the base frame about its x and y, (2,).
        stiffness_ea_n: of the wires, whose told lengths are unstretched; 0: rigid.
        eccentric_m: the first wire's lower end over what is told, platform frame, (3,).
        hold_n_m: a clamp or wires that hold yaw, N m a radian.
        beside_m: the platform's centre of mass over where it usually is, (3,).
        yields_n_m: what holds the first `yielding` hooks sideways, N/m; 0: they do not yield.
        yielding: how many hooks do.
        wider: twists by hand over the usual ones.
    """

    longer_m: float = LONGER_M
    heavier: float = HEAVIER
    drag_n_m_s: float = DRAG_N_M_S
    quadratic: float = QUADRATIC
    tilt_rad: tuple[float, float] = (0.0, 0.0)
    stiffness_ea_n: float = 0.0
    eccentric_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    hold_n_m: float = 0.0
    beside_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yields_n_m: float = 0.0
    yielding: int = 3
    wider: float = 1.0


USUAL = Hidden()
CLEAN = Hidden(0.0, 1.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class BenchTruth:
    """What really hung there: masses and tensors about each body's own centre, kg and kg m2."""

    folder: Path
    platform_kg: float
    platform_izz_p: float
    load_izz: float
    load_com_m: Array


def make_bench(
    folder: Path,
    seed: int,
    wires: int = 3,
    seen: str = "poses",
    duration_s: float = 10.0,
    counts: tuple[int, int, int] = (3, 3, 4),
    hidden: Hidden = USUAL,
    weights_m: Sequence[Array] = (WEIGHT_M,),
    places_m: Sequence[Array] = (np.zeros(3),),
    rolled_rad_s: float = 0.0,
) -> BenchTruth:
    """Write a bench session.

    Args:
        folder: made when not there.
        seed: of noise and releases.
        wires: 2 or 3.
        seen: `poses`, `plane` (x, y, chi), `angles`, `chi`, or `track`: one curved track of a
            laser dot.
        duration_s: of each run.
        counts: tare, known-weight and loaded runs.
        hidden: what the files do not say.
        weights_m: where the known mass is put, one run after the other.
        places_m: where the object's frame is put, likewise.
        rolled_rad_s: by how fast a push rolls the platform beside the twist, at most.
    """
    rng = np.random.default_rng(seed)
    (folder / "runs").mkdir(parents=True, exist_ok=True)
    ends = _ends(wires)
    kinds = ["tare"] * counts[0] + ["weight"] * counts[1] + ["loaded"] * counts[2]
    lines = [
        'format = "freeswing-session/1"',
        f'name = "bench-{wires}-{seen}"',
        'robot = "robot.toml"',
        f"frame_rate_hz = {RATE_HZ}",
    ]
    if seen == "track":
        lines += ["", "[[channels]]", 'name = "dot"', 'column = "dot_px"']
        lines += ['coordinates = ["chi", "x", "y"]', "order = 3"]
    lines += ["", "[[loads]]", 'name = "object"', f"mass_kg = {LOAD_KG}", "mass_std_kg = 0.0005"]
    told = LOAD_COM_M + rng.normal(0.0, 0.001, 3)
    lines += [f"com_m = {told.tolist()}", "com_std_m = 0.001"]
    for k, kind in enumerate(kinds):
        weight_m = weights_m[(k - counts[0]) % len(weights_m)]
        place_m = places_m[(k - counts[0] - counts[1]) % len(places_m)]
        world = _world(wires, kind, weight_m, hidden, place_m)
        name = f"{kind}-{k + 1:02d}"
        motion = _swing(world, rng, duration_s, RATE_HZ, rolled_rad_s, hidden.wider)
        _record(folder / "runs" / f"{name}.csv", motion, rng, seen)
        lines += ["", "[[runs]]", f'name = "{name}"', 'role = "identify"']
        lines += [f"cable_lengths_m = {[WIRE_M] * wires}", "cable_lengths_std_m = 0.001"]
        lines += [f'trajectory = "runs/{name}.csv"']
        if kind == "weight":
            lines.append(f"payload = {{ mass_kg = {WEIGHT_KG}, position_m = {weight_m.tolist()} }}")
        if kind == "loaded":
            lines.append(
                f'loads = [{{ name = "object", t_platform_load_m = {place_m.tolist()} }}]'
                if place_m.any()
                else 'loads = ["object"]'
            )
    (folder / "session.toml").write_text("\n".join([*lines, ""]))
    _write_robot(folder / "robot.toml", wires, ends)
    mass = DECLARED_KG * hidden.heavier
    com_m = PLATFORM_COM_M + hidden.beside_m
    izz = PLATFORM_KG_M2[2] + mass * float(np.sum(com_m[:2] ** 2))
    truth = BenchTruth(folder, mass, izz, float(LOAD_KG_M2[2]), LOAD_COM_M)
    (folder / "truth").mkdir(exist_ok=True)
    numbers = {
        "platform_kg": mass,
        "platform_Izz_P_kg_m2": izz,
        "object_Izz_kg_m2": truth.load_izz,
        "object_com_m": LOAD_COM_M.tolist(),
    }
    (folder / "truth" / "truth.json").write_text(json.dumps(numbers, indent=1) + "\n")
    return truth


def _ends(wires: int) -> Array:
    angles = 2.0 * np.pi * np.arange(wires) / wires
    return RADIUS_M[wires] * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)


def _write_robot(path: Path, wires: int, ends: Array) -> None:
    free = ["x", "y", "chi"] if wires == 3 else ["x", "y", "phi", "chi"]
    lines = ['format = "freeswing-robot/1"', f'name = "bench-{wires}"']
    lines += [f"gravity_m_s2 = [0.0, 0.0, {-GRAVITY}]", f"free_coordinates = {json.dumps(free)}"]
    lines += ["", "[platform]", f"mass_kg = {DECLARED_KG}"]
    for k, end in enumerate(ends):
        lines += ["", "[[cables]]", f'name = "{k + 1}"', "pulley_radius_m = 0.0"]
        lines += [f"entry_m = {[*end[:2].tolist(), WIRE_M]}", f"attachment_m = {end.tolist()}"]
    path.write_text("\n".join([*lines, ""]))


def _moment(mass: float, com: Array, principal: Array) -> tuple[float, Array, Array]:
    spread = com @ com * np.eye(3) - np.outer(com, com)
    return mass, mass * com, np.diag(principal) + mass * spread


def _world(
    wires: int, kind: str, weight_m: Array, hidden: Hidden, place_m: Array | None = None
) -> World:
    from freeswing.cdpr.robot import Cable, Robot

    ends = _ends(wires)
    cables = tuple(
        Cable(str(k), end + np.array([0.0, 0.0, WIRE_M]), 0.0, end) for k, end in enumerate(ends)
    )
    robot = Robot("bench", cables, np.array([0.0, 0.0, -GRAVITY]))
    com_m = PLATFORM_COM_M + hidden.beside_m
    parts = [_moment(DECLARED_KG * hidden.heavier, com_m, PLATFORM_KG_M2)]
    if kind == "weight":
        parts.append(_moment(WEIGHT_KG, weight_m, np.zeros(3)))
    if kind == "loaded":
        shift_m = np.zeros(3) if place_m is None else place_m
        parts.append(_moment(LOAD_KG, LOAD_COM_M + shift_m, LOAD_KG_M2))
    mass = sum(part[0] for part in parts)
    first = np.sum([part[1] for part in parts], axis=0)
    second = np.sum([part[2] for part in parts], axis=0)
    entries = (second / mass)[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    lengths = np.full(wires, WIRE_M)
    lengths[0] += hidden.longer_m
    world = plain_world(robot, Body(mass, first / mass, entries), lengths)
    clamped = world.attach.copy()
    clamped[0] += hidden.eccentric_m
    ahead, aside = hidden.tilt_rad
    down = np.array([-np.sin(aside), np.sin(ahead), -np.cos(np.hypot(ahead, aside))])
    hooks = np.where(np.arange(wires) < hidden.yielding, hidden.yields_n_m, 0.0)
    stiff = STIFF_EA_N if hidden.yields_n_m > 0.0 else 0.0  # hooks yield to elastic wires alone
    return world._replace(
        hook=hooks,
        attach=clamped,
        drag_angular=hidden.drag_n_m_s,
        drag_quadratic=hidden.quadratic,
        gravity=GRAVITY * down,
        stiffness_ea=hidden.stiffness_ea_n or stiff,
        torsion=hidden.hold_n_m,
        relaxation=1e-3,
    )


def bench_swing(
    wires: int, kind: str, rng: np.random.Generator, span_s: float, rate_hz: float = RATE_HZ
) -> Motion:
    """One swing of a bench, twisted by hand: `kind` is tare, weight or loaded."""
    return _swing(_world(wires, kind, WEIGHT_M, USUAL), rng, span_s, rate_hz)


def _swing(
    world: World,
    rng: np.random.Generator,
    span_s: float,
    rate_hz: float,
    rolled_rad_s: float = 0.0,
    wider: float = 1.0,
    swayed_m_s: float = UNWANTED_M_S,
) -> Motion:
    rest = settle(world, np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    twist = np.zeros(6)
    # A twist by hand: about 8 degrees of yaw, and a centimetre of sway that nobody wanted.
    twist[5] = wider * rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 0.7)
    twist[:2] = rng.normal(0.0, swayed_m_s, 2)
    if rolled_rad_s > 0.0:
        twist[3] = rng.choice([-1.0, 1.0]) * rolled_rad_s
    start = rest.position_m, rest.quaternion, span_s, _allowed(rest, twist)
    return simulate(world, *start, rate_hz)


def _record(path: Path, motion: Motion, rng: np.random.Generator, seen: str) -> None:
    angles = tait_bryan(motion.quaternions)
    chi = angles[:, 2]
    times = motion.times_s[:, None]
    if seen == "poses":
        turned = angles + rng.normal(0.0, 5e-4, angles.shape)
        place = motion.positions_m + rng.normal(0.0, 1e-4, motion.positions_m.shape)
        columns = np.hstack([times, place, turned])
        header = ("x_m", "y_m", "z_m", "phi_rad", "theta_rad", "chi_rad")
        write_samples(path, header, columns)
    elif seen == "plane":
        turned = chi + rng.normal(0.0, 5e-4, len(chi))
        place = motion.positions_m[:, :2] + rng.normal(0.0, 1e-4, (len(chi), 2))
        columns = np.hstack([times, place, turned[:, None]])
        write_samples(path, ("x_m", "y_m", "chi_rad"), columns)
    elif seen == "angles":
        turned = angles + rng.normal(0.0, 5e-4, angles.shape)
        write_samples(path, ("phi_rad", "theta_rad", "chi_rad"), np.hstack([times, turned]))
    elif seen == "chi":
        noisy = chi + rng.normal(0.0, 5e-4, len(chi))
        write_samples(path, ("chi_rad",), np.hstack([times, noisy[:, None]]))
    else:
        wall = 1100.0 * np.tan(2.0 * chi + 0.3)
        dot = wall + 900.0 * motion.positions_m[:, 0] + 150.0 * motion.positions_m[:, 1]
        noise = rng.normal(0.0, 0.4, len(chi)) + _slow(rng, len(chi), 0.3)
        write_samples(path, ("dot_px",), np.hstack([times, (400.0 + dot + noise)[:, None]]))


def _slow(rng: np.random.Generator, count: int, size: float) -> Array:
    """Noise that is correlated over ten samples."""
    found = np.zeros(count)
    for k in range(1, count):
        found[k] = 0.9 * found[k - 1] + rng.normal(0.0, size * np.sqrt(1.0 - 0.81))
    return found


def _allowed(rest: object, twist: Array) -> Array:
    """The part of a twist that the wires allow at rest."""
    scale = np.array([1.0, 1.0, 1.0, 0.25, 0.25, 0.25])
    freedom = rest.freedom  # type: ignore[attr-defined]
    return np.asarray(freedom @ (freedom.T @ (scale * twist)) / scale)
