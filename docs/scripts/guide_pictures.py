"""The pictures of docs/guide and the gallery: from the model, the printed sheet, the samples."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import guide_numbers as numbers
import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, Polygon, Rectangle

import freeswing as fs
from freeswing.cdpr.model.equations import build_model
from freeswing.report.figures import AFTER, BEFORE, FAINT, INK, figure_style
from freeswing.report.space import AZIMUTHS_RAD, projected
from freeswing.starter.filmed import Filmed, pages

SAMPLES = Path(__file__).resolve().parents[2] / "samples"
SHOWN = ("mocap-trc", "two-cables", "three-cables", "undeclared-drag")


def write_all(folder: Path) -> list[Path]:
    """All pictures, the gallery's beside the guide's."""
    drawn: dict[str, tuple[Callable[[Figure], None], tuple[float, float]]] = {
        "measuring": (measuring, (7.0, 3.6)),
        "cameras": (cameras, (7.0, 4.2)),
        "tags": (tags, (3.6, 3.6)),
        "pushing": (pushing, (7.0, 2.6)),
        **{f"sample-{name}": (sample(name), (3.6, 2.8)) for name in SHOWN},
        "sample-filmed": (filmed, (3.6, 2.8)),
    }
    return [_save(folder / f"{name}.svg", *one) for name, one in drawn.items()]


def _save(path: Path, draw: Callable[[Figure], None], size: tuple[float, float]) -> Path:
    style = {**figure_style(), "savefig.facecolor": "white", "svg.hashsalt": path.stem}
    with mpl.rc_context(style):
        sheet = Figure(figsize=size)
        draw(sheet)
        sheet.savefig(path, metadata={"Date": None})
    return path


def _bare(sheet: Figure) -> Axes:
    axes = sheet.add_axes((0.01, 0.01, 0.98, 0.98))
    axes.set_aspect("equal")
    axes.set_axis_off()
    return axes


def measuring(sheet: Figure) -> None:
    """A pulley from the side: D, the radius, the cable to A, P on the platform."""
    axes = _bare(sheet)
    centre, radius = np.array([0.0, 1.6]), 0.35
    axes.add_patch(Circle(centre, radius, facecolor="none", edgecolor=INK, lw=1.6))
    axes.add_patch(Circle(centre, 0.03, color=INK))
    entry = centre - [radius, 0.0]
    attachment = np.array([2.6, 0.15])
    out = attachment - centre
    reach, angle = np.linalg.norm(out), np.arctan2(out[1], out[0])
    leaves = centre + radius * np.array(
        [np.cos(angle + np.arccos(radius / reach)), np.sin(angle + np.arccos(radius / reach))]
    )
    axes.plot([entry[0]] * 2, [entry[1] - 1.4, entry[1]], color=AFTER, lw=1.6)
    axes.add_patch(Arc(centre, 2 * radius, 2 * radius, theta1=20, theta2=180, color=AFTER, lw=2.4))
    axes.plot(*np.stack([leaves, attachment]).T, color=AFTER, lw=1.6)
    plate = np.array([[2.6, 0.15], [4.4, 0.3], [4.42, 0.08], [2.62, -0.07]])
    axes.add_patch(Polygon(plate, facecolor="#e3e8ec", edgecolor=INK))
    point = np.array([3.5, 0.23])
    axes.plot(*point, "o", color=INK, ms=7, fillstyle="none", mew=1.5)
    axes.plot(*entry, "o", color=BEFORE, ms=6)
    axes.plot(*attachment, "s", color=BEFORE, ms=6)
    axes.plot(
        [centre[0], centre[0] + radius * 0.7], [centre[1], centre[1] + radius * 0.7], color=INK
    )
    for text, at, away in (
        ("D: entry_m\n(base frame)", entry, (-95, -10)),
        ("pulley_radius_m", centre + radius * 0.5, (40, 34)),
        ("A: attachment_m\n(platform frame)", attachment, (-70, -42)),
        ("P: the sheet's cross", point, (-10, 30)),
        ("to the winch, locked", entry - [0.0, 1.2], (12, 0)),
    ):
        axes.annotate(
            text,
            at,
            xytext=away,
            textcoords="offset points",
            fontsize=9,
            arrowprops={"arrowstyle": "-", "color": FAINT},
        )
    axes.set_xlim(-1.7, 4.9)
    axes.set_ylim(-0.75, 2.6)


def cameras(sheet: Figure) -> None:
    """Two cameras 60 degrees apart, from above."""
    axes = _bare(sheet)
    axes.add_patch(Rectangle((-0.25, -0.2), 0.5, 0.4, facecolor="#e3e8ec", edgecolor=INK))
    axes.plot([-0.15, 0.15], [-0.2, -0.2], color=AFTER, lw=4)
    for side in (-1, 1):
        angle = side * np.pi / 6
        place = 2.0 * np.array([np.sin(angle), -np.cos(angle)])
        axes.plot(*place, "s", color=INK, ms=11)
        for spread in (-0.25, 0.25):
            turn = angle + spread * 0.9
            end = place + 2.9 * np.array([-np.sin(turn), np.cos(turn)])
            axes.plot(*np.stack([place, end]).T, color=FAINT, lw=0.9, ls="--")
        axes.annotate(
            "left" if side < 0 else "right",
            place,
            xytext=(0, -20),
            textcoords="offset points",
            ha="center",
        )
    axes.add_patch(Arc((0, 0), 2.0, 2.0, theta1=-120, theta2=-60, color=BEFORE, lw=1.6))
    axes.annotate("60°", (0.0, -1.12), ha="center", color=BEFORE)
    axes.plot([-1.9, 1.9], [0.85, 0.85], color=INK, lw=2)
    for x, text in ((-0.7, "base tag 100: the base frame"), (0.8, "base tag 101")):
        axes.plot([x - 0.1, x + 0.1], [0.83, 0.83], color=AFTER, lw=5)
        axes.annotate(text, (x, 0.93), ha="center", fontsize=9)
    axes.annotate("platform, its sheet\ntowards the cameras", (0.3, 0.0), va="center", fontsize=9)
    axes.annotate("2 m", (-0.72, -0.95), fontsize=9)
    axes.set_xlim(-2.2, 2.2)
    axes.set_ylim(-2.15, 1.15)


def tags(sheet: Figure) -> None:
    """The platform's sheet as `freeswing new` prints it, its frame drawn."""
    axes = _bare(sheet)
    page = pages(Filmed(("left", "right"), 30.0, 0.075, "a4"))[0]
    wide, high = page.size_mm
    for one in page.sheets:
        columns = one.sheet.cells.shape[1]
        cell = one.sheet.width_mm / columns
        for x, y, w, h in one.sheet.bars():
            left = one.left_mm + cell * x - wide / 2
            top = high / 2 - one.top_mm - cell * y
            axes.add_patch(
                Rectangle((left, top - cell * h), cell * w, cell * h, color="black", lw=0)
            )
    for end, name in (((40.0, 0.0), "x"), ((0.0, 40.0), "y")):
        axes.annotate(
            "", end, (0.0, 0.0), arrowprops={"arrowstyle": "->", "color": BEFORE, "lw": 2}
        )
        axes.annotate(name, end, color=BEFORE, fontsize=11, fontweight="bold")
    axes.plot(0.0, 0.0, "o", color=BEFORE, ms=7, fillstyle="none", mew=2)
    axes.annotate("P", (3.0, -9.0), color=BEFORE, fontsize=11, fontweight="bold")
    axes.set_xlim(-wide / 2, wide / 2)
    axes.set_ylim(-high / 2, high / 2)


