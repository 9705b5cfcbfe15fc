"""The keys of session.toml that make a bench: channels, loads, and what a run carries."""

from __future__ import annotations

import math

import numpy as np

from freeswing.cdpr.files.documents import Reader
from freeswing.cdpr.files.unit_quaternions import wrong_recorded
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.cdpr.rotation import matrix_from_quaternion
from freeswing.ident.bench.channels import Channel
from freeswing.ident.bench.runs import KnownBody, Load, Placed


def read_channels(reader: Reader) -> tuple[Channel, ...]:
    """All `[[channels]]`; problems are added to the reader."""
    found = [_read_channel(table) for table in reader.children("channels", required=False)]
    channels = tuple(one for one in found if one is not None)
    _no_twins(reader, "channels", [one.name for one in channels])
    _no_twins(reader, "channels", [one.column for one in channels])
    return channels


def read_planar(reader: Reader) -> bool:
    """`planar`: whether one camera from above filmed the runs."""
    given = reader.raw("planar") if "planar" in reader else False
    if not isinstance(given, bool):
        reader.add("planar", "must be true or false")
    return given is True


def read_loads(reader: Reader) -> tuple[Load, ...]:
    """All `[[loads]]`; problems are added to the reader."""
    found = [_read_load(table) for table in reader.children("loads", required=False)]
    loads = tuple(one for one in found if one is not None)
    _no_twins(reader, "loads", [one.name for one in loads])
    return loads


def read_payloads(reader: Reader) -> tuple[KnownBody, ...]:
    """`payload` of a run: one table, or a list of them."""
    if "payload" not in reader:
        return ()
    if isinstance(reader.raw("payload"), list):
        tables = reader.children("payload")
    else:
        child = reader.child("payload")
        tables = () if child is None else (child,)
    found = [_read_payload(table) for table in tables]
    return tuple(one for one in found if one is not None)


def read_placed(reader: Reader) -> tuple[Placed, ...]:
    """`loads` of a run: names, or tables that place them."""
    if "loads" not in reader:
        return ()
    given = reader.raw("loads")
    if not isinstance(given, list):
        reader.add("loads", "must be a list of names or of tables with a name")
        return ()
    if all(isinstance(one, str) for one in given):
        placed = [Placed(str(name), np.eye(3), np.zeros(3)) for name in given]
    else:
        placed = [one for one in map(_read_place, reader.children("loads")) if one is not None]
    names = [one.load for one in placed]
    for name in dict.fromkeys(names):
        if names.count(name) > 1:
            reader.add("loads", f"{name!r} is there {names.count(name)} times")
    return tuple(placed)


def check_loads(
    reader: Reader, loads: tuple[Load, ...], runs: list[tuple[str, tuple[Placed, ...]]]
) -> None:
    """Runs name loads that there are; every load is carried by some run."""
    known = [load.name for load in loads]
    carried = set()
    for run, placed in runs:
        for one in placed:
            carried.add(one.load)
            if one.load not in known:
                there = ", ".join(known) or "none"
                reader.add("loads", f"run {run} carries {one.load!r}; [[loads]] has {there}")
    for name in known:
        if name not in carried:
            reader.add("loads", f"no run carries {name!r}; name it in a run's loads")


def _read_channel(reader: Reader) -> Channel | None:
    name, column = reader.string("name"), reader.string("column")
    coordinates = reader.strings("coordinates")
    order = reader.integer("order", minimum=1, maximum=3) if "order" in reader else 1
    gains = _read_numbers(reader, "gains")
    stds = _read_numbers(reader, "gains_std")
    per_run = reader.raw("per_run") if "per_run" in reader else False
    if not isinstance(per_run, bool):
        reader.add("per_run", "must be true or false")
    reader.finish()
    unknown = [one for one in coordinates if one not in POSE_COORDINATES]
    if unknown:
        allowed = " ".join(POSE_COORDINATES)
        reader.add("coordinates", f"{', '.join(unknown)} is no coordinate; there are {allowed}")
        return None
    try:
        return Channel(name, column, coordinates, order, gains, stds, bool(per_run))
    except ValueError as error:
        reader.add("channels", str(error))
        return None


def _read_numbers(reader: Reader, key: str) -> dict[str, float]:
    child = reader.child(key, required=False)
    if child is None:
        return {}
    found = {name: child.number(name) for name in POSE_COORDINATES if name in child}
    child.finish()
    return found


def _read_load(reader: Reader) -> Load | None:
    name, mass = reader.string("name"), reader.number("mass_kg", above=0.0)
    mass_std = reader.optional_number("mass_std_kg", above=0.0)
    com = reader.optional_vector("com_m", 3)
    std = None
    if "com_std_m" in reader:
        if isinstance(reader.raw("com_std_m"), list):
            std = reader.vector("com_std_m", 3)
        else:
            std = np.full(3, reader.number("com_std_m", above=0.0))
        if not (std > 0.0).all():
            reader.add("com_std_m", f"{std.tolist()} must be above 0")
    reader.finish()
    if not math.isfinite(mass) or (com is not None and not np.isfinite(com).all()):
        return None
    if std is not None and com is None:
        reader.add("com_std_m", "is given without com_m: say where the centre of mass should be")
    return Load(name, mass, mass_std, com, std)


def _read_payload(reader: Reader) -> KnownBody | None:
    mass = reader.number("mass_kg", above=0.0)
    position = reader.vector("position_m", 3)
    inertia = reader.optional_vector("inertia_kg_m2", 6)
    reader.finish()
    inertia = np.zeros(6) if inertia is None else inertia
    readable = math.isfinite(mass) and np.isfinite(position).all() and np.isfinite(inertia).all()
    return KnownBody(mass, position, inertia) if readable else None


def _read_place(reader: Reader) -> Placed | None:
    name = reader.string("name")
    q = reader.optional_vector("q_platform_load", 4)
    shift = reader.optional_vector("t_platform_load_m", 3)
    reader.finish()
    q = np.array([1.0, 0.0, 0.0, 0.0]) if q is None else q
    shift = np.zeros(3) if shift is None else shift
    if not (np.isfinite(q).all() and np.isfinite(shift).all()):
        return None
    length = float(np.linalg.norm(q))
    if wrong_recorded(np.array(length)):
        reader.add("q_platform_load", f"has length {length:.4g}, must be 1 (order w, x, y, z)")
        return None
    return Placed(name, matrix_from_quaternion(q / length), shift)


def _no_twins(reader: Reader, key: str, names: list[str]) -> None:
    for name in dict.fromkeys(names):
        if names.count(name) > 1:
            reader.add(key, f"{name!r} is there {names.count(name)} times")
