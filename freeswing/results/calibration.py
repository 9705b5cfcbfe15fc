"""results/calibration.json: how well the cameras, their clocks and the base frame are known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from freeswing.results.codec import Document, Entry, Numbers, absent, empty, entry


@entry
class Trust(Entry):
    """Whether the calibration may be used, why not, and what to know."""

    usable: bool = True
    reasons: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


@entry
class CalibratedCamera(Entry):
    """One camera: values, standard deviations and residuals; poses as cameras.toml has them."""

    name: str = ""
    size_px: Numbers = ()
    model: str = ""
    params: Numbers = ()
    q_camera_base: Numbers = ()
    t_camera_base_m: Numbers = ()
    clock_offset_s: float | None = None
    line_time_s: float | None = None
    views: int | None = None
    dropped_views: int | None = None
    corners: int | None = None
    corner_noise_px: float | None = None
    reprojection_px: float | None = None
    params_std: Numbers = ()
    position_std_m: Numbers = ()
    rotation_std_rad: Numbers = ()
    clock_offset_std_s: float | None = None
    line_time_std_s: float | None = None
    frames: int | None = None
    frames_with_board: int | None = None
    held_out_px: float | None = None
    alone_px: float | None = None
    coverage: float | None = None
    tilt_deg: float | None = None
    focal_std: float | None = None
    lens_models_held_out_px: Mapping[str, float | None] = empty(default_factory=dict)


@entry
class Checks(Entry):
    """Comparisons with lengths that are known, and of the footage with itself."""

    length_bias: float | None = absent(default=None)
    length_rms_m: float | None = absent(default=None)
    lengths: int | None = absent(default=None)
    halves_rms_m: float | None = absent(default=None)
    halves_shape_rms_m: float | None = absent(default=None)
    volume_std_m: float | None = absent(default=None)
    volume_size_m: Numbers | None = absent(default=None)
    deviations_grown: float | None = absent(default=None)
    survey_points: int | None = absent(default=None)
    survey_scale: float | None = absent(default=None)
    survey_rms_m: float | None = absent(default=None)
    survey_mirrored_rms_m: float | None = absent(default=None)


@entry
class Vertical(Entry):
    """The plumb line against the declared gravity: agrees, differs or inconsistent."""

    verdict: str = ""
    sentence: str = ""


@entry
class BesideColmap(Entry):
    """One camera by COLMAP's bundle adjustment less the same by ours."""

    camera: str = ""
    focal: float | None = None
    focal_std: float | None = None
    centre_px: float | None = None
    place_mm: float | None = None
    turn_mrad: float | None = None
    agrees: bool = True


@entry
class Covariance(Entry):
    """Joint covariance of all cameras' parameters."""

    tangent: str = ""
    names: tuple[str, ...] = ()
    matrix: tuple[Numbers, ...] = ()


@entry
class BaseFrame(Entry):
    """Where the base frame comes from, and how well base tags hold it."""

    source: str = absent(default="")
    tags: tuple[str, ...] = absent(default=())
    survey_std_m: float | None = absent(default=None)
    reprojection_px: float | None = absent(default=None)


@entry
class CalibratedBoard(Entry):
    """The board, and how it differs from its drawing."""

    kind: str = absent(default="")
    points: int = absent(default=0)
    warp_m: Numbers = absent(default=())


@entry
class TiedTag(Entry):
    """Where a tag of the platform sits, and where target.toml had it; TL TR BR BL."""

    family: str = ""
    id: int | None = None
    mismatch_mm: float | None = None
    std_mm: float | None = None
    corners_platform_m: tuple[Numbers, ...] = ()
    target_corners_m: tuple[Numbers, ...] = ()


@entry
class TiedLayout(Entry):
    """The platform's tags that cameras were tied by; `covariance` with the cameras' numbers."""

    worst_mismatch_mm: float | None = None
    tags: tuple[TiedTag, ...] = ()
    covariance: Covariance | None = absent(default=None)


@entry
class Adjustment(Entry):
    """How the bundle adjustment went; the condition is null where the rank does not suffice."""

    stop: str = absent(default="")
    iterations: int | None = absent(default=None)
    unknowns: int | None = absent(default=None)
    rank: int | None = absent(default=None)
    condition: float | None = absent(default=0.0)


@entry
class Calibration(Document):
    """What `freeswing calibrate` found.

    Attributes:
        verdict: whether it may be used.
        base_frame: where the base frame comes from.
        cameras: each.
        checks: against truth.
        moments: instants at which the board was seen.
        board: its kind, points and bend.
        dropped_views: sentences on views left out.
        trimmed_corners: how many corners were.
        adjustment: how the fit went.
        covariance: of all cameras together.
        vertical: the plumb line, where there was one.
        beside_colmap: each camera by COLMAP, where that was asked for.
        layout: of the platform's tags, where these tie the cameras.
    """

    kind: ClassVar[str] = "calibration"

    verdict: Trust | None = None
    base_frame: BaseFrame = empty(default_factory=BaseFrame)
    cameras: tuple[CalibratedCamera, ...] = ()
    checks: Checks | None = None
    moments: int | None = None
    board: CalibratedBoard = empty(default_factory=CalibratedBoard)
    dropped_views: tuple[str, ...] = ()
    trimmed_corners: int | None = None
    adjustment: Adjustment = empty(default_factory=Adjustment)
    covariance: Covariance | None = None
    vertical: Vertical | None = absent(default=None)
    beside_colmap: tuple[BesideColmap, ...] = absent(default=())
    layout: TiedLayout | None = absent(default=None)
