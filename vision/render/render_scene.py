"""Rendered recordings with known truth: moving tags, boards and markers through real lenses.

Geometry is exact: pixels see area-sampled planes through the camera's own distortion, each image
row at its own time (clock offset, rolling shutter) and averaged over the exposure. Everything is
decided by the seed. Each plane is blurred by itself: where one covers another, print within two
blur widths of the covering edge is a little too bright.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_models import normalise
from freeswing.vision.render.patterns import Patch, Sphere
from freeswing.vision.render.render_kernels import (
    Buffer,
    Plane,
    composite,
    expose,
    gathering_weights,
    sample_plane,
    sample_sphere,
)

if TYPE_CHECKING:
    from freeswing.cdpr.measured.trajectory import Trajectory

Array = NDArray[np.float64]
Motion = Callable[[Array], tuple[Array, Array]]
"""Base times (n,) in s -> platform positions (n, 3) in m and rotations (n, 3, 3)."""

_RIM_POINTS = 9
_NOISE_FRAMES = 3
_KEPT_LENSES = 4  # 5 MB each at 640 x 480: a recording's runs are seen through the same ones


@dataclass(frozen=True, slots=True)
class Look:
    """How the sensor sees: point spread, noise, grey levels and exposure.

    Attributes:
        psf_px: standard deviation of the Gaussian point spread.
        noise: standard deviation of the pixel noise, grey levels.
        black: grey level of reflectance 0.
        white: grey level of reflectance 1.
        background: mean grey level behind everything.
        texture: standard deviation of the background's static texture.
        exposure_s: shutter time, centred on the stamp.
        exposure_samples: instants averaged over the exposure.
        subpixels: samples to a pixel's side.
    """

    psf_px: float = 0.7
    noise: float = 2.0
    black: float = 40.0
    white: float = 200.0
    background: float = 110.0
    texture: float = 15.0
    exposure_s: float = 0.0
    exposure_samples: int = 3
    subpixels: int = 4


@dataclass(frozen=True, slots=True)
class Scene:
    """What there is to see: patches, spheres and the platform's motion."""

    patches: tuple[Patch, ...]
    motion: Motion
    spheres: tuple[Sphere, ...] = ()


def still(position_m: Array | None = None, rotation: Array | None = None) -> Motion:
    """A platform at rest."""
    place = np.zeros(3) if position_m is None else np.asarray(position_m, float)
    turn = np.eye(3) if rotation is None else np.asarray(rotation, float)

    def motion(times_s: Array) -> tuple[Array, Array]:
        count = len(times_s)
        return np.tile(place, (count, 1)), np.tile(turn, (count, 1, 1))

    return motion


def motion_of(trajectory: Trajectory) -> Motion:
    """The motion through a trajectory's samples, by cubic splines of its six coordinates."""
    from scipy.interpolate import CubicSpline

    from freeswing.cdpr.rotation import matrix_from_angles

    if not trajectory.is_pose:
        raise ValueError(f"rendering needs all six coordinates, got {trajectory.coordinates}")
    order = [trajectory.coordinates.index(c) for c in ("x", "y", "z", "phi", "theta", "chi")]
    spline = CubicSpline(trajectory.times_s, trajectory.values[:, order])

    def motion(times_s: Array) -> tuple[Array, Array]:
        values = spline(times_s)
        return values[:, :3], matrix_from_angles(values[:, 3:])

    return motion


class _Region(NamedTuple):
    """A part of the image: its first pixel, and how many there are."""

    left: int
    top: int
    columns: int
    rows: int


_NOWHERE = _Region(0, 0, 0, 0)


class _Sheet(NamedTuple):
    """What a patch's picture is made of: `Plane.light` and `cover`, its outline (n, 3)."""

    patch: Patch
    light: Array
    cover: Array
    rim_m: Array