def pushing(sheet: Figure) -> None:
    """A recording: at rest, pulled aside, let go; the swing is simulated."""
    axes = sheet.add_axes((0.08, 0.2, 0.9, 0.75))
    example = numbers.string_plate()
    motion = numbers.swings(example, build_model(example.robot), 0.035, 10.0)[0]
    times = np.arange(0.0, 10.0, 0.02)
    x = 1e3 * motion.at(times)[0][:, 0]
    rest = float(np.mean(x))
    held = np.arange(-5.0, 0.0, 0.02)
    share = np.clip((held + 3.0) / 2.0, 0.0, 1.0)
    pulled = rest + (x[0] - rest) * share**2 * (3.0 - 2.0 * share)
    axes.plot(held, pulled, color=INK)
    axes.plot(times, x, color=AFTER)
    axes.axvspan(0.15, 10.0, color=AFTER, alpha=0.12, lw=0)
    top = float(max(x.max(), pulled.max()))
    for at, text in (
        (-4.9, "at rest"),
        (-2.9, "pulled by hand"),
        (3.2, "free: the window that is used"),
    ):
        axes.annotate(text, (at, top + 4.0), fontsize=9)
    axes.annotate(
        "let go",
        (0.0, x[0]),
        xytext=(-52, -22),
        textcoords="offset points",
        arrowprops={"arrowstyle": "->", "color": BEFORE},
        color=BEFORE,
    )
    axes.set_ylim(None, top + 10.0)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("x (mm)")


def sample(name: str) -> Callable[[Figure], None]:
    """A sample's robot with the path of its first swing."""

    def draw(sheet: Figure) -> None:
        axes = _bare(sheet)
        session = fs.open(SAMPLES / name)
        robot = session.robot()
        up = -robot.gravity_m_s2 / np.linalg.norm(robot.gravity_m_s2)
        swing = session.swing(session.runs[0])
        entries = projected(robot.entries_m, AZIMUTHS_RAD[0], up)
        if swing.is_pose:
            known = swing.take(swing.is_known)
            middle = len(known) // 2
            ends = known.positions()[middle] + robot.attachments_m @ known.rotations()[middle].T
            seen = projected(ends, AZIMUTHS_RAD[0], up)
            for entry, end in zip(entries, seen, strict=True):
                axes.plot(*np.stack([entry, end]).T, color=FAINT)
            if len(seen) == 2:
                axes.plot(*seen.T, color=INK, lw=3)
            else:
                out = seen - seen.mean(axis=0)
                order = np.argsort(np.arctan2(out[:, 1], out[:, 0]))
                axes.fill(*seen[order].T, facecolor=FAINT, alpha=0.4)
            path = projected(known.positions(), AZIMUTHS_RAD[0], up)
            axes.plot(*path.T, color=AFTER, lw=0.8)
        else:
            values = swing.values - np.nanmean(swing.values, axis=0)
            axes.set_aspect("auto")
            for k, label in enumerate(swing.coordinates):
                axes.plot(swing.times_s, values[:, k] / np.nanstd(values) - 5.0 * k, lw=0.9)
                axes.annotate(label, (swing.times_s[0], -5.0 * k + 2.5), fontsize=10)
            return
        axes.plot(*entries.T, "^", color=INK, ms=7)
        axes.margins(0.08)

    return draw


def filmed(sheet: Figure) -> None:
    """A frame of a sample's film."""
    import av

    axes = _bare(sheet)
    film = next(iter(sorted((SAMPLES / "filmed" / "runs").rglob("*.m[kp][v4]"))))
    with av.open(str(film)) as file:
        frame = next(file.decode(video=0)).to_ndarray(format="gray")
    axes.imshow(frame, cmap="gray", vmin=0, vmax=255)
