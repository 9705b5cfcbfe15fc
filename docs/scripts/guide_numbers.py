"""The numbers of docs/guide, each from the model: nothing here is typed in that can be computed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.effects import catalogue
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.robot import Array, Cable, Platform, Robot
from freeswing.cdpr.rotation import exp_rotation
from freeswing.cdpr.simulation.free_swing import Motion, simulate
from freeswing.cdpr.simulation.release import release, rest_at_lengths
from freeswing.cdpr.simulation.sensitivity import linearise
from freeswing.cdpr.simulation.start_state import by_free_coordinates, start_slopes
from freeswing.demo.truth import SWINGS, TRUE_INERTIA, demo_robot

GEOMETRY = (
    "anchor_offset",
    "attachment_offset",
    "pulley_radius",
    "pulley_axis",
    "gravity_tilt",
)
UNITS = {  # of a parameter's suffix: what one unit of the table is, and its name
    "_m": (1e-3, "1 mm"),
    "_rad": (1e-3, "1 mrad"),
}
SAMPLE_STD = np.array([1e-4] * 3 + [5e-4] * 3)  # two cameras: 0.1 mm and 0.5 mrad a sample
RATE_HZ = 50.0
DURATION_S = 10.0
Rows = list[list[str]]


@dataclass(frozen=True, eq=False)
class Example:
    """A robot with its body and the cable lengths of its swings."""

    name: str
    robot: Robot
    inertia: Array
    lengths_m: tuple[tuple[float, ...], ...]
    free: tuple[str, ...]


@cache
def cable_robot() -> Example:
    """The robot of the papers and of `freeswing demo`: pulleys, 8 kg, a frame of 2.2 x 2.4 m."""
    lengths = tuple(one[2] for one in SWINGS if one[1] == "identify")
    return Example("cable robot, 2.2 x 2.4 m", demo_robot(), TRUE_INERTIA, lengths, ("x", "y"))


@cache
def string_plate() -> Example:
    """A round plate, 4 kg, on three strings of about 1.1 m that spread upwards from it."""
    angles = np.deg2rad([90.0, 210.0, 330.0])
    around = np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], axis=1)
    cables = tuple(
        Cable(str(k + 1), 0.6 * place, 0.0, 0.2 * place) for k, place in enumerate(around)
    )
    com = np.array([0.012, -0.008, -0.04])
    tensor = np.diag([0.0125, 0.0135, 0.024]) + com @ com * np.eye(3) - np.outer(com, com)
    inertia = np.array([*com, *np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]])
    robot = Robot("plate", cables, free_coordinates=("x", "y", "chi"), platform=Platform(4.0))
    places = ((0.0, 0.0), (0.12, 0.05), (-0.1, 0.1), (0.02, -0.12), (-0.08, -0.06))
    lengths = tuple(
        tuple(np.linalg.norm(robot.entries_m - robot.attachments_m - [x, y, -1.05], axis=1))
        for x, y in places
    )
    return Example("plate on three strings", robot, inertia, lengths, ("x", "y", "chi"))


def swings(
    example: Example,
    model: Model,
    amplitude_m: float = 0.035,
    duration_s: float = DURATION_S,
) -> list[Motion]:
    """The example's swings, each let go at rest."""
    generator = np.random.default_rng(1)
    values = model.start_values
    found = []
    for lengths in example.lengths_m:
        rest = rest_at_lengths(model, np.array(lengths), example.inertia, values, generator)
        start = release(model, rest, example.inertia, values, amplitude_m, generator)
        span = (0.0, duration_s)
        found.append(simulate(model, start, np.zeros(6), span, example.inertia, values))
    return found


def normal_equations(example: Example, motion: Motion) -> tuple[Array, Array]:
    """What one swing tells of the inertia, (9, 9), and how geometry pulls at it, (9, k).

    Start, speeds and cable lengths of the swing are free and eliminated.
    """
    model = motion.model
    times = np.arange(0.0, motion.end_s, 1.0 / RATE_HZ)
    whole = linearise(motion).at(times)[0]
    arguments = (motion.zetas[0], motion.rates[0], motion.inertia, motion.values)
    slopes = start_slopes(model, example.free, *arguments)
    change = by_free_coordinates(whole, slopes) / SAMPLE_STD[:, None]
    rows = change.reshape(-1, change.shape[-1])
    own = rows.shape[1] - 9 - len(model.names)
    held, body, geometry = rows[:, :own], rows[:, own : own + 9], rows[:, own + 9 :]
    body_left = body - held @ np.linalg.lstsq(held, body, rcond=None)[0]
    return body_left.T @ body, body_left.T @ geometry


