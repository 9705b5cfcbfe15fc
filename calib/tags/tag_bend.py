"""What fitting a tag in plain pixels gets wrong because the tag is bent in the image.

Before the lens is known a tag's pattern is fitted with a homography (`calib.board.board_corners`),
which no lens keeps, nor a rolling shutter before which the tag turns: corners come out up to some
thousandths of a pixel off, those of all tags to the same side, so that no number of views averages
it away. Once lens, pose and motion are known the error follows from geometry. The fit moves its
pattern until the distances between its edges and the seen ones, each along the edge's normal, are
smallest in the least-squares sense; small homographies of the image plane span what it can do,

    (1, 0) (x, 0) (y, 0) (0, 1) (0, x) (0, y) (x^2, xy) (xy, y^2),

so that eight linear equations a tag give what it did to the corners.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from freeswing.calib.board.circle_grid_corners import circle_bias
from freeswing.calib.board.declared_board import CIRCLES, Board
from freeswing.calib.board.motion_pieces import boards_at
from freeswing.calib.board.platform_as_board import PlatformTags
from freeswing.calib.camera.camera import Camera
from freeswing.calib.camera.lens_kernels import WITH_SLOPES, WITHOUT_SLOPES, lens_point
from freeswing.calib.camera.lens_models import FISHEYE, Array, full_parameters
from freeswing.calib.rig.reprojection import Scene
from freeswing.calib.rig.views import Views
from freeswing.calib.tags.corners import rimmed_cells
from freeswing.cdpr.compiled.kernels import kernel
from freeswing.cdpr.elimination import eliminate
from freeswing.cdpr.rotation import log_rotation


def straightened(
    scene: Scene,
    views: Views,
    board: Board,
    border_cells: Sequence[int],
    platform: PlatformTags | None = None,
) -> Views:
    """The views with the corners put right for what lens and rolling shutter do to each tag.

    Args:
        scene: lenses, poses, clocks and the board's motion, nearly right.
        views: as detected.
        board: the board.
        border_cells: width of its tags' borders as each camera's detector found it.
        platform: tags whose corners are the last points of the views.
    """
    pixels = views.pixels.copy()
    for index, camera in enumerate(scene.cameras):
        own = np.flatnonzero(views.camera == index)
        if board.kind == "chessboard" or not len(own):
            continue
        some = views.select(own)
        rows = np.nanmean(some.pixels[..., 1], axis=1)
        times = some.lag_s + camera.clock_offset_s + rows * camera.line_time_s
        step = 1e-3 * scene.motion_scale_s
        poses, before, after = (
            camera.T_camera_base @ boards_at(scene, some.piece, times + shift)
            for shift in (0.0, -step, step)
        )
        if board.kind in CIRCLES:
            bias = circle_bias(camera, board.points_m, board.marker_m, poses)
            pixels[own, : bias.shape[1]] -= np.nan_to_num(bias)
            continue
        shift = after[:, :3, 3] - before[:, :3, 3]
        turn = log_rotation(after[:, :3, :3] @ np.swapaxes(before[:, :3, :3], 1, 2))
        twists = np.concatenate([shift, turn], axis=1) / (2.0 * step)
        pixels[own] -= _board_bias(camera, board, border_cells[index], some, poses, twists)
        if platform is not None:
            pixels[own] -= _platform_bias(camera, platform, some, poses, twists)
    return replace(views, pixels=pixels)


def _board_bias(
    camera: Camera, board: Board, border_cells: int, views: Views, poses: Array, twists: Array
) -> Array:
    """`fit_bias` of all tags seen in one camera's views, zero elsewhere, (n, n_points, 2)."""
    bias = np.zeros_like(views.pixels)
    for tag in range(board.n_tags):
        own = slice(4 * tag, 4 * tag + 4)
        edges = pattern_edges(board.dictionary, tag, border_cells, board.kind == "aprilgrid")
        seen = np.isfinite(views.pixels[:, own, 0]).all(axis=1)
        bias[seen, own] = fit_bias(camera, board.points_m[own], poses[seen], edges, twists[seen])
    return bias


