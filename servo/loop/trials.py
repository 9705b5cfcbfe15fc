"""Runs of one task side by side: controllers, friction, and a robot that is not as declared."""

from __future__ import annotations

from dataclasses import dataclass, replace

from freeswing.cdpr.driven.drive import Drive
from freeswing.cdpr.driven.model import DrivenModel, build_driven
from freeswing.servo.design.schedule import Schedule
from freeswing.servo.files.controller_file import Stored
from freeswing.servo.files.task_file import Task
from freeswing.servo.files.weights_file import Camera
from freeswing.servo.loop.anti_windup import LinearRegulator
from freeswing.servo.loop.closed_loop import Loop, Run, current_bounds, run_loop
from freeswing.servo.loop.friction import FrictionFeed
from freeswing.servo.loop.judge import Judgement, judge
from freeswing.servo.loop.predictive import Bounds, PredictiveRegulator
from freeswing.servo.loop.regulator import Regulator
from freeswing.servo.robot_now import Survey, motors_of
from freeswing.servo.synthesis.state_space import Array

# What the controller must bear, as the project's goals state it.
LATE_S = 0.015
HEAVIER, STIFFER_INERTIA, WEAKER_SPRING = 1.3, 3.0, 0.8


@dataclass(frozen=True, slots=True)
class Trial:
    """One run and how to make it.

    Attributes:
        name: in words.
        task: with what the loop sees.
        truth: numbers of the robot that moves.
        model: the model whose numbers those are; its declared ones are the controller's.
        feed: whether friction is fed forward.
        by_encoders: whether poses are carried on by the encoders.
        schedule: whether the wrench is scheduled by the pose.
        seed: of the noise.
    """

    name: str
    task: Task
    truth: Array
    model: DrivenModel
    feed: bool = False
    by_encoders: bool = False
    schedule: bool = False
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a trial."""

    trial: Trial
    method: str
    run: Run
    judgement: Judgement


def carry_out(trial: Trial, controller: Stored) -> Outcome:
    """Run and judge one trial."""
    model = trial.model
    motors = motors_of(model)
    feed = FrictionFeed(motors.coulomb_N_m, motors.torque_N_m_A) if trial.feed else None
    loop = Loop(
        model,
        trial.truth,
        regulator_of(controller, model),
        controller.wrench,
        trial.task,
        feed,
        trial.by_encoders or controller.carried,
        controller.joint,
        Schedule(model, controller.at) if trial.schedule else None,
        trial.seed,
    )
    run = run_loop(loop)
    names = tuple(cable.name for cable in model.robot.cables)
    return Outcome(
        trial, controller.method, run, judge(run, trial.task, names, motors.tension_limits_N)
    )


def regulator_of(controller: Stored, model: DrivenModel) -> Regulator:
    """What the loop steps."""
    if controller.predictor is None:
        return LinearRegulator(controller.system)
    survey = Survey(model)
    here = survey.here(controller.at)
    ends = current_bounds(here, survey.motors)
    bounds = Bounds(controller.at, controller.wrench, here.wrench_matrix, *ends)
    return PredictiveRegulator(controller.predictor, bounds)


def without_coulomb(model: DrivenModel) -> Array:
    """The declared numbers with every motor's Coulomb friction taken out."""
    names = [name for name in model.names if name.split(".")[0] == "coulomb_N_m"]
    return model.theta(dict.fromkeys(names, 0.0))


def hardships(model: DrivenModel, task: Task, *, feed: bool, seed: int) -> list[Trial]:
    """The same task on robots and cameras that are not as declared."""
    late = replace(
        task, watch=replace(task.watch, camera=Camera(task.watch.camera.period_s, LATE_S))
    )
    declared = dict(zip(model.names, model.declared, strict=True))
    inertia = {
        name: STIFFER_INERTIA * value
        for name, value in declared.items()
        if name.startswith("I") and name.endswith("_kg_m2")
    }
    cases = [
        (f"{1e3 * LATE_S:g} ms of latency", late, model.declared),
        (
            f"mass x {HEAVIER:g}",
            task,
            model.theta({"mass_kg": HEAVIER * declared["mass_kg"]}),
        ),
        (f"inertia x {STIFFER_INERTIA:g}", task, model.theta(inertia)),
    ]
    trials = [Trial(name, t, truth, model, feed, seed=seed) for name, t, truth in cases]
    return [*trials, *_weak_spring(model, task, feed, seed)]


def _weak_spring(model: DrivenModel, task: Task, feed: bool, seed: int) -> list[Trial]:
    """One spring weaker than all the others, by the effect that the diagnosis knows."""
    first = model.robot.cables[0].name
    robot = model.robot
    if robot.drive is None:
        return []
    altered = build_driven(replace(robot, drive=_own_spring(robot.drive)))
    name = f"spring_N_m.{first}"
    value = altered.declared[altered.index(name)]
    return [
        Trial(
            f"spring {first} x {WEAKER_SPRING:g}",
            task,
            altered.theta({name: WEAKER_SPRING * value}),
            altered,
            feed,
            seed=seed,
        )
    ]


def _own_spring(drive: Drive) -> Drive:
    """The same drive, its first motor's spring a number of its own."""
    first = drive.motors[0]
    own = replace(first, own=first.own | {"spring_N_m"})
    return replace(drive, motors=(own, *drive.motors[1:]))