@cache
def cost_of_geometry(example: Example) -> dict[str, tuple[Array, str]]:
    """By kind of mistake: error of the nine parameters for a unit error of every such number.

    Each coordinate errs by itself, by one unit (standard deviation); the parameters' errors are
    what the best fit then makes of exact swings.
    """
    fitting = [name for name in GEOMETRY if catalogue()[name].parameters(example.robot)]
    model = build_model(example.robot, tuple(fitting))
    parts = [normal_equations(example, motion) for motion in swings(example, model)]
    told, pulled = (sum(one[k] for one in parts) for k in (0, 1))
    bias = -np.linalg.solve(told, pulled)
    found = {}
    for name in fitting:
        place = model.place_of(name)
        suffix = "_m" if model.names[place.start].endswith("_m") else "_rad"
        unit, what = UNITS[suffix]
        found[name] = (unit * np.sqrt((bias[:, place] ** 2).sum(axis=1)), what)
    return found


def bound(example: Example, amplitude_m: float, count: int, duration_s: float) -> Array:
    """Least standard deviations of the nine parameters with exact geometry, (9,)."""
    parts = told_by_each(example, amplitude_m, duration_s)
    told = sum(parts[k % len(parts)] for k in range(count)) * (100.0 / RATE_HZ)
    return np.sqrt(np.diag(np.linalg.inv(told)))


@cache
def told_by_each(example: Example, amplitude_m: float, duration_s: float) -> list[Array]:
    """What each of the example's swings tells of the inertia, (9, 9) each."""
    model = build_model(example.robot)
    motions = swings(example, model, amplitude_m, duration_s)
    return [normal_equations(example, motion)[0] for motion in motions]


@cache
def speeds(example: Example, amplitude_m: float) -> tuple[float, float]:
    """Root mean square and greatest speed of P over the swings, m/s."""
    model = build_model(example.robot)
    times = np.arange(0.0, DURATION_S, 0.01)
    rates = [
        np.linalg.norm(m.at(times)[1][:, :3], axis=1) for m in swings(example, model, amplitude_m)
    ]
    joined = np.concatenate(rates)
    return float(np.sqrt(np.mean(joined**2))), float(joined.max())


def in_words(errors: Array, inertia: Array) -> tuple[str, str]:
    """The centre of mass' error in mm and the moments' in per cent of their values (rms)."""
    com = 1e3 * float(np.linalg.norm(errors[:3]))
    share = 100.0 * float(np.sqrt(np.mean((errors[3:6] / inertia[3:6]) ** 2)))
    return f"{com:.2g} mm", f"{share:.2g} %"


def pose_std(distance_m: float, tag_m: float, apart_rad: float | None, corner_px: float) -> Array:
    """Standard deviations of one instant's pose from four tags on a sheet, (6,), m and rad.

    Args:
        distance_m: of the cameras.
        tag_m: side of a tag; the sheet is as `freeswing new` prints it.
        apart_rad: angle between two cameras; None: one camera.
        corner_px: standard deviation of a corner.
    """
    half = 0.5 * tag_m * np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]])
    at = 0.625 * tag_m * np.array([[-1, 1], [1, 1], [-1, -1], [1, -1]])
    corners = np.zeros((16, 3))
    corners[:, :2] = (at[:, None] + half).reshape(-1, 2)
    angles = (0.0,) if apart_rad is None else (-0.5 * apart_rad, 0.5 * apart_rad)
    told = np.zeros((6, 6))
    for angle in angles:
        slope = _by_pose(_phone(distance_m, angle), corners) / corner_px
        told += slope.T @ slope
    return np.sqrt(np.diag(np.linalg.inv(told)))


FOCAL_PX = 1500.0  # a phone's main lens at 1920 x 1080