def _platform_bias(
    camera: Camera, platform: PlatformTags, views: Views, poses: Array, twists: Array
) -> Array:
    """`fit_bias` of the platform's tags, zero elsewhere, (n, n_points, 2)."""
    bias = np.zeros_like(views.pixels)
    corners = platform.points_m.reshape(-1, 4, 3)
    first = bias.shape[1] - 4 * len(corners)
    for k, (family, number) in enumerate(platform.names):
        own = slice(first + 4 * k, first + 4 * k + 4)
        edges = pattern_edges(family, number, 1, False)
        seen = np.isfinite(views.pixels[:, own, 0]).all(axis=1)
        bias[seen, own] = fit_bias(camera, corners[k], poses[seen], edges, twists[seen])
    return bias


def fit_bias(
    camera: Camera,
    corners_m: Array,
    T_camera_boards: Array,
    edges: Array,
    twists: Array,
) -> Array:
    """Fitted minus true corners of a tag in plain pixels, (n, 4, 2).

    Args:
        camera: the lens, and its line time.
        corners_m: the tag's corners TL TR BR BL, a parallelogram in the board's frame, (4, 3).
        T_camera_boards: poses, (n, 4, 4).
        edges: `pattern_edges` of the tag, (m, 4).
        twists: velocity of the board's origin and turning rate in the camera's axes, (n, 6).

    Source:
        Press et al. 2007, Numerical Recipes, sec. 15.4: eight linear equations a tag, as
        the module derives them.
    """
    across, down = corners_m[1] - corners_m[0], corners_m[3] - corners_m[0]
    return _biases(
        camera.model == FISHEYE,
        full_parameters(camera.model, camera.params),
        np.ascontiguousarray(T_camera_boards),
        np.ascontiguousarray(twists * camera.line_time_s),
        corners_m[0] + edges[:, :1] * across + edges[:, 1:2] * down,
        edges[:, 2:3] * across + edges[:, 3:] * down,
        np.ascontiguousarray(edges[:, :2]),
        np.ascontiguousarray(corners_m),
    )


@kernel
def _exposed(
    is_fisheye: bool,
    full: Array,
    arm: Array,
    origin: Array,
    drift: Array,
    middle_row: float,
    pixel: Array,
    d_point: Array,
    d_full: Array,
) -> None:
    """Pixel of a board point whose row is exposed while the board drifts (shift, turn) a row."""
    place = arm + origin
    lens_point(is_fisheye, full, place, WITH_SLOPES, pixel, d_point, d_full)
    for _ in range(2 if np.any(drift != 0.0) else 0):
        rows = pixel[1] - middle_row
        place[0] = arm[0] + origin[0] + rows * (drift[0] + drift[4] * arm[2] - drift[5] * arm[1])
        place[1] = arm[1] + origin[1] + rows * (drift[1] + drift[5] * arm[0] - drift[3] * arm[2])
        place[2] = arm[2] + origin[2] + rows * (drift[2] + drift[3] * arm[1] - drift[4] * arm[0])
        lens_point(is_fisheye, full, place, WITH_SLOPES, pixel, d_point, d_full)


@kernel
def _fields(x: float, y: float, across: float, down: float, row: Array) -> None:
    """How eight small homographies move the point (x, y) along (across, down), (8,)."""
    row[0], row[1], row[2] = across, across * x, across * y
    row[3], row[4], row[5] = down, down * x, down * y
    lean = across * x + down * y
    row[6], row[7] = lean * x, lean * y


