"""Tell the effects that simulations, fits and the diagnosis know: what each is, its unknowns."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING, Any

from freeswing.console import Console

if TYPE_CHECKING:
    from freeswing.cdpr.effects import Effect
    from freeswing.cdpr.robot import Robot

FORMAT = "freeswing-effects/1"


def add_arguments(parser: ArgumentParser) -> None:
    """Which effects, and of which robot."""
    parser.add_argument("names", metavar="EFFECT", nargs="*", help="only these, in full")
    parser.add_argument(
        "--robot", metavar="FILE", help="whose cables and pulleys name the unknowns (robot.toml)"
    )


def run(options: Namespace, console: Console) -> None:
    """One line an effect; where some are named, their whole description and unknowns."""
    from freeswing.cdpr.effects import catalogue
    from freeswing.cdpr.files.documents import InputError

    known = catalogue()
    for name in options.names:
        if name not in known:
            raise InputError(f"{name}: not one of {', '.join(known)}")
    robot = _robot(options.robot)
    chosen = {name: known[name] for name in options.names or known}
    for name, effect in chosen.items():
        console.say(f"{name}: {effect.summary}")
        if options.names:
            _tell(effect, robot, console)
    entries = [_entry(effect, robot) for effect in chosen.values()]
    console.say_json({"format": FORMAT, "effects": entries})


def _robot(path: str | None) -> Robot:
    """The robot of a file, else the demonstration's, which has every part."""
    from freeswing.cdpr.files.robot_file import read_robot
    from freeswing.demo.truth import demo_robot

    return demo_robot() if path is None else read_robot(path)


def _tell(effect: Effect, robot: Robot, console: Console) -> None:
    from inspect import getdoc

    console.say()
    for line in (getdoc(type(effect)) or "").splitlines():
        console.say(f"  {line}".rstrip())
    console.say()
    for one in effect.parameters(robot):
        each = ", each run its own" if one.per_run else ""
        console.say(f"  {one.name}: {one.low:g} to {one.high:g}, typically {one.scale:g}{each}")
    for experiment in sorted(effect.separated_by, key=lambda e: e.rank):
        console.say(f"  to tell it from others: {experiment.advice}")
    console.say()


def _entry(effect: Effect, robot: Robot) -> dict[str, Any]:
    parameters = [
        {
            "name": one.name,
            "low": one.low,
            "high": one.high,
            "scale": one.scale,
            "start": one.start,
            "per_run": one.per_run,
        }
        for one in effect.parameters(robot)
    ]
    return {
        "name": effect.name,
        "summary": effect.summary,
        "stage": effect.stage,
        "parameters": parameters,
        "separated_by": [experiment.advice for experiment in effect.separated_by],
    }
