"""The identified body: about its own centre of mass, along its own axes, and drawn as it hangs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from freeswing.cdpr.robot import INERTIA_NAMES, Array, Robot
from freeswing.cdpr.rotation import matrix_from_angles
from freeswing.report.figures import AFTER, BEFORE, FAINT, INK, Draw, figures
from freeswing.report.words import HALF_WIDTH_95, number
from freeswing.results.common import Parameter
from freeswing.results.identification import SwingPlace

ENTRIES = (("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2))


@dataclass(frozen=True, slots=True)
class BodyAboutCom:
    """Inertia over mass about the centre of mass.

    Attributes:
        com_m: from P, platform frame, (3,).
        tensor_m2: platform axes, (3, 3).
        tensor_std_m2: no larger than this whatever the correlations are, (3, 3).
        principal_m2: ascending, (3,).
        axes: unit vectors of the principal axes as columns, platform frame, (3, 3).
    """

    com_m: Array
    tensor_m2: Array
    tensor_std_m2: Array
    principal_m2: Array
    axes: Array


def body_about_com(parameters: Sequence[Parameter]) -> BodyAboutCom | None:
    """From the nine parameters about P by Huygens-Steiner; None where one is missing.

    The standard deviations are sums of each term's own, which bounds those of the sum.
    """
    values = {one.name: one.value for one in parameters}
    stds = {one.name: one.std for one in parameters}
    numbers = [values.get(name) for name in INERTIA_NAMES]
    if any(value is None for value in numbers):
        return None
    inertia = np.array(numbers, dtype=np.float64)
    std = np.array([stds.get(name) or np.nan for name in INERTIA_NAMES], dtype=np.float64)
    com = inertia[:3]
    tensor = _symmetric(inertia[3:]) - (com @ com * np.eye(3) - np.outer(com, com))
    across = np.abs(com)
    crossed = np.outer(across, std[:3])
    shift = crossed + crossed.T
    np.fill_diagonal(shift, 2.0 * (across @ std[:3] - across * std[:3]))
    principal, axes = np.linalg.eigh(tensor)
    axes = axes * np.where(axes[np.abs(axes).argmax(axis=0), range(3)] < 0.0, -1.0, 1.0)
    return BodyAboutCom(com, tensor, _symmetric(std[3:]) + shift, principal, axes)


def is_told(body: BodyAboutCom) -> bool:
    """Whether every moment is known to better than itself: axes of others are chance's.

    Two or three parallel wires tell Izz, and of the other moments next to nothing.
    """
    half = HALF_WIDTH_95 * np.diag(body.tensor_std_m2)
    return bool(np.all(half < np.diag(body.tensor_m2)) or np.isnan(half).any())


def tensor_rows(body: BodyAboutCom, mass_kg: float | None) -> list[dict[str, str]]:
    """The six entries of the tensor, over the mass and, where it is known, in kg m2."""
    rows = []
    for name, i, k in ENTRIES:
        half = HALF_WIDTH_95 * body.tensor_std_m2[i, k]
        row = {
            "entry": f"I{name}",
            "over mass (10⁻³ m²)": number(1e3 * body.tensor_m2[i, k], 5),
            "± at most, 95 % (10⁻³ m²)": number(1e3 * half, 2),
        }
        if mass_kg:
            row["in kg m²"] = number(mass_kg * body.tensor_m2[i, k], 5)
        rows.append(row)
    return rows


def principal_rows(body: BodyAboutCom, mass_kg: float | None) -> list[dict[str, str]]:
    """The principal moments about the centre of mass, the smallest first."""
    rows = []
    for k, moment in enumerate(body.principal_m2):
        row = {
            "axis": str(k + 1),
            "over mass (10⁻³ m²)": number(1e3 * moment, 5),
            "radius of gyration (mm)": number(1e3 * np.sqrt(max(float(moment), 0.0)), 4),
            "direction (x, y, z of the platform)": ", ".join(
                f"{value:+.3f}" for value in body.axes[:, k]
            ),
        }
        if mass_kg:
            row["in kg m²"] = number(mass_kg * float(moment), 5)
        rows.append(row)
    return rows


def hanging(
    body: BodyAboutCom, robot: Robot | None, swings: Sequence[SwingPlace], entries: Array
) -> Markup:
    """The body's ellipsoid where a run hung, with its cables: from the side and from above."""
    placed = [one for one in swings if one.equilibrium is not None]
    if not placed or not _is_possible(body) or not is_told(body):
        return Markup()
    pose = placed[0].equilibrium
    place = np.array(pose.position_m, dtype=np.float64) if pose else np.zeros(3)
    turn = matrix_from_angles(np.array(pose.angles_rad, dtype=np.float64)) if pose else np.eye(3)
    spread = turn @ _ellipsoid(body) @ turn.T
    com = place + turn @ body.com_m
    ends = np.zeros((0, 3)) if robot is None else place + robot.attachments_m @ turn.T
    drawn = {"com": com, "P": place, "spread": spread, "ends": ends, "entries": entries}
    caption = (
        f"The body as it hung in {placed[0].run}: the ellipsoid of even density that has its "
        "inertia, its centre of mass (cross), P (ring) and the cables to their pulleys (triangles)."
    )
    views = (((0, 2), ("x (m)", "z (m)"), "side"), ((0, 1), ("x (m)", "y (m)"), "from above"))
    return figures([_view(drawn, *view) for view in views], 3.0, caption)


def _view(
    drawn: Mapping[str, Array], columns: tuple[int, int], labels: tuple[str, str], title: str
) -> Draw:
    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        pick = list(columns)
        angle = np.linspace(0.0, 2.0 * np.pi, 90)
        root = np.linalg.cholesky(drawn["spread"][np.ix_(pick, pick)])
        outline = drawn["com"][pick] + np.stack([np.cos(angle), np.sin(angle)], axis=1) @ root.T
        axes.fill(*outline.T, facecolor="none", edgecolor=AFTER, hatch="////", lw=1.4)
        entries, ends = drawn["entries"], drawn["ends"]
        for k, entry in enumerate(entries if len(ends) == len(entries) else ()):
            line = np.stack([entry[pick], ends[k][pick]])
            axes.plot(*line.T, color=FAINT, lw=1.0)
        if len(entries):
            axes.plot(*entries[:, pick].T, "^", color=INK, ms=5)
        axes.plot(*drawn["com"][pick], "+", color=BEFORE, ms=11, mew=2)
        axes.plot(*drawn["P"][pick], "o", color=INK, ms=6, fillstyle="none")
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_xlabel(labels[0])
        axes.set_ylabel(labels[1])
        axes.set_title(title, fontsize=9, loc="left")

    return draw


def _ellipsoid(body: BodyAboutCom) -> Array:
    """Squared half axes of the homogeneous ellipsoid of this inertia, as a matrix, (3, 3)."""
    moments = 0.5 * np.trace(body.tensor_m2) * np.eye(3) - body.tensor_m2
    return 5.0 * moments


def _is_possible(body: BodyAboutCom) -> bool:
    return bool(np.linalg.eigvalsh(_ellipsoid(body))[0] > 0.0)


def _symmetric(entries: Array) -> Array:
    xx, yy, zz, xy, xz, yz = entries
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