@kernel
def _biases(
    is_fisheye: bool,
    full: Array,
    poses: Array,
    drifts: Array,
    middles: Array,
    directions: Array,
    places: Array,
    corners: Array,
) -> Array:
    result = np.zeros((len(poses), 4, 2))
    d_point, d_full = np.empty((2, 3)), np.empty((2, 12))
    seen, at = np.empty((4, 2)), np.empty(2)
    row = np.empty(8)
    for v in range(len(poses)):
        turn = np.ascontiguousarray(poses[v, :3, :3].T)
        origin, drift = np.ascontiguousarray(poses[v, :3, 3]), drifts[v]
        four, placed = np.dot(corners, turn), np.dot(middles, turn)
        arms = np.dot(directions, turn)
        middle = 0.5 * (four[0] + four[2]) + origin
        lens_point(is_fisheye, full, middle, WITHOUT_SLOPES, at, d_point, d_full)
        row_at = at[1]
        for k in range(4):
            _exposed(is_fisheye, full, four[k], origin, drift, row_at, seen[k], d_point, d_full)
        u0, v0 = seen[:, 0].mean(), seen[:, 1].mean()
        span = max(np.abs(seen[:, 0] - u0).max(), np.abs(seen[:, 1] - v0).max())
        h = _from_unit_square(seen)
        normal, right = np.zeros((8, 8)), np.zeros(8)
        for e in range(len(middles)):
            _exposed(is_fisheye, full, placed[e], origin, drift, row_at, at, d_point, d_full)
            d, arm = d_point, arms[e]
            along = d[0, 0] * arm[0] + d[0, 1] * arm[1] + d[0, 2] * arm[2]
            aside = d[1, 0] * arm[0] + d[1, 1] * arm[1] + d[1, 2] * arm[2]
            size = math.sqrt(along * along + aside * aside)
            nu, nv = -aside / size, along / size
            w = 1.0 / (h[2, 0] * places[e, 0] + h[2, 1] * places[e, 1] + 1.0)
            u = (h[0, 0] * places[e, 0] + h[0, 1] * places[e, 1] + h[0, 2]) * w
            q = (h[1, 0] * places[e, 0] + h[1, 1] * places[e, 1] + h[1, 2]) * w
            bent = nu * (at[0] - u) + nv * (at[1] - q)
            _fields((at[0] - u0) / span, (at[1] - v0) / span, nu, nv, row)
            for i in range(8):  # an edge counts by its length in the image
                weighted = size * row[i]
                right[i] += weighted * bent
                for j in range(i, 8):
                    normal[i, j] += weighted * row[j]
        for i in range(8):
            for j in range(i):
                normal[i, j] = normal[j, i]
        change = eliminate(normal, right.reshape(-1, 1))
        for k in range(4):
            x, y = (seen[k, 0] - u0) / span, (seen[k, 1] - v0) / span
            for axis in range(2):
                _fields(x, y, 1.0 - axis, float(axis), row)
                for i in range(8):
                    result[v, k, axis] += row[i] * change[i, 0]
    return result


@kernel
def _from_unit_square(image: Array) -> Array:
    """Homography that takes (0, 0) (1, 0) (1, 1) (0, 1) to four image points (4, 2)."""
    sx = image[0, 0] - image[1, 0] + image[2, 0] - image[3, 0]
    sy = image[0, 1] - image[1, 1] + image[2, 1] - image[3, 1]
    ax, ay = image[1, 0] - image[2, 0], image[1, 1] - image[2, 1]
    bx, by = image[3, 0] - image[2, 0], image[3, 1] - image[2, 1]
    determinant = ax * by - bx * ay
    g, h = (sx * by - bx * sy) / determinant, (ax * sy - sx * ay) / determinant
    matrix = np.ones((3, 3))
    for i in range(2):
        matrix[i, 0] = image[1, i] - image[0, i] + g * image[1, i]
        matrix[i, 1] = image[3, i] - image[0, i] + h * image[3, i]
        matrix[i, 2] = image[0, i]
    matrix[2, 0], matrix[2, 1] = g, h
    return matrix


@lru_cache(maxsize=2048)
def pattern_edges(family: str, tag: int, border_cells: int, corner_squares: bool) -> Array:
    """Middles and directions of the edges between black and white cells, border at 0 ... 1.

    (m, 4): x, y to the right and down in units of the tag's side, and the edge itself, one row a
    cell's edge.

    Source:
        Olson 2011, AprilTag: A Robust and Flexible Visual Fiducial System, sec. 4: the
        cells.
    """
    cells = rimmed_cells(family, tag, border_cells, corner_squares=corner_squares)
    side = len(cells) - 2
    rows, columns = np.nonzero(np.diff(cells, axis=1))
    upright = np.stack([columns, rows - 0.5, 0.0 * rows, 0.0 * rows + 1.0], axis=-1)
    rows, columns = np.nonzero(np.diff(cells, axis=0))
    level = np.stack([columns - 0.5, rows, 0.0 * rows + 1.0, 0.0 * rows], axis=-1)
    edges = np.concatenate([upright, level]) / side
    edges.flags.writeable = False
    return edges
