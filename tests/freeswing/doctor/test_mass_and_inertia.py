"""Masses in g and inertias in kg mm² are named, on both sides of each limit."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.robot import Platform
from freeswing.doctor.robot_file.mass_and_inertia import mass_findings, payload_findings
from freeswing.ident.bench.runs import KnownBody
from tests.oracle.scenes.robots import declared_robot

BARE = declared_robot("bologna-4")
BALL_M3 = np.pi / 6.0 * 0.5**3


def robot(platform: Platform):
    """Attachments 0.5 m apart."""
    corners = 0.25 * np.array(
        [[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [-1.0, 0.0, 1.0], [0.0, -1.0, 1.0]]
    )
    cables = [replace(c, attachment_m=p) for c, p in zip(BARE.cables, corners, strict=True)]
    return replace(BARE, cables=tuple(cables), platform=platform)


def gyrating(radius_m: float) -> Platform:
    return Platform(8.0, np.zeros(3), radius_m**2 * np.array([1.0, 0.5, 0.5, 0.0, 0.0, 0.0]))


@pytest.mark.parametrize(
    ("platform", "says"),
    [
        (Platform(), ""),
        (gyrating(14.9), ""),
        (gyrating(15.1), "error: the platform's inertia gives a radius of gyration of 15.1 m"),
        (gyrating(0.0170), ""),
        (gyrating(0.0163), "warning: the platform's inertia gives a radius of gyration of 0.0163"),
        (gyrating(0.0), ""),
        (Platform(8.0, np.zeros(3), -1e-12 * np.ones(6)), ""),
        (Platform(com_m=np.array([0.0, 0.0, 14.9])), ""),
        (Platform(com_m=np.array([0.0, 0.0, 15.1])), "error: com_m is 15.1 m from P"),
        (Platform(0.98 * 7850.0 * BALL_M3), ""),
        (Platform(1.02 * 7850.0 * BALL_M3), "warning: mass_kg = 524.1 on attachments 0.5 m apart"),
    ],
)
def test_of_the_platform(platform: Platform, says: str) -> None:
    said = [f"{one.level}: {one.text}" for one in mass_findings(robot(platform))]
    assert [one.startswith(says) for one in said] == [True] * bool(says), said


def test_a_load_far_below_its_ring_is_not_dense() -> None:
    """Half a ton three metres below attachments that are 0.5 m apart."""
    hung = Platform(500.0, np.array([0.0, 0.0, -3.0]), np.array([9.1, 9.1, 0.1, 0.0, 0.0, 0.0]))
    assert list(mass_findings(robot(hung))) == []
    assert list(mass_findings(robot(replace(hung, mass_kg=5e4)))) == []


@pytest.mark.parametrize(
    ("mass_kg", "far_m", "gyration_m", "says"),
    [
        (0.98 * 1000.0 * BALL_M3, 0.1, 0.0, ""),
        (1.02 * 1000.0 * BALL_M3, 0.1, 0.0, "warning run a: payload mass_kg = 66.76 on attachment"),
        (0.5, 14.9, 0.0, ""),
        (0.5, 15.1, 0.0, "error run a: payload position_m is 15.1 m from P"),
        (0.5, 0.1, 14.9, ""),
        (0.5, 0.1, 15.1, "error run a: payload inertia_kg_m2 of 0.5 kg is a radius of gyration of"),
    ],
)
def test_of_a_payload(mass_kg: float, far_m: float, gyration_m: float, says: str) -> None:
    inertia = mass_kg * gyration_m**2 * np.array([1.0, 0.5, 0.5, 0.0, 0.0, 0.0])
    body = KnownBody(mass_kg, np.array([far_m, 0.0, 0.0]), inertia)
    run: Any = SimpleNamespace(name="a", payloads=(body,))
    found = payload_findings([run], robot(Platform()))
    said = [f"{one.level} {one.subject}: {one.text}" for one in found]
    assert [one.startswith(says) for one in said] == [True] * bool(says), said
