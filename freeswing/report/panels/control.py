"""Panel: the robot under control: controllers, what they survive, the task, Figs. 12 to 15."""

from __future__ import annotations

from typing import Any

from freeswing.report.material import Material
from freeswing.report.words import number
from freeswing.results.control import ControllerRow, Halves, TrialResult


class ControlPanel:
    """Controllers side by side, robustness in sentences, every run of the task, the pictures."""

    name = "control"
    title = "Under control"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Rows and pictures; None where nothing was designed or run."""
        if material.control is None:
            return None
        found = material.control
        first, trials = found.controller, found.servo.trials if found.servo else ()
        known = dict(found.controllers.controllers) if found.controllers else {}
        if first is not None and not known:
            known = {first.method: first.row()}
        return {
            "controllers": [_controller(name, one) for name, one in known.items()],
            "warnings": list(first.warnings) if first else [],
            "robustness": list(found.robustness.sentences) if found.robustness else [],
            "task": found.servo.task if found.servo else "",
            "trials": [_trial(one) for one in trials],
            "pictures": found.pictures,
        }


def _controller(name: str, one: ControllerRow) -> dict[str, str]:
    margin = one.delay_margin_s
    return {
        "controller": name,
        "gamma": "" if one.gamma is None else f"{one.gamma:.3f}",
        "order": str(one.order),
        "bandwidth (rad/s)": _pair(one.bandwidth_rad_s),
        "modulus margin": _pair(one.margins),
        "the same with the delay": _pair(one.with_delay.margins),
        "delay margin (ms)": "none" if margin is None else f"{1e3 * margin:.1f}",
    }


def _pair(halves: Halves) -> str:
    return f"{number(halves.position)}, {number(halves.orientation)}"


def _trial(one: TrialResult) -> dict[str, str]:
    moves = [step.t90_s for step in one.steps if step.t90_s is not None]
    left = max((step.left_m for step in one.steps if step.left_m is not None), default=None)
    return {
        "controller": one.controller,
        "robot": one.trial,
        "most left of a step (mm)": "" if left is None else f"{1e3 * left:.2f}",
        "90 % after (s)": f"{max(moves):.2f}" if moves else "",
        "tensions (N)": f"{_newtons(one.least_N)} to {_newtons(one.most_N)}",
        "held": "yes" if one.held else f"lost: {one.why}",
    }


def _newtons(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"
