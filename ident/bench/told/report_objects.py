"""Bodies of a bench fit as they are reported: what the runs say, and what rests on the prior."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from freeswing.cdpr.robot import BODY_NAMES, INERTIA_NAMES, Array
from freeswing.ident.bench.channels import Channel
from freeswing.ident.bench.fit_rounds import Solved
from freeswing.ident.bench.modal import SQUARE
from freeswing.ident.bench.objects import moments, moments_slope, specific, specific_slope
from freeswing.ident.bench.runs import Bench, BenchRun
from freeswing.ident.bench.swing import IZZ
from freeswing.ident.bench.told.budget import bent_std

HALF_WIDTH_95 = 1.959964  # deviations: a value that is zero within them is not essential
TELLS_NOTHING = 1.0  # deviation of the squared amplitude over itself: it may as well be zero
RESTS_ON_PRIOR = 0.5  # of the prior's variance: with more left than that, more was known than seen


@dataclass(frozen=True, slots=True)
class Told:
    """One number of a body: value and deviation, None where nothing is known of it."""

    name: str
    value: float | None
    std: float | None
    identifiable: bool

    def document(self) -> dict[str, Any]:
        """The entry of `parameters`."""
        return {
            "name": self.name,
            "value": self.value,
            "std": self.std,
            "identifiable": self.identifiable,
        }


def told_object(solved: Solved, block: str, given: Array, one_way: bool) -> list[Told]:
    """A body's parameters.

    Args:
        solved: the fit.
        block: the body's unknowns.
        given: which of its ten numbers the user gave himself, (10,).
        one_way: whether it always lay with its frame on the platform's: then Izz about P exists.
    """
    found, unknown = solved.solution, solved.first.block(block)
    value, covariance = found.value(block), found.covariance_of(block)
    prior = np.full(10, np.inf) if unknown.prior is None else np.array(unknown.prior.std)
    prior = np.where(unknown.mask, prior, 0.0)
    hidden = bent_std(solved, block)
    variances = np.diag(covariance) + _of_second_order(value, covariance)
    variances[IZZ] += hidden**2
    rows = []
    for k, name in enumerate(BODY_NAMES):
        seen = k == 0 or np.diag(covariance)[k] < RESTS_ON_PRIOR * prior[k] ** 2
        std = float(np.sqrt(variances[k]))
        if seen:
            rows.append(Told(name, float(value[k]), std, True))
        elif given[k]:
            mean = float(unknown.value[k] if unknown.prior is None else unknown.prior.mean[k])
            rows.append(Told(name, mean, float(prior[k]), False))
        else:
            rows.append(Told(name, None, None, False))
    if one_way:
        slope = moments_slope(value)[IZZ]
        std = float(np.sqrt(slope @ covariance @ slope + hidden**2))
        before = float(np.sqrt(np.sum((slope * prior) ** 2)))
        seen = std**2 < RESTS_ON_PRIOR * before**2
        izz = float(moments(value)[IZZ])
        rows.append(Told("Izz_P_kg_m2", izz if seen else None, std if seen else None, seen))
    return rows


def _of_second_order(body: Array, covariance: Array) -> Array:
    """What an uncertain centre adds to the central tensor's variances beyond first order, (10,).

    Izz about the centre is that about P less m (cx^2 + cy^2): the square of a normal deviation s
    has variance 2 s^4, which a slope at zero does not see.
    """
    spread = np.diag(covariance)[1:4]
    pairs = ((1, 2), (0, 2), (0, 1))
    found = np.zeros(10)
    found[4:7] = [body[0] ** 2 * 2.0 * float(np.sum(spread[list(p)] ** 2)) for p in pairs]
    return found


def platform_rows(solved: Solved) -> list[dict[str, Any]]:
    """The nine specific numbers of the platform, null where only a prior holds them; its mass."""
    found, body = solved.solution, solved.solution.value("platform")
    slope = specific_slope(moments(body)) @ moments_slope(body)
    covariance = slope @ found.covariance_of("platform") @ slope.T
    block = solved.first.block("platform")
    spread = np.zeros(10) if block.prior is None else np.array(block.prior.std)
    spread = np.where(block.mask, spread, 0.0)
    before = np.sum((slope * spread) ** 2, axis=1)
    values, variances = specific(moments(body)), np.array(np.diag(covariance))
    izz = INERTIA_NAMES.index("Izz_m2")
    variances[izz] += (bent_std(solved, "platform") / body[0]) ** 2
    rows = []
    for k, name in enumerate(INERTIA_NAMES):
        seen = bool(variances[k] < RESTS_ON_PRIOR * before[k])
        std = float(np.sqrt(variances[k]))
        rows.append(
            {
                "name": name,
                "value": float(values[k]) if seen else None,
                "std": std if seen else None,
                "std_percent": 100.0 * std / abs(float(values[k])) if seen else None,
                "essential": seen and HALF_WIDTH_95 * std < abs(float(values[k])),
                "identifiable": seen,
            }
        )
    if solved.mass is not None:
        std = float(found.std("platform")[0])
        rows.append(
            {
                "name": "mass_kg",
                "value": float(body[0]),
                "std": std,
                "std_percent": 100.0 * std / float(body[0]),
                "essential": True,
                "identifiable": True,
            }
        )
    return rows


def objects_document(solved: Solved, bench: Bench, runs: tuple[BenchRun, ...]) -> list[dict]:
    """The entry `objects` of results/identification.json."""
    robot = solved.swings[0].model.robot
    given = np.zeros(10, dtype=bool)
    given[1:4] = robot.platform.com_m is not None
    given[4:] = robot.platform.specific_inertia_m2 is not None
    platform = told_object(solved, "platform", given, one_way=True)
    found = [{"name": "platform", "parameters": [row.document() for row in platform]}]
    for load in bench.loads:
        mine = [run for run in runs if any(one.load == load.name for one in run.loads)]
        placed = [one for run in mine for one in run.loads if one.load == load.name]
        one_way = all(
            np.array_equal(one.turn, np.eye(3)) and not one.shift_m.any() for one in placed
        )
        given = np.zeros(10, dtype=bool)
        given[0], given[1:4] = True, load.com_std_m is not None
        rows = told_object(solved, f"load.{load.name}", given, one_way)
        found.append(
            {
                "name": load.name,
                "runs": [run.name for run in mine],
                "parameters": [row.document() for row in rows],
            }
        )
    return found


def _told(number: float) -> float | None:
    return float(number) if np.isfinite(number) else None


def _in_true_scale(
    solved: Solved, channel: Channel, value: Array, std: Array
) -> tuple[Array, Array]:
    """Gains of the amplitudes that the period tells, not of those assumed; NaN: it tells none.

    A term of degree d in yaw goes with the true scale to the power -d.
    """
    square = float(solved.solution.value(SQUARE)[0])
    share = float(solved.solution.std(SQUARE)[0]) / square
    place = channel.coordinates.index(channel.main_coordinate)
    degrees = np.array([term.count(place) for term in channel.terms])
    if share > TELLS_NOTHING and degrees.any():
        nothing = np.where(degrees > 0, np.nan, 1.0)
        return value * nothing, std * nothing
    factor = square ** (-0.5 * degrees)
    return value * factor, np.hypot(std, 0.5 * degrees * share * np.abs(value)) * factor


def channels_document(solved: Solved, bench: Bench) -> list[dict[str, Any]]:
    """The entry `channels`: linear gains with their deviations, noise in the column's unit."""
    found = []
    for channel in bench.channels:
        name = f"channel.{channel.name}"
        if name not in solved.solution.unknowns or channel.per_run:
            continue
        value, std = solved.solution.value(name), solved.solution.std(name)
        noise = [
            float(np.median(column.std)) * column.factor
            for swing in solved.swings
            for column in swing.columns
            if column.channel == channel
        ]
        if SQUARE in solved.solution.unknowns:
            value, std = _in_true_scale(solved, channel, value, std)
        gains = [
            {"name": term, "value": _told(value[k]), "std": _told(std[k])}
            for k, term in enumerate(channel.term_names)
        ]
        found.append({"name": channel.name, "gains": gains, "noise": float(np.median(noise))})
    return found
