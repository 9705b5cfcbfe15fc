"""Runs of a bench that no fit could show to be wrong."""

from __future__ import annotations

from freeswing.cdpr.robot import Robot
from freeswing.doctor.bench_units import refuse_wrong_units
from freeswing.doctor.exchanged_by_lean import refuse_exchanged_by_lean
from freeswing.doctor.quaternions import refuse_mistaken_quaternions
from freeswing.ident.bench.runs import Bench
from freeswing.session.exchanged_lengths import BENCH_DIFFERENCE_M, refuse_exchanged_lengths
from freeswing.session.load_bench import coordinate_swings
from freeswing.session.repeated_runs import refuse_repeated


def refuse_wrong_bench_runs(bench: Bench, robot: Robot) -> None:
    """Refuse other units, a recording given twice, mistaken quaternions and exchanged lengths.

    Raises:
        InputError: naming what is in another unit.
        DataError: naming the runs, what is wrong and what to do.
    """
    refuse_wrong_units(bench, robot)
    swings = coordinate_swings(bench)
    refuse_repeated(swings)
    refuse_mistaken_quaternions(swings, robot)
    refuse_exchanged_lengths(swings, robot, BENCH_DIFFERENCE_M)
    refuse_exchanged_by_lean(bench, robot)
