"""Films of a trifilar bench from above; its motion comes from the independent simulator."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from freeswing.calib.camera.camera import Camera
from freeswing.cdpr.measured.target import Marker, Tag, Target, write_target
from freeswing.cdpr.rotation import angles_from_matrix, matrix_from_angles, matrix_from_quaternion
from freeswing.vision.look.video import write_video
from freeswing.vision.render.patterns import Patch, Sphere, tag_patch
from freeswing.vision.render.render_scene import Look, Motion, Renderer, Scene
from tests.oracle.recorded.benches import RADIUS_M, bench_swing
from tests.vision.scenes import look_at

RATE_HZ = 30.0
TAG_M, TAG_AT_M = 0.12, (0.1, 0.04, 0.02)
DOTS_M = ((-0.15, 0.02, 0.01), (0.16, -0.03, 0.01))


def bench_motion(seed: int, span_s: float, kind: str = "tare", wires: int = 3) -> Motion:
    """A swing of the oracle's bench, by splines of its samples."""
    told = bench_swing(wires, kind, np.random.default_rng(seed), span_s, 100.0)
    angles = np.unwrap(angles_from_matrix(matrix_from_quaternion(told.quaternions)), axis=0)
    place, turn = CubicSpline(told.times_s, told.positions_m), CubicSpline(told.times_s, angles)
    return lambda times_s: (place(times_s), matrix_from_angles(turn(times_s)))


def true_coordinates(motion: Motion, times_s: np.ndarray) -> np.ndarray:
    """x, y, chi from their means, (n, 3)."""
    positions, rotations = motion(times_s)
    found = np.column_stack([positions[:, :2], angles_from_matrix(rotations)[:, 2]])
    return found - found.mean(axis=0)


def phone(moved_m: float = 0.0) -> Camera:
    """A phone above the bench, leaning by seven degrees; its lens bends a little."""
    params = [350.0, 350.0, 201.0, 148.0, -0.05, 0.02, 0.0, 0.0]
    pose = look_at((0.08 + moved_m, -0.15, 1.2), (0.02 + moved_m, 0.0, 0.0), up=(0, 1, 0))
    return Camera("phone", (400, 300), "OPENCV", np.array(params), pose)


def phone_below(moved_m: float = 0.0) -> Camera:
    """The same phone on the floor, looking up."""
    pose = look_at((0.08 + moved_m, -0.15, -1.2), (0.02 + moved_m, 0.0, 0.0), up=(0, 1, 0))
    return replace(phone(), T_camera_base=pose)


def known_dots() -> tuple[Marker, ...]:
    """Three dots whose places are measured: no two of their distances alike."""
    places = (*DOTS_M, (0.02, 0.13, 0.01))
    return tuple(Marker(f"dot{k}", np.array(at), 0.016) for k, at in enumerate(places))


def plate_tag(tag_id: int = 3, size_m: float = TAG_M, at_m: Sequence[float] = TAG_AT_M) -> Tag:
    """A tag flat on the platform, facing up."""
    pose = np.eye(4)
    pose[:3, 3] = at_m
    return Tag("tag36h11", tag_id, size_m, pose)


def patches(tags: Sequence[Tag]) -> tuple[Patch, ...]:
    """The tags as printed."""
    return tuple(tag_patch(t.family, t.id, t.size_m, t.T_platform_tag, "platform") for t in tags)


def bright_dots() -> tuple[Sphere, ...]:
    """Two white balls on the platform."""
    return tuple(Sphere(np.array(at), 0.016) for at in DOTS_M)


def film(
    folder: Path,
    motion: Motion,
    span_s: float,
    tags: Sequence[Tag] = (),
    knocked_s: float | None = None,
    spheres: Sequence[Sphere] = (),
    camera: Callable[[float], Camera] = phone,
) -> None:
    """`phone.mkv` with presentation times; with `knocked_s` the phone is moved by 8 mm then."""
    stamps = np.arange(int(span_s * RATE_HZ)) / RATE_HZ
    scene = Scene(patches(tags), motion, tuple(spheres))
    look = Look(noise=2.0, subpixels=2, background=60.0 if spheres else 110.0)
    before, after = (Renderer(camera(m), scene, look, 3) for m in (0.0, 0.008))
    frames = (
        (after if knocked_s is not None and stamp > knocked_s else before).frame(stamp, k)
        for k, stamp in enumerate(stamps)
    )
    folder.mkdir(parents=True, exist_ok=True)
    write_video(folder / "phone.mkv", frames, stamps)


def write_bench(
    folder: Path,
    runs: Sequence[str],
    tags: Sequence[Tag] = (),
    mass_kg: float = 1.26,
    dots: Sequence[Marker] = (),
    wires: int = 3,
) -> None:
    """session.toml, robot.toml and target.toml of filmed runs."""
    if tags or dots:
        write_target(folder / "target.toml", Target(tuple(tags), tuple(dots)))
    lines = ['format = "freeswing-session/1"', 'name = "above"', 'robot = "robot.toml"']
    lines += ['target = "target.toml"'] if tags or dots else []
    lines += ["planar = true"]
    for run in runs:
        lines += ["", "[[runs]]", f'name = "{run}"', 'role = "identify"', f'video = "runs/{run}"']
        lines += [f"cable_lengths_m = {[1.2] * wires}", "cable_lengths_std_m = 0.001"]
    (folder / "session.toml").write_text("\n".join([*lines, ""]))
    lines = ['format = "freeswing-robot/1"', 'name = "plate"']
    free = '"x", "y", "chi"' if wires == 3 else '"x", "y", "phi", "chi"'
    lines += [f"free_coordinates = [{free}]", "", "[platform]", f"mass_kg = {mass_kg}"]
    for k in range(wires):
        angle = 2.0 * np.pi * k / wires
        x, y = RADIUS_M[wires] * np.cos(angle), RADIUS_M[wires] * np.sin(angle)
        lines += ["", "[[cables]]", f'name = "{k + 1}"', "pulley_radius_m = 0.0"]
        lines += [f"entry_m = [{x}, {y}, 1.2]", f"attachment_m = [{x}, {y}, 0.0]"]
    (folder / "robot.toml").write_text("\n".join([*lines, ""]))
