"""What `excite --drive` does: currents and poses at rest that tell most about a driven robot."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING, Any

from freeswing.commands.arguments import add_instruments, instruments_of, positive, whole
from freeswing.console import Console

if TYPE_CHECKING:
    from pathlib import Path

    from freeswing.cdpr.driven.model import DrivenModel
    from freeswing.ident.drive.plan.deviations import Bench
    from freeswing.ident.drive.plan.plan_poses import Poses
    from freeswing.ident.drive.plan.plan_record import Planned

DYNAMIC = (
    "mass_kg",
    "Ixx_kg_m2",
    "Iyy_kg_m2",
    "Izz_kg_m2",
    "motor_inertia_kg_m2",
    "viscous_N_m_s",
    "spring_N_m",
    "coulomb_N_m",
)
SECONDS, RATE_HZ, SCORED, RANDOM = 5.0, 1000.0, 60, 5  # where no flag says otherwise


def add_drive_arguments(parser: ArgumentParser) -> None:
    """What only a driven robot has."""
    group = parser.add_argument_group("driven robots")
    group.add_argument(
        "--drive",
        nargs="?",
        const="prbs",
        choices=("prbs", "multisine"),
        help="plan current references for the motors, and poses at rest",
    )
    group.add_argument(
        "--unknown",
        action="append",
        default=[],
        metavar="NAME[=NAME]",
        help="a number to be known, as in drive.toml; may be repeated (geometry, mass, inertia, "
        "friction and springs)",
    )
    group.add_argument("--margin-n", type=positive, default=0.5, help="to slack, default 0.5")
    group.add_argument("--room", type=positive, default=0.6, help="of the frame, default 0.6")
    group.add_argument("--poses", type=whole, default=8, metavar="N", help="at rest to add (8)")
    group.add_argument("--noise-m", type=positive, default=1e-3, help="of a pose, default 1e-3")
    group.add_argument("--noise-rad", type=positive, default=5e-3, help="of a pose, default 5e-3")
    add_instruments(group, latency_s=0.0107, encoder_step_rad=0.001534, current_noise_a=0.005)


def run_drive(options: Namespace, console: Console) -> None:
    """Plan, write the record as the declared robot would give it, and say what it is worth.

    Raises:
        InputError: for a robot without motors, or unknowns that there are not.
        DataError: when no plan keeps within the limits.
    """
    from freeswing.cdpr.files.documents import DataError, InputError, write_json
    from freeswing.cdpr.system.confine import results_folder
    from freeswing.ident.drive.plan.plan_poses import at_rest, plan_poses, single_motors
    from freeswing.ident.drive.plan.plan_record import Limits, plan_record

    path = options.robot
    bench, limits = _bench(path, options), Limits(options.margin_n, options.room)
    folder = results_folder(path.parent, options.results)
    try:
        bench.refuse_zero()
    except ValueError as error:
        raise InputError(f"{path}: {error}; leave it out with --unknown") from error
    try:
        planned = plan_record(
            bench,
            at_rest(bench, single_motors(bench)),
            limits,
            kind=options.drive,
            seconds=options.duration_s,
            scored=options.starts,
            n_random=options.random,
            seed=options.seed,
            progress=console.progress,
        )
        poses = None
        if bench.asked.n_kinematic:
            poses = plan_poses(bench, limits, options.poses, options.seed)
    except ValueError as error:
        raise DataError(f"{path}: {error}") from error
    document = _document(bench, limits, options, planned, poses)
    _write_record(folder / "drive-excitation.csv", bench, planned)
    result = folder / "drive-excitation.json"
    write_json(result, document)
    _say(document, console)
    console.say(str(folder / "drive-excitation.csv"))
    console.say(str(result))
    console.show_file(result)


def _bench(path: Path, options: Namespace) -> Bench:
    from freeswing.cdpr.driven.model import build_driven
    from freeswing.cdpr.files.documents import InputError
    from freeswing.cdpr.files.robot_file import read_robot
    from freeswing.ident.drive.plan.deviations import Bench

    robot = read_robot(path)
    if robot.drive is None:
        raise InputError(f"{path}: has no [drive]: --drive is for driven robots")
    model = build_driven(robot)
    asked = _asked(path, model, options.unknown)
    return Bench(model, asked, instruments_of(options), RATE_HZ)


def _asked(path: Path, model: DrivenModel, texts: list[str]) -> Any:
    """The unknowns, geometry first."""
    from freeswing.ident.drive.unknowns import Asked
    from freeswing.session.drive_session import unknown_groups

    drive = model.robot.drive
    shape = () if drive is None else drive.shape.free
    if not texts:
        there = [name for name in DYNAMIC if name in model.names]
        texts = [*shape, *there]
    groups = {"kinematic": [], "dynamic": []}
    for text in texts:
        first = text.partition("=")[0].strip()
        kind = "kinematic" if first in shape or first.startswith("drum_radius_m") else "dynamic"
        groups[kind] += unknown_groups(path, model, kind, text)
    return Asked((*groups["kinematic"], *groups["dynamic"]), len(groups["kinematic"]))


def _document(
    bench: Bench, limits: Any, options: Namespace, planned: Planned, poses: Poses | None
) -> dict[str, Any]:
    import numpy as np

    best, motion = planned.best, planned.best.motion
    cables, names = bench.model.robot.cables, bench.asked.names
    worst = planned.random.max(axis=1)
    typical = np.median(planned.random, axis=0) if len(planned.random) else None
    return {
        "format": "freeswing-drive-excitation/1",
        "robot": bench.model.robot.name,
        "kind": options.drive,
        "seconds": options.duration_s,
        "motors": [
            {"motor": cable.name, "low_A": s.low_A, "high_A": s.high_A, "band_hz": s.band_hz}
            for cable, s in zip(cables, best.references.settings, strict=True)
        ],
        "margin_N": limits.margin_N,
        "least_tension_N": motion.tensions_N.min(),
        "most_tension_N": motion.tensions_N.max(),
        "travel_m": np.abs(motion.poses[:, :3]).max(axis=0),
        "worst": {"name": names[int(np.argmax(best.deviations))], "percent": 100.0 * best.worst},
        "deviations": [
            {"name": name, "percent": 100.0 * value}
            | ({} if typical is None else {"random_percent": 100.0 * typical[k]})
            for k, (name, value) in enumerate(zip(names, best.deviations, strict=True))
        ],
        "random": {
            "count": len(worst),
            "worst_percent": 100.0 * worst,
            "least_tension_N": planned.random_least_N,
        },
        "tried": planned.tried,
        "scored": planned.scored,
        "static_poses": None if poses is None else _added(bench, poses),
    }


def _added(bench: Bench, poses: Poses) -> dict[str, Any]:
    names = bench.asked.kinematic.names
    return {
        "add": [
            {"currents_A": row, "position_m": pose[:3], "q": pose[3:]}
            for row, pose in zip(poses.currents_A, poses.poses, strict=True)
        ],
        "deviations": [
            {"name": name, "percent_before": 100.0 * a, "percent_after": 100.0 * b}
            for name, a, b in zip(names, poses.before, poses.after, strict=True)
        ],
    }


def _write_record(path: Path, bench: Bench, planned: Planned) -> None:
    """The plan as a recording without noise, which `simulate --drive` drives again."""
    import numpy as np

    from freeswing.cdpr.driven.record import Instruments, observed
    from freeswing.cdpr.driven.statics import CENTRE
    from freeswing.cdpr.files.drive_csv import write_drive_run

    exact = Instruments(bench.instruments.pose_rate_hz, bench.instruments.latency_s)
    motion = planned.best.motion
    record = observed(motion, CENTRE, exact, np.random.default_rng(0))
    write_drive_run(path, record, motion.tensions_N)


def _say(document: dict[str, Any], console: Console) -> None:
    for one in document["motors"]:
        console.say(
            f"  motor {one['motor']}: {one['low_A']:.2f} to {one['high_A']:.2f} A, "
            f"up to {one['band_hz']:g} Hz"
        )
    worst, random = document["worst"], document["random"]
    console.say(
        f"worst: {worst['name']} known to {worst['percent']:.3g} % (one deviation); tensions "
        f"{document['least_tension_N']:.2f} to {document['most_tension_N']:.2f} N"
    )
    if random["count"]:
        middle = sorted(random["worst_percent"])[random["count"] // 2]
        console.say(
            f"{random['count']} random PRBS of 0 and 1 A in 1 Hz: worst {middle:.3g} % in the "
            f"middle, {min(random['worst_percent']):.3g} % at best, tensions down to "
            f"{min(random['least_tension_N']):.2f} N"
        )
    poses = document["static_poses"]
    if poses is None:
        return
    for one in poses["deviations"]:
        console.say(
            f"  at rest: {one['name']} {one['percent_before']:.3g} % by one motor at a time, "
            f"{one['percent_after']:.3g} % with {len(poses['add'])} poses more"
        )
