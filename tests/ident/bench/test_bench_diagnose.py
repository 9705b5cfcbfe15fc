"""Parts of a bench's diagnosis: causes, the linear problem of left-out runs, and its limits."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.cdpr.effects import catalogue, effect_named
from freeswing.cdpr.files.problems import DataError
from freeswing.cdpr.model.equations import build_model
from freeswing.ident.bench.assemble import EFFECTS, assembled
from freeswing.ident.bench.diagnose import diagnose
from freeswing.ident.bench.diagnose.causes import (
    ALL_WIRES,
    causes_of,
    dressed,
    mass_power,
    wanting,
)
from freeswing.ident.bench.diagnose.document import bench_document, experiment_of
from freeswing.ident.bench.diagnose.removal import Removed, _wires
from freeswing.ident.bench.diagnose.unexplained import remaining
from freeswing.ident.bench.modal import ModalSwing
from freeswing.ident.bench.swing import COMMON, BenchSwing, Column
from freeswing.ident.likelihood.fit_blocks import linear_problem
from tests.ident.bench.test_swing_slopes import small_bench, trifilar


@pytest.mark.parametrize(
    ("effect", "power"),
    [("torsion_spring", -1), ("cable_mass", -1), ("cable_elasticity", 1), ("gravity_tilt", 0)],
)
def test_how_effects_go_with_the_mass_that_hangs(effect: str, power: int) -> None:
    """The same spring turns twice the mass half as much; the same wire stretches twice as far."""
    assert mass_power(effect_named(effect)) == power


def test_every_end_moves_alone_and_all_together() -> None:
    robot = trifilar()
    causes = causes_of(robot, ["attachment_offset"])
    assert [one.part for one in causes] == ["", "0", "1", "2"]
    together = causes[0].directions @ [1.0, 2.0]
    np.testing.assert_array_equal(together.reshape(3, 3), np.tile([1.0, 2.0, 0.0], (3, 1)))
    alone = causes[2].directions @ [1.0, 2.0]
    np.testing.assert_array_equal(alone.reshape(3, 3)[1], [1.0, 2.0, 0.0])
    assert np.count_nonzero(alone) == 2


def start_with(names: list[str]):
    """The small bench in a model with some causes, its unknowns a little off."""
    bench, robot = small_bench(), trifilar()
    start = assembled(build_model(robot, EFFECTS), bench, bench.runs)
    causes = [one for one in causes_of(robot, names) if not one.part]
    swings = dressed(start.swings, causes, np.array([1.5, 1.2, 1.0]))
    unknowns = wanting(start.unknowns, causes)
    moved = {one.block: 0.1 * unknowns.block(one.block).scale for one in causes}
    return swings, unknowns.moved(moved), causes


def test_slopes_of_causes_are_those_of_differences() -> None:
    names = ["gravity_tilt", "cable_elasticity", "torsion_spring", "attachment_offset"]
    swings, unknowns, causes = start_with(names)
    for index, swing in enumerate(swings):
        values = unknowns.of_run(index)
        _, slopes = swing.linearised(values, swing.simulated(values))
        for cause in causes:
            block = unknowns.block(cause.block)
            for k in range(block.size):
                step, ends = 1e-2 * block.scale[k], []
                for sign in (1.0, -1.0):
                    there = values[block.name] + sign * step * np.eye(block.size)[k]
                    moved = {**values, block.name: there}
                    ends.append(swing.residuals(moved, swing.simulated(moved)))
                expected = (ends[0] - ends[1]) / (2.0 * step)
                size = np.abs(expected).max() + 1e-3 / block.scale[k]
                off = np.abs(slopes[block.name][:, k] - expected).max() / size
                assert off < 5e-3, (swing.name, block.name, k, off)


def test_all_wires_together_are_the_block_that_every_bench_has() -> None:
    (together,) = [one for one in causes_of(trifilar()) if one.part == ALL_WIRES]
    bench, robot = small_bench(), trifilar()
    start = assembled(build_model(robot, EFFECTS), bench, bench.runs)
    held = start.unknowns.held(COMMON)
    assert wanting(held, [together]).block(COMMON).mask.all()
    swings = dressed(start.swings, [together], np.ones(3))
    assert swings[0].acting == ()


def test_a_left_out_run_follows_as_well_as_its_own_unknowns_allow() -> None:
    """Triangles and left-over residuals against the whole least-squares problem of a run."""
    swings, unknowns, _ = start_with(["gravity_tilt"])
    linear = linear_problem(swings, unknowns)
    change = 0.01 * np.random.default_rng(0).normal(size=linear.triangles.shape[1] - 1)
    for run, (residuals, own, shared) in enumerate(linear.parts):
        moved = residuals + shared @ change
        best = moved - own @ np.linalg.lstsq(own, moved, rcond=None)[0]
        reduced = linear.triangles[run] @ np.append(change, 1.0)
        assert np.sum(reduced**2) == pytest.approx(np.sum(best**2), rel=1e-6)
        left = linear.left_over(run, change)
        assert np.sum(left**2) == pytest.approx(np.sum(best**2), rel=1e-6)


@pytest.mark.parametrize(("size_mm", "part"), [(0.28, ""), (0.32, "0")])
def test_the_wire_that_is_the_one(size_mm: float, part: str) -> None:
    """Known to 0.1 mm: three deviations make it the one."""
    values = 1e-3 * np.array([size_mm, 0.1, -0.1])
    solution = SimpleNamespace(value=lambda _: values, std=lambda _: np.full(3, 1e-4))
    swing = SimpleNamespace(model=SimpleNamespace(robot=trifilar()))
    last: Any = SimpleNamespace(solution=solution, swings=[swing])
    told = _wires(last, Removed("cable_length_bias", ("wires.1",), (np.ones(3, bool),)))
    assert told.part == part
    assert told.values == pytest.approx(values)


@pytest.mark.parametrize(("power", "present"), [(8.0, False), (12.0, True)])
def test_what_remains_stands_out_of_white_noise(power: float, present: bool) -> None:
    """A residual of so many times the noise's power over the lower quarter of the band."""
    count = 4096
    spectrum = np.ones(count // 2 + 1)
    spectrum[: count // 8] = np.sqrt(power)
    phases = np.exp(2j * np.pi * np.random.default_rng(1).random(len(spectrum)))
    part = np.fft.irfft(spectrum * phases, count)
    times = np.arange(count) / 50.0
    column = Column("chi", np.zeros(count), np.ones(count), 5)
    swing = SimpleNamespace(times_s=times, columns=(column,))
    fit: Any = SimpleNamespace(swings=[swing], solution=SimpleNamespace(residuals=[part]))
    told = remaining(fit)
    assert told["present"] == present, told
    assert ("chi is off by" in told["signature"]) == present


@pytest.mark.parametrize("kind", [ModalSwing, BenchSwing])
def test_two_runs_tell_no_effect_from_another(monkeypatch, kind) -> None:
    """Every effect is `not_identifiable`, with the reason and what to add."""
    swings = tuple(object.__new__(kind) for _ in range(2))
    identified = SimpleNamespace(solved=SimpleNamespace(swings=swings, mass=None, wires=None))
    monkeypatch.setattr(diagnose, "identify_bench", lambda *_: identified)
    nothing: Any = None
    document = bench_document(diagnose.diagnose_bench(nothing, nothing))
    assert {row["verdict"] for row in document["candidates"]} == {"not_identifiable"}
    assert len(document["candidates"]) == len(catalogue())
    assert "2 run(s)" in document["notes"][0], document["notes"]


def test_channels_alone_go_their_own_way(monkeypatch) -> None:
    swings = tuple(object.__new__(ModalSwing) for _ in range(3))
    identified = SimpleNamespace(solved=SimpleNamespace(swings=swings))
    monkeypatch.setattr(diagnose, "identify_bench", lambda *_: identified)
    monkeypatch.setattr(diagnose, "by_channels", lambda one: ("by channels", one))
    nothing: Any = None
    assert diagnose.diagnose_bench(nothing, nothing) == ("by channels", identified)


def test_three_runs_are_diagnosed_and_what_fails_is_said(monkeypatch) -> None:
    swings = tuple(object.__new__(BenchSwing) for _ in range(3))
    identified = SimpleNamespace(solved=SimpleNamespace(swings=swings))
    monkeypatch.setattr(diagnose, "identify_bench", lambda *_: identified)

    def fails(*_: object) -> None:
        raise ValueError("as arranged")

    monkeypatch.setattr(diagnose, "_diagnosed", fails)
    nothing: Any = None
    with pytest.raises(DataError, match="cannot be diagnosed: as arranged"):
        diagnose.diagnose_bench(nothing, nothing)


def test_a_group_is_told_with_what_would_part_it() -> None:
    assert "plumb line" in experiment_of(["constant_force", "gravity_tilt"])
    assert "exchange the wires" in experiment_of(["anchor_offset", "attachment_offset"])
    assert "payload" in experiment_of(["torsion_spring", "cable_mass"])


def test_a_run_keeps_its_drag_beside_what_all_share() -> None:
    swings, unknowns, causes = start_with(["torsion_spring"])
    values = unknowns.of_run(0)
    (spring,) = causes
    found = swings[0].effects(values)
    np.testing.assert_array_equal(found[: len(values["effects"])], values["effects"])
    np.testing.assert_allclose(found[-2:], values[spring.block] / 1.5, rtol=1e-12)
    plain = replace(swings[0], acting=())
    np.testing.assert_array_equal(plain.effects(values), values["effects"])
