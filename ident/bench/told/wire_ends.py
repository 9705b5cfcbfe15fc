"""What is stated of where wires are hung up and clamped, counted in every deviation of a bench.

The ends stay where they are declared (Schmidt 1966): radii, masses and lengths look alike to a
bench's runs, and fitted they would follow whatever the model lacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.robot import Robot
from freeswing.ident.bench.diagnose.causes import Cause, dressed
from freeswing.ident.bench.fit_rounds import Solved
from freeswing.ident.bench.modal import ModalSwing
from freeswing.ident.likelihood.cable_ends import GeometryPriors
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_blocks import Dense
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown

UNSCALED = (
    "how well the wires' ends are known (--entry-std-m, --attachment-std-m, [tolerances]) is not "
    "counted: no run measures a coordinate of the pose, and signals of unknown scale are fitted as "
    "small oscillations about the declared ends. Izz goes with R_top R_bottom: add its share, or "
    "record one run with yaw"
)


def with_ends_counted(
    solved: Solved, robot: Robot, ends: GeometryPriors, causes: Sequence[Cause] = ()
) -> Solved:
    """A bench fit whose covariance holds what the wires' ends may be off by.

    Args:
        solved: the fit.
        robot: as declared.
        ends: how well they are known; nothing is done where nothing is said.
        causes: what else its model has.

    Source:
        Schmidt, Application of state-space methods to navigation problems, 1966; Tapley, Schutz,
        Born, Statistical Orbit Determination, 2004, eq. 6.5.22.
    """
    found, swings = solved.solution, solved.swings
    mine = [
        (cause, std)
        for name, std in ends.stds.items()
        for cause in _each_end(robot, name)
        if cause.block not in found.unknowns
    ]
    if not mine or any(isinstance(swing, ModalSwing) for swing in swings):
        return solved
    masses = [swing.total(found.unknowns.of_run(k))[0] for k, swing in enumerate(swings)]
    shares = np.array(masses) / found.value("platform")[0]
    moved = dressed(swings, [*causes, *(cause for cause, _ in mine)], shares)
    blocks = [_block(cause, std) for cause, std in mine]
    joint = fit(moved, found.unknowns.joined(*blocks), Dense(steps=0))
    at = np.concatenate([joint.unknowns.columns(block.name) for block in blocks])
    answer = np.linalg.solve(joint.covariance[np.ix_(at, at)], joint.covariance[at]).T
    spread = np.concatenate([np.full(3, std) for _, std in mine])
    covariance = (answer * spread**2) @ answer.T
    size = len(found.covariance)
    covariance[:size, :size] += found.covariance
    held = replace(joint.unknowns, blocks=tuple(_held(b, blocks) for b in joint.unknowns.blocks))
    return replace(solved, solution=replace(found, unknowns=held, covariance=covariance))


def _each_end(robot: Robot, name: str) -> list[Cause]:
    """Every cable's end by itself, in three directions."""
    own = effect_named(name).parameters(robot)
    eye, found = np.eye(len(own)), []
    for cable in robot.cables:
        places = [k for k, one in enumerate(own) if one.part == cable.name]
        found.append(Cause(name, cable.name, tuple(own[k] for k in places), eye[:, places]))
    return found


def _block(cause: Cause, std: float) -> Unknown:
    spread = np.full(len(cause.parameters), std)
    prior = Gaussian(0.0 * spread, spread, "stated of the wires' ends")
    return Unknown(cause.block, 0.0 * spread, spread, prior)


def _held(block: Unknown, among: Sequence[Unknown]) -> Unknown:
    mine = block.name in {one.name for one in among}
    return replace(block, estimated=np.zeros(block.size, bool)) if mine else block
