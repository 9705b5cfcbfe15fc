"""Run a driven robot's closed loop through a task: camera, controller, tensions, friction."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from freeswing.commands.arguments import add_results, add_robot
from freeswing.console import Console

if TYPE_CHECKING:
    from freeswing.cdpr.driven.model import DrivenModel
    from freeswing.results.control import TrialResult
    from freeswing.servo.files.controller_file import Stored
    from freeswing.servo.files.task_file import Task
    from freeswing.servo.loop.trials import Outcome, Trial


def add_arguments(parser: ArgumentParser) -> None:
    """Robot, task, controllers, what is switched on."""
    add_robot(parser, " of a driven robot")
    parser.add_argument("--task", required=True, metavar="FILE", help="task.toml")
    parser.add_argument(
        "--controller",
        action="append",
        default=[],
        metavar="FILE",
        help="controller.json of `design`; may be repeated (results/controller.json)",
    )
    parser.add_argument(
        "--friction-feed",
        action="store_true",
        help="feed the declared Coulomb friction forward (always run beside it for comparison)",
    )
    parser.add_argument(
        "--encoders",
        action="store_true",
        help="carry each pose on to now by what the encoders have turned since it was taken",
    )
    parser.add_argument(
        "--schedule",
        action="store_true",
        help="turn the controller's wrench into that of each place (gain scheduling by M_o)",
    )
    parser.add_argument(
        "--survive",
        action="store_true",
        help="also with 15 ms latency, mass x 1.3, inertia x 3, one spring 20 %% weak",
    )
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="of the camera's noise (0)"
    )
    add_results(parser, "ROBOT's folder/results")


def run(options: Namespace, console: Console) -> None:
    """Check the task, run every trial, write the table, the samples and the figures."""
    from freeswing.cdpr.files.documents import InputError, write_json
    from freeswing.cdpr.system.confine import results_folder
    from freeswing.results.control import ServoResult
    from freeswing.servo.driven_file import read_driven
    from freeswing.servo.files.controller_file import read_controller
    from freeswing.servo.files.task_file import read_task
    from freeswing.servo.loop.feasible_path import leaves_workspace
    from freeswing.servo.loop.trials import carry_out
    from freeswing.servo.tensions.methods import MOST_SPARE

    path, model = read_driven(options.robot)
    folder = results_folder(path.parent, options.results)
    if model.n_cables > 6 + MOST_SPARE:
        raise InputError(
            f"{path}: {model.n_cables} cables: the control loop distributes wrenches over at most "
            f"{6 + MOST_SPARE} (freeswing tensions takes more)"
        )
    task = read_task(options.task)
    if (why := leaves_workspace(model, task)) is not None:
        raise InputError(f"{options.task}: {why}")
    files = options.controller or [folder / "controller.json"]
    controllers = [read_controller(file) for file in files]
    if find_spec("daqp") is None and any(c.predictor is not None for c in controllers):
        raise InputError(
            "--controller: a predictive controller needs daqp at the motors' limits: "
            "pip install 'freeswing[control]'"
        )
    pairs = [(c, t) for c in controllers for t in _trials(model, task, options, c)]
    outcomes = []
    for k, (controller, trial) in enumerate(pairs):
        console.progress("trials", k / len(pairs))
        outcomes.append(carry_out(trial, controller))
        _say(console, outcomes[-1])
    trials = tuple(_entry(outcome) for outcome in outcomes)
    document = ServoResult(task=str(Path(options.task).name), trials=trials)
    write_json(folder / "servo.json", document.to_json())
    _write_run(folder, model, task, outcomes)
    console.say(str(folder / "servo.json"))
    console.show_file(folder / "servo.json")


def _trials(model: DrivenModel, task: Task, options: Namespace, controller: Stored) -> list[Trial]:
    from dataclasses import replace

    from freeswing.servo.loop.trials import Trial, hardships, without_coulomb

    common = {"by_encoders": options.encoders, "seed": options.seed}
    common["schedule"] = options.schedule
    trials = [
        Trial("no Coulomb friction", task, without_coulomb(model), model, **common),
        Trial("Coulomb friction", task, model.declared, model, **common),
    ]
    if options.friction_feed:
        trials.append(
            Trial("friction fed forward", task, model.declared, model, feed=True, **common)
        )
    if options.survive:
        hard = hardships(model, task, feed=options.friction_feed, seed=options.seed)
        carried = {"by_encoders": options.encoders, "schedule": options.schedule}
        trials += [replace(trial, **carried) for trial in hard]
    return trials


def _say(console: Console, outcome: Outcome) -> None:
    found = outcome.judgement
    moves = [step for step in found.steps if step.t90_s == step.t90_s]
    left = max((1e3 * step.left_m for step in found.steps), default=float("nan"))
    slowest = max((step.t90_s for step in moves), default=float("nan"))
    state = "held" if found.held else f"LOST ({found.why})"
    console.say(
        f"{outcome.method}, {outcome.trial.name}: {state}; at most {left:.2f} mm left of a step, "
        f"90 % after {slowest:.2f} s, tensions {found.least_N:.2f} to {found.most_N:.2f} N"
    )


def _entry(outcome: Outcome) -> TrialResult:
    from dataclasses import asdict

    from freeswing.results.control import TrialResult

    return TrialResult.from_json(
        {
            "controller": outcome.method,
            "trial": outcome.trial.name,
            "friction_feed": outcome.trial.feed,
            "encoders": outcome.trial.by_encoders,
            "schedule": outcome.trial.schedule,
            "seed": outcome.trial.seed,
            **asdict(outcome.judgement),
        }
    )


def _write_run(folder: Path, model: DrivenModel, task: Task, outcomes: list[Outcome]) -> None:
    """The first controller's samples with friction, and Figs. 14 and 15."""
    from freeswing.cdpr.files.documents import replace_file
    from freeswing.report.servo_figures import friction_figure, task_figure
    from freeswing.servo.files.run_file import run_csv
    from freeswing.servo.robot_now import motors_of

    first = [outcome for outcome in outcomes if outcome.method == outcomes[0].method]
    chosen = first[2] if first[min(2, len(first) - 1)].trial.feed else first[1]
    names = tuple(cable.name for cable in model.robot.cables)
    replace_file(folder / "servo.csv", run_csv(chosen.run, names))
    limits = motors_of(model).tension_limits_N
    replace_file(folder / "servo-task.svg", task_figure(chosen.run, names, limits).encode())
    step = 2 if len(task.times_s) > 2 else 0
    begin = float(task.times_s[step])
    end = float(task.times_s[step + 1]) if step + 1 < len(task.times_s) else task.end_s
    runs = {
        o.trial.name: o.run for o in first[: 3 if len(first) > 2 and first[2].trial.feed else 2]
    }
    replace_file(folder / "servo-friction.svg", friction_figure(runs, begin, end).encode())