def _phone(distance_m: float, angle_rad: float) -> Camera:
    """A phone that looks at the origin from the front, moved round by an angle."""
    turn = exp_rotation(np.array([0.0, angle_rad, 0.0])) @ np.diag([1.0, -1.0, -1.0])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, [0.0, 0.0, distance_m]
    lens = np.array([FOCAL_PX, FOCAL_PX, 959.5, 539.5])
    return Camera("phone", (1920, 1080), "PINHOLE", lens, pose)


def _by_pose(camera: Camera, corners: Array) -> Array:
    """Derivatives of the corners' pixels by shift and turn of the sheet, (32, 6)."""
    step = 1e-6

    def pixels(change: Array) -> Array:
        moved = corners @ exp_rotation(change[3:]).T + change[:3]
        return np.asarray(camera.project(camera.to_camera(moved))).reshape(-1)

    columns = [(pixels(step * unit) - pixels(-step * unit)) / (2.0 * step) for unit in np.eye(6)]
    return np.stack(columns, axis=1)


def sag_cost(
    distance_m: float, tag_m: float, apart_rad: float, sag_m: float
) -> tuple[float, float]:
    """How far a sheet that is bent like a tube moves the frame that is found: m and rad.

    Its left and right edges stand off by `sag_m`, the fit takes the corners for flat.
    """
    half = 0.5 * tag_m * np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]])
    at = 0.625 * tag_m * np.array([[-1, 1], [1, 1], [-1, -1], [1, -1]])
    flat = np.zeros((16, 3))
    flat[:, :2] = (at[:, None] + half).reshape(-1, 2)
    edge = np.abs(flat[:, 0]).max()
    bent = flat + np.stack([np.zeros(16), np.zeros(16), sag_m * (flat[:, 0] / edge) ** 2], axis=1)
    cameras = [_phone(distance_m, angle) for angle in (-0.5 * apart_rad, 0.5 * apart_rad)]
    slopes = np.concatenate([_by_pose(camera, flat) for camera in cameras])
    seen = np.concatenate(
        [
            (
                camera.project(camera.to_camera(bent)) - camera.project(camera.to_camera(flat))
            ).ravel()
            for camera in cameras
        ]
    )
    change = np.linalg.lstsq(slopes, seen, rcond=None)[0]
    return float(np.linalg.norm(change[:3])), float(np.linalg.norm(change[3:]))


def corner_error(side_px: float, views: int = 12) -> tuple[float, float]:
    """Share of rendered tags that are found, and their corners' error, rms a coordinate in px.

    Args:
        side_px: side of the tag in the picture.
        views: how many, each turned and shifted by chance.
    """
    from freeswing.calib.tags.corners import lens_rays
    from freeswing.cdpr.measured.target import Tag
    from freeswing.vision.look.detect import TagFinder, detect_tags
    from freeswing.vision.render.patterns import tag_patch
    from freeswing.vision.render.render_scene import Look, Renderer, Scene, still

    generator = np.random.default_rng(7)
    tag_m, focal, size = 0.1, 400.0, (240, 180)
    lens = np.array([focal, focal, 119.5, 89.5])
    camera = Camera("cam", size, "PINHOLE", lens, np.eye(4))
    key, errors = ("tag36h11", 0), []
    for view in range(views):
        pose = np.eye(4)
        turn = exp_rotation(generator.uniform(-0.5, 0.5, 3))
        pose[:3, :3] = turn @ np.diag([1.0, -1.0, -1.0])
        depth = focal * tag_m / side_px
        pose[:3, 3] = [*(depth / focal * generator.uniform(-2.0, 2.0, 2)), depth]
        scene = Scene((tag_patch(*key, tag_m, pose, "base"),), still())
        image = Renderer(camera, scene, Look(), view).frame(0.0)
        found = detect_tags(image, camera, lens_rays(camera), [key], TagFinder.of([key]))
        if key in found:
            true = Tag(*key, tag_m, pose).corners_platform_m
            errors.append(focal * (found[key].rays - true[:, :2] / true[:, 2:]))
    share = len(errors) / views
    return share, float(np.sqrt(np.mean(np.square(errors)))) if errors else float("nan")