@dataclass(slots=True)
class Renderer:
    """One camera's view of a scene; keeps what does not change between frames."""

    camera: Camera
    scene: Scene
    look: Look = field(default_factory=Look)
    seed: int = 0
    _rays: Array = field(init=False, repr=False)
    _weights: NDArray[np.float32] = field(init=False, repr=False)
    _noise: NDArray[np.float32] = field(init=False, repr=False)
    _still: NDArray[np.float32] = field(init=False, repr=False)
    _sheets: dict[int, _Sheet] = field(init=False, repr=False)
    _poses: dict[tuple[str, bytes], Array] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        width, height = self.camera.size_px
        self._rays = _rays_of(self.camera)
        self._sheets, self._poses = {}, {}
        self._weights = gathering_weights(self.look.psf_px, self.look.subpixels)
        random = self._random(-1)
        self._noise = random.standard_normal(_NOISE_FRAMES * width * height, dtype=np.float32)
        self._still = self._background(random)
        self._draw(self._still, [one for one in self._by_depth(0.0) if not _changes(one)], 0.0)

    def frame(self, stamp_s: float, index: int = 0) -> NDArray[np.uint8]:
        """The image stamped `stamp_s` by the camera's clock, (h, w); `index` picks the noise."""
        image = self._still.copy()
        self._poses.clear()
        time_s = stamp_s + self.camera.clock_offset_s
        patches = self._by_depth(time_s)
        shown = [one for one in patches if _changes(one) and _is_shown(one, time_s)]
        self._draw(image, shown, time_s)
        for sphere in self.scene.spheres:
            self._draw_sphere(image, sphere, time_s)
        start = int(self._random(index).integers(0, self._noise.size - image.size))
        return expose(image, self._noise, start, self.look.noise)

    def frames(self, stamps_s: Array) -> Iterator[NDArray[np.uint8]]:
        """All frames of a recording, one after the other."""
        for index, stamp in enumerate(stamps_s):
            yield self.frame(float(stamp), index)

    def _random(self, index: int) -> np.random.Generator:
        name = zlib.crc32(self.camera.name.encode())
        return np.random.default_rng([self.seed, name, index + 1])

    def _background(self, random: np.random.Generator) -> NDArray[np.float32]:
        """Smooth blotches about 24 pixels across, so that nothing is sharp but the targets."""
        width, height = self.camera.size_px
        coarse = random.standard_normal((height // 24 + 3, width // 24 + 3))
        rows = np.arange(height) / 24.0
        columns = np.arange(width) / 24.0
        r0, c0 = rows.astype(int), columns.astype(int)
        fr = _smooth(rows - r0)[:, None]
        fc = _smooth(columns - c0)[None, :]
        upper = coarse[r0][:, c0] * (1 - fc) + coarse[r0][:, c0 + 1] * fc
        lower = coarse[r0 + 1][:, c0] * (1 - fc) + coarse[r0 + 1][:, c0 + 1] * fc
        texture = upper * (1 - fr) + lower * fr
        grey = self.look.background + 1.5 * self.look.texture * texture
        return grey.astype(np.float32, order="C")  # kernels are compiled once an order

    def _by_depth(self, time_s: float) -> list[Patch]:
        def depth(patch: Patch) -> tuple[int, float]:
            parent = self._parents_in_camera(patch.parent, np.array([time_s]))[0]
            centre = parent @ patch.T_parent_patch[:, 3]
            return patch.layer, -math.hypot(centre[0], centre[1], centre[2])

        return sorted(self.scene.patches, key=depth)

    def _parents_in_camera(self, parent: str, times_s: Array) -> Array:
        """T_camera_parent at each time, (n, 4, 4); those of a frame are reckoned once."""
        known = parent, times_s.tobytes()
        if known not in self._poses:
            self._poses[known] = self._reckoned(parent, times_s)
        return self._poses[known]

    def _reckoned(self, parent: str, times_s: Array) -> Array:
        if parent == "base":
            return np.tile(self.camera.T_camera_base, (len(times_s), 1, 1))
        positions, rotations = self.scene.motion(times_s)
        poses = np.zeros((len(times_s), 4, 4))
        poses[:, :3, :3], poses[:, :3, 3], poses[:, 3, 3] = rotations, positions, 1.0
        np.matmul(self.camera.T_camera_base, poses.copy(), out=poses)
        return poses

    def _row_times(self, time_s: float, region: _Region, exposure: float) -> Array:
        if self.camera.line_time_s == 0.0:
            return np.array([time_s + exposure])
        rows = np.arange(region.top, region.top + region.rows, dtype=float)
        return time_s + exposure + self.camera.line_time_s * rows

    def _exposures(self, *, moves: bool) -> list[float]:
        count = self.look.exposure_samples if moves and self.look.exposure_s > 0.0 else 1
        return [self.look.exposure_s * ((k + 0.5) / count - 0.5) for k in range(count)]

    def _regions(self, points: Array, time_s: float, parent: str) -> list[_Region]:
        """Of each of some bodies, the buffer that holds its points (b, n, 3) of the parent."""
        middle = time_s + self.camera.line_time_s * self.camera.size_px[1] / 2
        spread = self.camera.line_time_s * self.camera.size_px[1] / 2
        reach = self.look.exposure_s / 2 + abs(spread)
        times = np.array([middle - reach, middle, middle + reach] if reach > 0.0 else [middle])
        poses = self._parents_in_camera(parent, times)
        inside = np.einsum("tij,bpj->btpi", poses[:, :3, :3], points) + poses[:, None, :3, 3]
        inside = inside.reshape(len(points), -1, 3)
        is_there = (inside[..., 2] > 0.0).all(axis=1) & self.camera.sees(inside).any(axis=1)
        pixels = self.camera.project(inside)
        pixels[~np.isfinite(pixels).all(axis=2)] = np.nan
        size, margin = np.array(self.camera.size_px), 2 * self._margin
        regions = [_NOWHERE] * len(points)
        for body in np.flatnonzero(is_there):
            low = np.clip(np.floor(np.nanmin(pixels[body], axis=0)) - 2, 0, size) - margin
            high = np.clip(np.ceil(np.nanmax(pixels[body], axis=0)) + 3, 0, size) + margin
            regions[body] = _Region(*low.astype(int).tolist(), *(high - low).astype(int).tolist())
        return regions

    @property
    def _margin(self) -> int:
        """Pixels on either side that the point spread gathers from."""
        return len(self._weights) // self.look.subpixels // 2

    def _buffer(self, region: _Region) -> Buffer | None:
        """An empty one; None where nothing is to be seen."""
        left, top, columns, rows = region
        if columns <= 2 * self._margin or rows <= 2 * self._margin:
            return None
        s = self.look.subpixels
        return Buffer(np.zeros((2, rows * s, columns * s), dtype=np.float32), left, top, s)

    def _draw(self, image: NDArray[np.float32], patches: Sequence[Patch], time_s: float) -> None:
        """Lays patches over the image, the first undermost."""
        where: dict[int, _Region] = {}
        for parent in {patch.parent for patch in patches}:
            some = [patch for patch in patches if patch.parent == parent]
            rims = np.stack([self._sheet(patch).rim_m for patch in some])
            where |= zip(map(id, some), self._regions(rims, time_s, parent), strict=True)
        for patch in patches:
            self._draw_patch(image, patch, time_s, where[id(patch)])

    def _draw_patch(
        self, image: NDArray[np.float32], patch: Patch, time_s: float, region: _Region
    ) -> None:
        buffer = self._buffer(region)
        if buffer is None:
            return
        sheet = self._sheet(patch)
        exposures = self._exposures(moves=patch.parent == "platform")
        for exposure in exposures:
            times = self._row_times(time_s, region, exposure)
            poses = self._parents_in_camera(patch.parent, times) @ patch.T_parent_patch
            if (np.einsum("ti,ti->t", poses[:, :3, 2], poses[:, :3, 3]) >= 0.0).any():
                return
            inverse = _per_row(
                np.asarray(np.linalg.inv(_cells_to_camera(poses, patch)), float), region.rows
            )
            buffer = sample_plane(Plane(sheet.light, sheet.cover, inverse), self._rays, buffer)
        composite(buffer, self._weights, 1.0 / len(exposures), image)

    def _sheet(self, patch: Patch) -> _Sheet:
        known = self._sheets.get(id(patch))
        if known is None or known.patch is not patch:
            span = self.look.white - self.look.black
            light = np.pad(self.look.black + span * patch.cells, 1)
            cover = np.pad(np.ones(patch.cells.shape), 1)
            known = self._sheets[id(patch)] = _Sheet(patch, light, cover, _rim(patch))
        return known

    def _draw_sphere(self, image: NDArray[np.float32], sphere: Sphere, time_s: float) -> None:
        around = sphere.position_m + sphere.diameter_m * 0.75 * np.vstack([np.eye(3), -np.eye(3)])
        region = self._regions(around[None], time_s, sphere.parent)[0]
        buffer = self._buffer(region)
        if buffer is None:
            return
        span = self.look.white - self.look.black
        grey = self.look.black + span * sphere.reflectance
        exposures = self._exposures(moves=sphere.parent == "platform")
        for exposure in exposures:
            times = self._row_times(time_s, region, exposure)
            poses = self._parents_in_camera(sphere.parent, times)
            centres = _per_row(poses[:, :3, :3] @ sphere.position_m + poses[:, :3, 3], region.rows)
            buffer = sample_sphere(grey, centres, sphere.diameter_m / 2, self._rays, buffer)
        composite(buffer, self._weights, 1.0 / len(exposures), image)


def _rays_of(camera: Camera) -> Array:
    """The undistorted pixels of a camera, (h, w, 2)."""
    return _rays(camera.model, camera.size_px, tuple(camera.params.tolist()))


@lru_cache(maxsize=_KEPT_LENSES)
def _rays(model: str, size_px: tuple[int, int], params: tuple[float, ...]) -> Array:
    pixels = np.stack(np.meshgrid(np.arange(size_px[0]), np.arange(size_px[1])), axis=-1)
    return normalise(model, pixels.astype(float), np.array(params))


def _per_row(values: Array, rows: int) -> Array:
    """One value an image row, from as many or from a single one."""
    # A copy: kernels would be compiled once more for a read-only view.
    return np.array(np.broadcast_to(values, (rows, *values.shape[1:])), np.float64, order="C")


def _changes(patch: Patch) -> bool:
    return patch.parent == "platform" or patch.shown_s is not None


def _is_shown(patch: Patch, time_s: float) -> bool:
    return patch.shown_s is None or any(a <= time_s < b for a, b in patch.shown_s)


def _smooth(fraction: Array) -> Array:
    return fraction * fraction * (3.0 - 2.0 * fraction)


def _rim(patch: Patch) -> Array:
    """Points along the patch's outline in the parent frame, (n, 3)."""
    along = np.linspace(-0.5, 0.5, _RIM_POINTS)
    ends = np.full(_RIM_POINTS, 0.5)
    x = np.concatenate([along, along, ends, -ends]) * patch.size_m[0]
    y = np.concatenate([ends, -ends, along, along]) * patch.size_m[1]
    local = np.stack([x, y, np.zeros_like(x), np.ones_like(x)], axis=-1)
    return (local @ patch.T_parent_patch.T)[:, :3]


def _cells_to_camera(poses: Array, patch: Patch) -> Array:
    """(column, row, 1) of a patch's cells to camera coordinates, (n, 3, 3)."""
    rows, columns = patch.cells.shape
    width, height = patch.size_m
    right, down = poses[:, :3, 0] * width, -poses[:, :3, 1] * height
    origin = poses[:, :3, 3] - right / 2 - down / 2
    return np.stack([right / columns, down / rows, origin], axis=-1)
