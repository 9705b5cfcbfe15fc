"""What may hang there, and the robot file that it begins with."""

from __future__ import annotations

from dataclasses import dataclass

from freeswing.cdpr.files.toml_text import toml_string

MISSING = "nan"  # a number that robot.toml does not take: nothing runs before it was measured


@dataclass(frozen=True, slots=True)
class Kind:
    """What hangs on how many strings.

    Attributes:
        says: one line for people.
        cables: how many, where the kind settles it.
        free_coordinates: what stays free, as robot.toml has it.
        radius_m: of the pulleys; zero for eyelets and knots, None where it has to be measured.
        any_count: whether there may be another number of cables.
    """

    says: str
    cables: int
    free_coordinates: str
    radius_m: float | None = 0.0
    any_count: bool = False

    @property
    def is_bench(self) -> bool:
        """Whether it hangs on two or three parallel strings."""
        return not self.any_count and self.cables in (2, 3)


KINDS = {
    "cable-robot": Kind("a platform on cables over pulleys", 4, '["x", "y"]', None, True),
    "plate": Kind("a plate on strings from fixed points", 4, '"auto"', 0.0, True),
    "trifilar": Kind("a plate on three parallel strings", 3, '["x", "y", "chi"]'),
    "bifilar": Kind("a bar on two parallel strings, along x", 2, '["x", "y", "phi", "chi"]'),
    "hook": Kind("a body on one string or a crane's hook", 1, '["x", "y", "phi", "theta", "chi"]'),
}


FRAMES = "# Base frame: that of the recordings, in metres. Platform frame: see target.toml."
BENCH_FRAMES = (
    "# Platform frame: P in the middle of the wires' lower ends, z up. Base frame: that of the",
    "# recordings, in metres; where these hold no place, P and its axes as the platform hangs.",
)


def robot_toml(name: str, kind: Kind, cables: int, mass_kg: float | None) -> str:
    """The text of robot.toml with every number that has to be measured marked `nan`."""
    free = kind.free_coordinates if cables == kind.cables else '"auto"'
    mass = f"mass_kg = {mass_kg:g}" if mass_kg else "# mass_kg = 8.0     # weigh it: optional"
    if kind.is_bench:
        weighed = f"{mass_kg:g}" if mass_kg else MISSING
        mass = f"mass_kg = {weighed}      # with all that hangs on it: kg m2 go with it"
        mass += "\n# mass_std_kg = 0.001   # how well; else as payload runs leave it open"
    lines = [
        'format = "freeswing-robot/1"',
        f"name = {toml_string(name)}",
        f"# {kind.says}. Every `nan` below has to be measured: docs/formats.md says what each is.",
        *(BENCH_FRAMES if kind.is_bench else [FRAMES]),
        "gravity_m_s2 = [0.0, 0.0, -9.80665]   # z up; another vertical axis: put -9.80665 there",
        f"free_coordinates = {free}",
        "",
        "[platform]",
        mass,
    ]
    for k in range(1, cables + 1):
        lines += ["", *_cable(k, kind)]
    return "\n".join([*lines, ""])


def _cable(k: int, kind: Kind) -> list[str]:
    what = "where the cable enters the pulley" if kind.radius_m is None else "upper end"
    lines = [
        "[[cables]]",
        f'name = "{k}"',
        f"entry_m = [{MISSING}, {MISSING}, {MISSING}]        # {what}, base frame",
        f"attachment_m = [{MISSING}, {MISSING}, {MISSING}]   # lower end, platform frame",
    ]
    if kind.radius_m is not None:
        return [*lines, f"pulley_radius_m = {kind.radius_m:g}"]
    return [
        *lines,
        f"pulley_radius_m = {MISSING}",
        f"swivel_z = [{MISSING}, {MISSING}, {MISSING}]       # axis about which the pulley swivels",
        f"swivel_x = [{MISSING}, {MISSING}, {MISSING}]       # square to it, towards the pulley",
        f"swivel_y = [{MISSING}, {MISSING}, {MISSING}]       # square to both, right-handed",
    ]
