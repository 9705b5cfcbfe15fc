"""Speeds against time: of the measured samples, and of both models."""

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.model.equations import build_model
from freeswing.ident.diagnose.answer.decay import PARTS, swing_decay
from tests.oracle.scenes.robots import declared_robot

RATE = 0.2


class Motion:
    """A swing along x whose amplitude falls at a rate, with its derivatives."""

    def __init__(self, rate):
        self.rate = rate

    def at(self, times):
        wave = 0.1 * np.exp((2.0j * np.pi - self.rate) * times)
        zetas, rates = np.zeros((2, len(times), 6))
        zetas[:, 0] = wave.real
        rates[:, 0] = ((2.0j * np.pi - self.rate) * wave).real
        return zetas, rates, None


def fit(rate, samples):
    robot = declared_robot("bologna-4")
    inertia = np.concatenate([robot.platform.com_m, robot.platform.specific_inertia_m2])  # pyright: ignore[reportArgumentType, reportCallIssue]
    model = build_model(robot)
    return SimpleNamespace(
        model=model, inertia=inertia, motions=(Motion(rate),), samples=(samples,)
    )


def test_speeds_fall_as_the_swing_does_and_a_model_without_losses_keeps_them():
    times = np.arange(0.0, 10.0, 0.01)
    samples = SimpleNamespace(
        name="a", is_pose=True, times_s=times, values=Motion(RATE).at(times)[0]
    )
    (run,) = swing_decay(fit(0.0, samples), fit(RATE, samples))  # pyright: ignore[reportArgumentType]
    measured = np.array(run["measured_m_s"])
    assert len(measured) == PARTS
    assert measured[0] == pytest.approx(0.1 * 2 * np.pi / np.sqrt(2) * np.exp(-RATE), rel=0.02)
    fall = np.exp(-RATE * 2.0)
    assert measured[1:] / measured[:-1] == pytest.approx(np.full(PARTS - 1, fall), rel=0.01)
    assert run["after_m_s"] == pytest.approx(run["measured_m_s"], rel=2e-3)
    assert np.ptp(run["before_m_s"]) < 0.01 * run["before_m_s"][0]
    samples.is_pose = False
    assert swing_decay(fit(0.0, samples), fit(RATE, samples)) == []  # pyright: ignore[reportArgumentType]
