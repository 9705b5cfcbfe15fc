"""Panel: the robot under control: controllers, what they survive, the task, Figs. 12 to 15."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from freeswing.report.material import Material
from freeswing.report.words import number


class ControlPanel:
    """Controllers side by side, robustness in sentences, every run of the task, the pictures."""

    name = "control"
    title = "Under control"

    def values(self, material: Material) -> dict[str, Any] | None:
        """Rows and pictures; None where nothing was designed or run."""
        if material.control is None:
            return None
        found = material.control.documents
        first = found.get("controller.json", {})
        known = found.get("controllers.json", {}).get("controllers") or {
            one["method"]: one for one in [first] if one
        }
        return {
            "controllers": [_controller(name, one) for name, one in known.items()],
            "warnings": [str(text) for text in first.get("warnings", ())],
            "robustness": list(found.get("robustness.json", {}).get("sentences", ())),
            "task": str(found.get("servo.json", {}).get("task", "")),
            "trials": [_trial(one) for one in found.get("servo.json", {}).get("trials", ())],
            "pictures": material.control.pictures,
        }


def _controller(name: str, one: Mapping[str, Any]) -> dict[str, str]:
    margin = one["delay_margin_s"]
    return {
        "controller": name,
        "gamma": "" if one.get("gamma") is None else f"{one['gamma']:.3f}",
        "order": str(one["order"]),
        "bandwidth (rad/s)": _pair(one["bandwidth_rad_s"]),
        "modulus margin": _pair(one["margins"]),
        "the same with the delay": _pair(one["with_delay"]["margins"]),
        "delay margin (ms)": "none" if margin is None else f"{1e3 * margin:.1f}",
    }


def _pair(halves: Mapping[str, float]) -> str:
    return f"{number(halves['position'])}, {number(halves['orientation'])}"


def _trial(one: Mapping[str, Any]) -> dict[str, str]:
    moves = [step["t90_s"] for step in one["steps"] if step["t90_s"] is not None]
    left = max((step["left_m"] for step in one["steps"]), default=None)
    return {
        "controller": one["controller"],
        "robot": one["trial"],
        "most left of a step (mm)": "" if left is None else f"{1e3 * left:.2f}",
        "90 % after (s)": f"{max(moves):.2f}" if moves else "",
        "tensions (N)": f"{one['least_N']:.2f} to {one['most_N']:.2f}",
        "held": "yes" if one["held"] else f"lost: {one['why']}",
    }
