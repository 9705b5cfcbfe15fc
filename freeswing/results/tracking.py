"""results/tracking.json: how the cameras agree on the platform, run by run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from freeswing.results.codec import Document, Entry, Numbers, absent, empty, entry
from freeswing.results.common import FoundEffect


@entry
class Outlier(Entry):
    """A tag or marker whose sightings were left out: how often, from when, how far off."""

    what: str = ""
    count: int | None = None
    first_frame: int | None = None
    worst_px: float | None = None


@entry
class CameraShare(Entry):
    """One camera's part in one run; `outliers` are things that disagreed with the rest."""

    camera: str
    frames_seen: int | None = None
    frames_used: int | None = None
    frames_rejected: Mapping[str, int | None] = empty(default_factory=dict)
    frames_dropped: int | None = None
    sightings_used: int | None = None
    reprojection_px: float | None = None
    beyond_pixel_noise_px: float | None = None
    consistency_mm: float | None = None
    outliers: tuple[Outlier, ...] = ()


@entry
class PlanarView(Entry):
    """The plane of a run by one camera from above.

    Attributes:
        place_m: the platform's point whose x and y the track gives.
        lens_known: whether cameras.toml had the lens.
        focal_px: of the lens, known or fitted.
        focal_std_px: zero where it was known.
        distance_m: of the plane along the optical axis.
        lean_rad: of the plane's normal from the optical axis.
        lean_std_rad: likewise.
        systematic_std_mm: what plane and lens leave open of x and y, at most.
        systematic_std_mrad: the same of chi.
    """

    place_m: tuple[float, ...] = ()
    lens_known: bool = False
    focal_px: float | None = None
    focal_std_px: float | None = None
    distance_m: float | None = None
    lean_rad: float | None = None
    lean_std_rad: float | None = None
    systematic_std_mm: float | None = None
    systematic_std_mrad: float | None = None


@entry
class TrackedRun(Entry):
    """One tracked run.

    Attributes:
        run: its name.
        samples: time steps.
        known: those with a pose.
        rate_hz: of the samples.
        position_std_mm: scatter of single poses.
        rotation_std_mrad: likewise.
        calibration_std_mm: how far the calibration may shift all of them together.
        calibration_std_mrad: likewise.
        reprojection_px: over all cameras.
        consistency_mm: each camera's rays beside the platform that all agree on.
        cameras: each.
        problems: sentences.
        calibration_errors: how the calibration may shift the poses.
        planar: the plane, where one camera from above gave x, y and chi.
    """

    run: str
    samples: int | None = None
    known: int | None = None
    rate_hz: float | None = None
    position_std_mm: float | None = None
    rotation_std_mrad: float | None = None
    calibration_std_mm: float | None = None
    calibration_std_mrad: float | None = None
    reprojection_px: float | None = None
    consistency_mm: float | None = None
    cameras: tuple[CameraShare, ...] = ()
    problems: tuple[str, ...] = ()
    calibration_errors: Any = None
    planar: PlanarView | None = absent(default=None)


@entry
class TagPlace(Entry):
    """Where a tag sits against target.toml."""

    family: str = ""
    id: int | None = None
    mismatch_mm: float | None = None
    std_mm: float | None = None
    corners_platform_m: tuple[Numbers, ...] = ()


@entry
class Layout(Entry):
    """The places of all tags; refined where the track uses the fitted ones."""

    refined: bool = False
    worst_mismatch_mm: float | None = None
    tags: tuple[TagPlace, ...] = ()


@entry
class Tracking(Document):
    """What `freeswing track` found."""

    kind: ClassVar[str] = "tracking"

    runs: tuple[TrackedRun, ...] = ()
    layout: Layout | None = absent(default=None)
    effects: tuple[FoundEffect, ...] = ()
