"""What no run tells is held where it was believed, and its spread is counted (Schmidt 1966).

An unseen number that is fitted all the same follows whatever the model lacks: a centre of mass that
only an uncalibrated signal could show ran 100 mm off to please a sway that the wires contradict.
Held, it does no harm; how far it may be off enters every deviation through how the others answer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from freeswing.cdpr.robot import Array
from freeswing.ident.bench.channels import Channel
from freeswing.ident.bench.objects import entries
from freeswing.ident.bench.runs import Bench, BenchRun
from freeswing.ident.bench.swing import IZZ, BenchSwing
from freeswing.ident.likelihood.fit import Solution, fit
from freeswing.ident.likelihood.fit_blocks import Dense
from freeswing.ident.likelihood.unknowns import Mask, Unknowns

ALL_BUT_IZZ = ~np.isin(np.arange(10), (0, IZZ))  # of a body's ten numbers
SAME_AXIS = 1e-9  # of a direction's square: rounding
SWAY = {"x", "y"}
Held = Mapping[str, Mask]


def sees_sway(bench: Bench, runs: Sequence[BenchRun]) -> bool:
    """Whether a column shows sway, calibrated or not: x, y, or a channel that answers to them."""
    channels = [c for c in bench.channels if SWAY & set(c.coordinates)]
    names = SWAY | {channel.column for channel in channels}
    return any(signal.column in names for run in runs for signal in run.signals)


def unseen(bench: Bench, runs: Sequence[BenchRun], unknowns: Unknowns) -> dict[str, Mask]:
    """Which numbers of which blocks no run of a bench tells, by block.

    Without x or y in any run: centres of mass, and of every tensor what does not turn about the
    vertical. Fitted, an object's Iyy went to -0.02 kg m2, where 0.007 were true.
    """
    found = {}
    measured = {name for run in runs for name in run.coordinates}
    if not SWAY & measured:
        found["platform"] = ALL_BUT_IZZ
        found |= {f"load.{load.name}": ~_shown_by_yaw(load.name, runs) for load in bench.loads}
    return {
        name: mask & unknowns.block(name).mask for name, mask in found.items() if name in unknowns
    }


def _shown_by_yaw(load: str, runs: Sequence[BenchRun]) -> Mask:
    """Which of a load's numbers turn about the platform's z as it lay in some run, (10,)."""
    shown = np.arange(10) == 0
    for run in runs:
        for one in run.loads:
            if one.load == load:
                along = one.turn[2]  # the platform's z in the load's frame
                shown[4:] |= np.abs(entries(np.outer(along, along))) > SAME_AXIS
    return shown


def named_sway(bench: Bench, runs: Sequence[BenchRun], place: int) -> tuple[int, ...]:
    """Coordinates of a channel, by its place, whose gains only name sway's directions and scale.

    Where no run measures x or y, any linear change of all sway changes nothing that is seen but the
    two first channels' gains for it.
    """
    if place > 1 or any(SWAY & set(run.coordinates) for run in runs):
        return ()
    return tuple(k for k, one in enumerate(bench.channels[place].coordinates) if one in SWAY)


def reference(bench: Bench, runs: Sequence[BenchRun]) -> Channel | None:
    """The channel whose gain names the scale of yaw, where no run measures a coordinate.

    One of a given gain, else the first; None where motion has a scale, or gains change by run.
    """
    if any(run.coordinates for run in runs):
        return None
    shared = [one for one in bench.channels if not one.per_run]
    given = [one for one in shared if one.main_coordinate in one.gains]
    return (given or [*shared, None])[0]


def gauge(bench: Bench, runs: Sequence[BenchRun], unknowns: Unknowns) -> dict[str, Mask]:
    """Gains that only name the scale of yaw, and sway's, by block: held, at no cost."""
    found = {}
    for place, channel in enumerate(bench.channels):
        name = f"channel.{channel.name}"
        if name in unknowns and not channel.per_run:
            named = list(named_sway(bench, runs, place))
            if channel is reference(bench, runs):
                named.append(channel.coordinates.index(channel.main_coordinate))
            mask = np.isin(np.arange(len(channel.terms)), named)
            found[name] = mask & unknowns.block(name).mask
    return found


def holding(unknowns: Unknowns, held: Held) -> Unknowns:
    """The unknowns with some numbers held where they start: at what is believed of them."""
    blocks = []
    for block in unknowns.blocks:
        mask = held.get(block.name)
        if mask is not None:
            block = replace(block, estimated=block.mask & ~mask)
        blocks.append(block)
    return Unknowns(tuple(blocks))


def considered(swings: Sequence[BenchSwing], found: Solution, held: Held) -> Solution:
    """A fit with the covariance that it has when the held numbers spread as believed.

    The fit's own estimates answer to a held number c by S = cov(., c) / cov(c, c), of the joint
    covariance; they spread by what is left with c known, and by S times what is believed of c.

    Args:
        swings: as they were fitted.
        found: the fit, with some numbers held.
        held: which, by block; each has a prior, whose deviation is what is believed.

    Source:
        Schmidt, Application of state-space methods to navigation problems, 1966; Tapley, Schutz,
        Born, Statistical Orbit Determination, 2004, eq. 6.5.22.
    """
    freed, picked, spread = found.unknowns, [], []
    for name, mask in held.items():
        block = freed.block(name)
        if mask.any() and block.prior is not None:
            freed = freed.estimating(name, mask)
            picked.append(freed.columns(name)[mask])
            spread.append(block.prior.std[mask])
    if not picked:
        return found
    joint = fit(swings, freed, Dense(steps=0)).covariance
    told = believed(joint, np.concatenate(picked), np.concatenate(spread))
    return replace(found, covariance=told)


def believed(joint: Array, at: Array, spread: Array) -> Array:
    """A joint covariance turned into that of a fit that holds the unknowns `at` to their spread.

    Source:
        Tapley, Schutz, Born 2004, Statistical Orbit Determination, eq. 6.5.22.
    """
    inner = joint[np.ix_(at, at)]
    answer = np.linalg.solve(inner, joint[at]).T
    left = joint - answer @ inner @ answer.T
    return np.asarray(left + (answer * spread**2) @ answer.T)
