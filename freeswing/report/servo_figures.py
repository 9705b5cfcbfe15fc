"""The paper's figures of its control section, drawn from what was computed here."""

from __future__ import annotations

import io
from collections.abc import Callable

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from freeswing.report.figures import (
    AFTER,
    BEFORE,
    FAINT,
    INK,
    SERIES,
    figure_style,
    plain_log_axes,
    thin,
)
from freeswing.servo.design.controller import Controller
from freeswing.servo.design.plant import Plant
from freeswing.servo.loop.closed_loop import Run
from freeswing.servo.synthesis.four_block import bare
from freeswing.servo.synthesis.state_space import Array, close
from freeswing.servo.synthesis.weights import Weights

RATES_RAD_S = np.geomspace(1e-2, 1e3, 400)
# Samples a line: 16 s of 28 lines stay below 200 kB so.
POINTS = 400
HALVES = ((slice(0, 3), "position", AFTER), (slice(3, 6), "orientation", BEFORE))


def controller_gains(found: Controller) -> str:
    """Fig. 12: singular values of the controller."""
    K = found.system.at(RATES_RAD_S)

    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        for half, name, colour in HALVES:
            values = np.asarray(np.linalg.svd(K[:, half, half], compute_uv=False), float)
            _bundle(axes, values, name, colour)
        _log(axes, "gain (N/m, N m/rad)")
        axes.legend()

    return _svg(draw, 6.0, 3.2, "Singular values of the controller")


def templates(found: Controller, plant: Plant, weights: Weights) -> str:
    """Fig. 13: the four transfers of the loop under their templates gamma / (W_o W_i)."""
    loop = close(bare(plant.system).plant, found.system).at(RATES_RAD_S)
    gamma = found.norm
    rows = (("e", slice(0, 6), "w1"), ("u", slice(6, 12), "w2"))
    columns = (("r", slice(0, 6), None), ("d", slice(6, 12), "w3"))

    def draw(sheet: Figure) -> None:
        grid = sheet.subplots(2, 2)
        for i, (out, high, w_out) in enumerate(rows):
            for j, (into, wide, w_in) in enumerate(columns):
                block = loop[:, high, wide]
                for half, name, colour in HALVES:
                    part = getattr(weights, name)
                    size = getattr(part, w_out).at(RATES_RAD_S)
                    if w_in:
                        size = size * getattr(part, w_in).at(RATES_RAD_S)
                    values = np.asarray(
                        np.linalg.svd(block[:, half, half], compute_uv=False), float
                    )
                    _bundle(grid[i, j], np.asarray(values, float), name, colour)
                    grid[i, j].plot(RATES_RAD_S, gamma / size, color=colour, ls="--", lw=0.9)
                _log(grid[i, j], f"from {into} to {out}")
        grid[0, 0].legend()

    return _svg(
        draw, 8.0, 5.6, "Transfers of the closed loop (lines) under their templates (dashed)"
    )


def task_figure(run: Run, names: tuple[str, ...], limits_N: Array) -> str:
    """Fig. 14: position, wrench, currents, tensions over a task."""

    def draw(sheet: Figure) -> None:
        grid = sheet.subplots(2, 2)
        t = thin(run.times_s, POINTS)
        for k, axis in enumerate("xyz"):
            grid[0, 0].plot(t, thin(run.asked[:, k], POINTS), color=FAINT, lw=0.9)
            grid[0, 0].plot(t, thin(run.poses[:, k], POINTS), color=SERIES[k], label=axis)
            grid[0, 1].plot(
                t, thin(run.wrenches[:, k], POINTS), color=SERIES[k], label=f"f{axis} (N)"
            )
            moments = 10.0 * run.wrenches[:, 3 + k]
            grid[0, 1].plot(
                t, thin(moments, POINTS), color=SERIES[3 + k], lw=0.8, label=f"10 m{axis} (N m)"
            )
        for k, name in enumerate(names):
            grid[1, 0].plot(t, thin(run.currents_A[:, k], POINTS), lw=0.8, label=name)
            grid[1, 1].plot(t, thin(run.tensions_N[:, k], POINTS), lw=0.8, label=name)
        for limit in np.unique(limits_N):
            grid[1, 1].axhline(limit, color=INK, ls="--", lw=0.9)
        labels = ("position (m)", "wrench", "currents (A)", "tensions (N)")
        for axes, label in zip(grid.ravel(), labels, strict=True):
            axes.set_xlabel("time (s)")
            axes.set_ylabel(label)
        grid[0, 0].legend(ncols=3)
        grid[0, 1].legend(ncols=2, fontsize=7)

    return _svg(draw, 9.0, 6.0, "Position, wrench, currents and tensions over the task")


def friction_figure(runs: dict[str, Run], begins_s: float, ends_s: float) -> str:
    """Fig. 15: one step with and without Coulomb friction."""

    def draw(sheet: Figure) -> None:
        axes = sheet.subplots()
        for k, (name, run) in enumerate(runs.items()):
            inside = (run.times_s >= begins_s - 0.2) & (run.times_s < ends_s)
            t = thin(run.times_s[inside])
            if k == 0:
                axes.plot(t, 1e3 * thin(run.asked[inside, 0]), color=INK, lw=0.9, label="asked")
            axes.plot(t, 1e3 * thin(run.poses[inside, 0]), color=SERIES[k], label=name)
        axes.set_xlabel("time (s)")
        axes.set_ylabel("x (mm)")
        axes.legend()

    return _svg(draw, 7.0, 3.4, "One step with and without Coulomb friction")


def _bundle(axes: Axes, values: Array, name: str, colour: str) -> None:
    axes.plot(RATES_RAD_S, values[:, 0], color=colour, label=name)
    axes.plot(RATES_RAD_S, values[:, 1:], color=colour, lw=0.6)


def _log(axes: Axes, label: str) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("rate (rad/s)")
    axes.set_ylabel(label)
    plain_log_axes(axes)


def _svg(draw: Callable[[Figure], None], width_in: float, height_in: float, title: str) -> str:
    with mpl.rc_context(figure_style() | {"svg.hashsalt": title}):
        sheet = Figure(figsize=(width_in, height_in), layout="constrained")
        draw(sheet)
        buffer = io.StringIO()
        metadata = {"Date": None, "Creator": None, "Title": title}
        FigureCanvasSVG(sheet).print_svg(buffer, metadata=metadata)
    return buffer.getvalue()
