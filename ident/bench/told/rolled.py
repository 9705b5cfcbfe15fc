"""A bench that hangs rolled: yaw then turns a body about the vertical, not about its own z.

Two wires leave a platform free to roll about the line of their lower ends, until its centre of mass
lies under that line. Rolled by a, yaw tells Izz cos^2 a + Iyy sin^2 a + 2 Iyz sin a cos a (x along
the line): what belongs to Izz no twist can tell.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freeswing.cdpr.model.statics import equilibrium_at_lengths
from freeswing.cdpr.robot import POSE_COORDINATES, Array
from freeswing.cdpr.rotation import matrix_from_angles
from freeswing.ident.bench.fit_rounds import Solved
from freeswing.ident.bench.objects import specific
from freeswing.ident.bench.runs import BenchRun
from freeswing.ident.bench.swing import IZZ, BenchSwing
from freeswing.ident.bench.told.budget import ACROSS, budget

ROLLED_RAD = 0.035  # at 2 degrees Izz is known to 0.16 %, level to 0.14 (docs/decisions/benches.md)


def rolled_sentences(solved: Solved, runs: Sequence[BenchRun]) -> list[str]:
    """For every load on two wires whose other moments are what its Izz hangs on most: what helps.

    Args:
        solved: the fit.
        runs: as fitted, in the order of the swings.
    """
    found = []
    scaled = any(run.coordinates for run in runs)
    for block in solved.solution.unknowns.names:
        name = block.removeprefix("load.")
        mine = [k for k, run in enumerate(runs) if [one.load for one in run.loads] == [name]]
        if name == block or not mine or solved.swings[0].model.robot.n_cables != 2:
            continue
        value = solved.solution.value(block)
        if not scaled:
            std = float(solved.solution.std(block)[IZZ])
            found.append(_unscaled_sentence(name, 100.0 * std / abs(float(value[IZZ]))))
            continue
        largest = budget(solved, block)[0]
        if largest.what in {ACROSS.format(name=one) for one in (name, "the platform")}:
            share = 100.0 * largest.std_kg_m2 / abs(float(value[IZZ]))
            posed = all(runs[k].coordinates == POSE_COORDINATES for k in mine)
            if all(runs[k].level_std_rad is not None for k in mine):
                continue
            if not posed or _rolled(solved, mine[0]) > ROLLED_RAD:
                found.append(_sentence(solved, name, mine[0], share, posed))
    return found


def _rolled(solved: Solved, index: int) -> float:
    return roll(solved.swings[index], solved.solution.unknowns.of_run(index))


def _sentence(solved: Solved, name: str, index: int, share: float, posed: bool) -> str:
    swing, values = solved.swings[index], solved.solution.unknowns.of_run(index)
    shift = level_shift(swing, values, values[f"load.{name}"][0])
    told = "the platform hangs rolled" if posed else "the platform may hang rolled (not measured)"
    if posed:
        told += f" by {np.degrees(_rolled(solved, index)):.1f} degrees with it"
    where = (
        f"move it by {1e3 * shift[0]:+.1f} mm along x and {1e3 * shift[1]:+.1f} mm along y, where "
        "all hangs level"
        if posed
        else "lay it so that a spirit level on the platform shows level, and say in these runs how "
        "well (level_std_rad)"
    )
    push = ", or give one run a push that rolls it by some degrees" if posed else ""
    return (
        f"{name}: {share:.2g} % of its Izz rests on other moments and products, which no run "
        f"tells: {told}, so that yaw turns it about another axis than its z. Lay it so that it "
        f"hangs level ({where}){push}"
    )


def _unscaled_sentence(name: str, percent: float) -> str:
    return (
        f"{name}: on two wires tracks of unknown scale leave open what roll would show (moments "
        f"and products beside Izz, how deep the centres of mass hang): its Izz is known to "
        f"{percent:.2g} %. Measure yaw itself (chi_rad, by a sensor or a tag) with all level, or "
        "hang it on three wires: either gives 1 % or better"
    )


def roll(swing: BenchSwing, values: dict[str, Array]) -> float:
    """How far the platform hangs from upright in a run, rad.

    Source:
        FIDIM 2022, sec. 3: equilibrium at given wire lengths.
    """
    inertia = specific(swing.total(values))
    rest = equilibrium_at_lengths(swing.model, swing.lengths(values), swing.rest, inertia)
    pose = swing.rest if rest is None else rest.zeta
    up = -swing.model.robot.gravity_m_s2 / np.linalg.norm(swing.model.robot.gravity_m_s2)
    return float(np.arccos(np.clip(matrix_from_angles(pose[3:])[:, 2] @ up, -1.0, 1.0)))


def level_shift(swing: BenchSwing, values: dict[str, Array], load_kg: float) -> Array:
    """By how much a load is to be moved, platform frame, until all hangs level, (2,), m.

    The common centre of mass comes to lie above or under the line of the wires' lower ends.

    Source:
        Featherstone 2008, Rigid Body Dynamics Algorithms, sec. 2.13: first moments add.
    """
    total, ends = swing.total(values), swing.model.robot.attachments_m[:, :2]
    off = total[1:3] / total[0] - ends.mean(axis=0)
    line = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    return np.asarray(-(off - line * (line @ off)) * total[0] / load_kg)
