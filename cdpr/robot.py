"""A cable robot's constants: frames, cables, pulleys and the platform's nominal inertia."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.tolerances import Tolerances

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from freeswing.cdpr.driven.drive import Drive
    from freeswing.cdpr.measured.trajectory import Trajectory
    from freeswing.cdpr.model.statics import Equilibrium, Modes
    from freeswing.cdpr.simulation.by_lengths import Effects

POSE_COORDINATES = ("x", "y", "z", "phi", "theta", "chi")
INERTIA_NAMES = (
    "com_x_m",
    "com_y_m",
    "com_z_m",
    "Ixx_m2",
    "Iyy_m2",
    "Izz_m2",
    "Ixy_m2",
    "Ixz_m2",
    "Iyz_m2",
)
# A body in absolute numbers: mass, centre of mass, tensor (about which point, its user says).
BODY_NAMES = (
    "mass_kg",
    "com_x_m",
    "com_y_m",
    "com_z_m",
    "Ixx_kg_m2",
    "Iyy_kg_m2",
    "Izz_kg_m2",
    "Ixy_kg_m2",
    "Ixz_kg_m2",
    "Iyz_kg_m2",
)
STANDARD_GRAVITY_M_S2 = 9.80665
# Millimetres given as metres are a thousand times too large: stadium cameras hang on 200 m, and
# the smallest laboratory frame, 0.3 m, would read 300.
LARGEST_FRAME_M = 200.0

Array = NDArray[Any]


def spread_of(points: Array) -> float:
    """How far points (n, 3) lie from their middle, root mean square, in their unit."""
    off = points - points.mean(axis=0)
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


def frozen_array(values: object, shape: tuple[int, ...], what: str) -> Array:
    """A read-only float copy of `values`, of the given shape and finite.

    Raises:
        ValueError: when the shape differs or a number is not finite.
    """
    array = np.array(values, dtype=np.float64)
    if array.shape != shape:
        raise ValueError(f"{what}: shape {array.shape}, expected {shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{what}: {array} holds a number that is not finite")
    array.flags.writeable = False
    return array


def finite(what: str, numbers: Array, size: int) -> Array:
    """A float copy of `numbers`.

    Raises:
        ValueError: when the shape is not (size,) or a number is not finite.
    """
    array = np.array(numbers, dtype=np.float64)
    if array.shape != (size,):
        raise ValueError(f"{what} has shape {array.shape}, must be ({size},)")
    if not np.isfinite(array).all():
        raise ValueError(f"{what} is {array}: every number must be finite")
    return array


@dataclass(frozen=True, slots=True)
class Cable:
    """One cable over a swivel pulley (self-calibration 2019, sec. 2.1); radius 0 is an eyelet at D.

    Attributes:
        name: the cable's label.
        entry_m: D, where the cable enters the pulley, base frame, (3,).
        pulley_radius_m: r >= 0.
        attachment_m: A, platform frame, (3,).
        swivel_x: unit vector of the swivel frame, base frame, (3,).
        swivel_y: unit vector of the swivel frame, base frame, (3,).
        swivel_z: unit vector along the swivel axis, base frame, (3,).
    """

    name: str
    entry_m: Array
    pulley_radius_m: float
    attachment_m: Array
    swivel_x: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))
    swivel_y: Array = field(default_factory=lambda: np.array([0.0, 1.0, 0.0]))
    swivel_z: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))

    def __post_init__(self) -> None:
        for key in ("entry_m", "attachment_m", "swivel_x", "swivel_y", "swivel_z"):
            vector = frozen_array(getattr(self, key), (3,), f"cable {self.name}: {key}")
            object.__setattr__(self, key, vector)
        if not (np.isfinite(self.pulley_radius_m) and self.pulley_radius_m >= 0.0):
            raise ValueError(
                f"cable {self.name}: pulley_radius_m is {self.pulley_radius_m}, must be >= 0"
            )


@dataclass(frozen=True, slots=True)
class Platform:
    """Nominal (CAD) inertia; every value may be unknown (None).

    Attributes:
        mass_kg: mass.
        com_m: P to centre of mass, platform frame, (3,).
        specific_inertia_m2: xx yy zz xy xz yz of the inertia tensor about P over the mass, (6,).
    """

    mass_kg: float | None = None
    com_m: Array | None = None
    specific_inertia_m2: Array | None = None

    def __post_init__(self) -> None:
        if self.com_m is not None:
            object.__setattr__(self, "com_m", frozen_array(self.com_m, (3,), "com_m"))
        if self.specific_inertia_m2 is not None:
            inertia = frozen_array(self.specific_inertia_m2, (6,), "specific_inertia_m2")
            object.__setattr__(self, "specific_inertia_m2", inertia)


@dataclass(frozen=True, slots=True)
class Robot:
    """Everything about the robot that does not move.

    Attributes:
        name: the robot's label.
        gravity_m_s2: gravity in the base frame, (3,).
        free_coordinates: 6 - n names out of x y z phi theta chi; None lets the program choose.
        platform: nominal inertia.
        cables: the n cables.
        drive: how motors move the cables; None where they hold them.
        tolerances: how well all this is known.
    """

    name: str
    cables: tuple[Cable, ...]
    gravity_m_s2: Array = field(
        default_factory=lambda: np.array([0.0, 0.0, -STANDARD_GRAVITY_M_S2])
    )
    free_coordinates: tuple[str, ...] | None = None
    platform: Platform = field(default_factory=Platform)
    drive: Drive | None = None
    tolerances: Tolerances = field(default_factory=Tolerances)

    def __post_init__(self) -> None:
        gravity = frozen_array(self.gravity_m_s2, (3,), "gravity_m_s2")
        object.__setattr__(self, "gravity_m_s2", gravity)

    @classmethod
    def from_toml(cls, path: Path | str) -> Robot:
        """The robot of a robot.toml.

        Raises:
            InputError: naming every problem of the file.
        """
        from freeswing.cdpr.files.robot_file import read_robot

        return read_robot(path)

    def equilibrium(
        self, lengths_m: Sequence[float], effects: Effects | None = None
    ) -> tuple[Equilibrium, Modes]:
        """Where it hangs with cables of these lengths, and how it swings there.

        See `cdpr.simulation.by_lengths.hanging`, also for what it raises.
        """
        from freeswing.cdpr.simulation.by_lengths import hanging

        return hanging(self, lengths_m, effects)

    def simulate(self, lengths_m: Sequence[float], **how: Any) -> Trajectory:
        """A swing at these lengths; `how` and what it raises: `cdpr.simulation.by_lengths.swing`.

        For instance `amplitude_m=0.05, duration_s=20.0,
        effects={"translational_drag": {"rate_1_s": 0.05}}`.
        """
        from freeswing.cdpr.simulation.by_lengths import swing

        return swing(self, lengths_m, **how)

    @property
    def n_cables(self) -> int:
        """Number of cables n."""
        return len(self.cables)

    @property
    def entries_m(self) -> Array:
        """Pulley entry points D in the base frame, (n, 3)."""
        return np.array([cable.entry_m for cable in self.cables])

    @property
    def attachments_m(self) -> Array:
        """Attachment points A in the platform frame, (n, 3)."""
        return np.array([cable.attachment_m for cable in self.cables])

    @property
    def radii_m(self) -> Array:
        """Pulley radii, (n,)."""
        return np.array([cable.pulley_radius_m for cable in self.cables])

    @property
    def swivel_axes(self) -> Array:
        """Swivel frames in the base frame, rows x, y, z, (n, 3, 3)."""
        return np.array([[c.swivel_x, c.swivel_y, c.swivel_z] for c in self.cables])

    @property
    def inertia(self) -> Array | None:
        """Nominal `INERTIA_NAMES` values, (9,), or None where one is unknown."""
        com, inertia = self.platform.com_m, self.platform.specific_inertia_m2
        return None if com is None or inertia is None else np.concatenate([com, inertia])
