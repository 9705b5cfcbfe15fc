"""Where runs differ by what they carry, deviations hold what another reading would make of Izz."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freeswing.ident.bench.fit_rounds import Solved
from freeswing.ident.bench.mass_verdict import MassVerdict, mass_left_free
from freeswing.ident.bench.told import kinds_doubt
from freeswing.ident.bench.told.kinds_doubt import with_differences, with_kinds_counted
from freeswing.ident.likelihood.fit import Solution
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown, Unknowns
from freeswing.main import main
from tests.oracle.recorded.benches import Hidden, make_bench

KINDS = (0.0, 0.0, 0.4, 0.4)


def block(name: str, value: np.ndarray) -> Unknown:
    prior = Gaussian(value, np.ones(len(value)), "test")
    return Unknown(name, value, np.ones(len(value)), prior)


def solution(platform: np.ndarray, *more: Unknown) -> Solution:
    unknowns = Unknowns((block("platform", platform), *more))
    size = sum(one.size for one in unknowns.blocks)
    stop: Any = None
    return Solution(unknowns, 1e-8 * np.eye(size), 1.0, (), np.ones(size), size, 1, stop)


def solved_of(scatter: np.ndarray, mass: MassVerdict | None = None) -> Solved:
    swings: Any = [
        SimpleNamespace(
            known=np.array([kg, *np.zeros(9)]),
            riding=[SimpleNamespace(block="platform", turn=np.eye(3))],
        )
        for kg in KINDS
    ]
    found = solution(np.ones(10), block("scatter", scatter))
    return Solved(found, swings, found.unknowns, 1e-4, mass)


@pytest.mark.parametrize(
    ("scatter", "counted"),
    [((-1.0, -1.1, 1.0, 1.1), True), ((-1.0, 1.0, 1.1, -1.1), False)],
)
def test_what_goes_with_kinds_is_counted_in_full(monkeypatch, scatter, counted: bool) -> None:
    """Chance is not: its size is in the deviations already."""
    asked = []

    def other(swings: Any, unknowns: Unknowns, how: Any) -> Solution:
        asked.append(unknowns)
        return solution(1.03 * np.ones(10))

    monkeypatch.setattr(kinds_doubt, "fit", other)
    mass = MassVerdict(1.2, 1.24, 0.01, False)
    found = with_kinds_counted(solved_of(np.array(scatter), mass)).solution
    assert found.std("platform")[6] == pytest.approx(0.03 if counted else 1e-4, rel=1e-3)
    assert found.value("platform")[6] == 1.0
    assert all("scatter" not in one and one.block("platform").mask[0] for one in asked)


def test_a_mass_left_free_is_next_to_unknown() -> None:
    held = Unknowns((block("platform", np.ones(10)),)).held("platform")
    freed = mass_left_free(held, MassVerdict(1.2, 1.24, 0.01, False)).block("platform")
    assert freed.mask.tolist() == [True] + 9 * [False]
    assert freed.prior is not None
    assert freed.prior.std[0] == 1.2


def test_blocks_that_only_one_fit_has_do_not_count() -> None:
    one = solution(np.ones(10), block("missing.torsion_spring", np.ones(1)))
    told = with_differences(one, [(one, solution(np.full(10, 1.5)))])
    assert told.std("platform") == pytest.approx(np.full(10, 0.5))
    assert told.std("missing.torsion_spring") == pytest.approx([1e-4])


@pytest.mark.slow
@pytest.mark.parametrize(("wires", "seen"), [(3, "poses"), (2, "poses"), (3, "plane")])
def test_a_clamp_that_holds_yaw_is_within_what_is_claimed(
    tmp_path: Path, wires: int, seen: str
) -> None:
    """20 mN m a radian: three to five per cent of Izz, which stood at 22 to 64 deviations."""
    hidden = Hidden(0.0, 1.0, 0.0, 0.0, hold_n_m=0.02)
    truth = make_bench(tmp_path, 3, wires, seen, 6.0, (2, 1, 2), hidden)
    for command, key in (("identify", "objects"), ("diagnose", "objects_after")):
        assert main([command, str(tmp_path), "--quiet"]) == 0
        name = {"identify": "identification", "diagnose": "diagnosis"}[command]
        told = json.loads((tmp_path / "results" / f"{name}.json").read_text())
        platform, load = ({row["name"]: row for row in one["parameters"]} for one in told[key])
        izz, own = platform["Izz_P_kg_m2"], load["Izz_kg_m2"]
        assert abs(izz["value"] - truth.platform_izz_p) < 3.0 * izz["std"], (command, izz)
        assert abs(own["value"] - truth.load_izz) < 3.0 * own["std"], (command, own)
