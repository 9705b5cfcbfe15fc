"""Masses and inertias that can only be in another unit, held against the robot's size."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from freeswing.cdpr.robot import Array, Robot
from freeswing.doctor.finding import Finding
from freeswing.session.session_file import Run

# Radius of gyration, and the centre's distance from P, over the largest distance between two
# attachments: a load on a long rope below a small ring has 20; in kg mm² and mm they are a
# thousand times what they are, of bodies mostly 0.3 to 1.
LARGEST = 30.0
# The same: a cannonball in the middle of a wide frame has 0.05; a mass in g makes it 32 times
# less.
SMALLEST = 1.0 / 30.0
# Mean density of a platform over the ball that its attachments span, or that reaches from P to
# twice its centre of mass, kg/m³: of steel.
DENSEST = 7850.0
# The same of what lies on one: of water. A block of steel fills an eighth of the ball then.
DENSEST_PAYLOAD = 1000.0


def mass_findings(robot: Robot) -> Iterator[Finding]:
    """Of the platform: inertia in kg mm², its centre in mm, a mass in g."""
    span, platform = _span_m(robot), robot.platform
    if not span > 0.0:
        return
    if platform.specific_inertia_m2 is not None:
        gyration = _gyration_m(platform.specific_inertia_m2)
        apart = f"a radius of gyration of {gyration:.3g} m, its attachments {span:.3g} m apart"
        if gyration > LARGEST * span:
            text = f"the platform's inertia gives {apart}: this looks like kg mm²"
            yield Finding(
                "error", "robot", text, "write kg m² (inertia_kg_m2) or m² (specific_inertia_m2)"
            )
        elif 0.0 < gyration < SMALLEST * span:  # none at all is of a point
            text = f"the platform's inertia gives {apart}: this looks like mass_kg in g"
            yield Finding("warning", "robot", text, "write kg and kg m²")
    far = 0.0 if platform.com_m is None else float(np.linalg.norm(platform.com_m))
    if far > LARGEST * span:
        text = (
            f"com_m is {far:.4g} m from P, the attachments {span:.3g} m apart: this looks like mm"
        )
        yield Finding("error", "robot", text, "all lengths are in metres")
    if platform.mass_kg is not None:
        dense = platform.mass_kg / _ball_m3(max(span, 2.0 * far))
        if dense > DENSEST:
            text = (
                f"mass_kg = {platform.mass_kg:.4g} on attachments {span:.3g} m apart is denser "
                "than steel: this looks like g"
            )
            yield Finding("warning", "robot", text, "write kg")


def payload_findings(runs: Sequence[Run], robot: Robot) -> Iterator[Finding]:
    """Of the known masses on the platform: places in mm, inertias in kg mm², masses in g."""
    span = _span_m(robot)
    for run in runs if span > 0.0 else ():
        for payload in run.payloads:
            far = float(np.linalg.norm(payload.position_m))
            if far > LARGEST * span:
                text = (
                    f"payload position_m is {far:.4g} m from P, the attachments {span:.3g} m apart"
                )
                yield Finding(
                    "error", f"run {run.name}", f"{text}: this looks like mm", "write metres"
                )
            gyration = _gyration_m(payload.inertia_kg_m2 / payload.mass_kg)
            if gyration > LARGEST * span:
                text = (
                    f"payload inertia_kg_m2 of {payload.mass_kg:.4g} kg is a radius of gyration of "
                    f"{gyration:.3g} m, the attachments {span:.3g} m apart: this looks like kg mm²"
                )
                yield Finding("error", f"run {run.name}", text, "write kg m²")
            if payload.mass_kg > DENSEST_PAYLOAD * _ball_m3(span):
                text = f"payload mass_kg = {payload.mass_kg:.4g} on attachments {span:.3g} m apart"
                yield Finding(
                    "warning", f"run {run.name}", f"{text}: this looks like g", "write kg"
                )


def _span_m(robot: Robot) -> float:
    """The largest distance between two attachments."""
    points = robot.attachments_m
    return float(np.linalg.norm(points[:, None] - points[None], axis=-1).max())


def _gyration_m(specific_inertia_m2: Array) -> float:
    """Radius of gyration; files may round a point's moments of inertia below zero."""
    return math.sqrt(max(0.5 * float(specific_inertia_m2[:3].sum()), 0.0))


def _ball_m3(diameter_m: float) -> float:
    return math.pi / 6.0 * diameter_m**3
