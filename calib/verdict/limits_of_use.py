"""From which numbers on a calibration warns, and from which it may not be used."""

from __future__ import annotations

from dataclasses import dataclass

# Six unknowns of a lens and six of each view's pose: six views of 20 corners determine them, but
# any one bad view moves all; with a dozen, one can be left out.
LEAST_VIEWS = 6
GOOD_VIEWS = 12
# Focal length and distance are told apart by foreshortening, whose share is 1 - cos(tilt): 1.5 %
# at 10 degrees, as little as corner noise over a small board; 9 % at 25.
LEAST_TILT_DEG = 10.0
GOOD_TILT_DEG = 25.0
# Of the image, in cells of a 4 x 4 grid's area: distortion is only known where a board was seen.
# A tenth is two cells; a third reaches every direction from the centre.
LEAST_FILLED = 0.12
GOOD_FILLED = 0.35
# Of the focal length. One camera's depth errs by as much: at 2 m, 2 % are 40 mm, as much as a whole
# swing; 0.3 % are 6 mm, which a second camera across brings below 1 mm.
WORST_FOCAL_STD = 0.02
GOOD_FOCAL_STD = 0.003
# Corners are found to 0.05 to 0.3 px. 3 px is no noise: lens model, focus or the board's numbers.
WORST_PX = 3.0
# Error on views not used over that on those used: 1 where nothing was fitted to noise. Half of the
# views still determine everything at 2; at 10 the fit is one to its own views.
WORST_HELD_OUT = 10.0
GOOD_HELD_OUT = 2.0
# Of known lengths on the board. A printer errs by up to 0.2 %, a ruler by 1 mm in 100 at worst.
WORST_LENGTH_BIAS = 0.01
GOOD_LENGTH_BIAS = 0.002
# Points where the board was: what poses of the platform cannot be better than. Swings are 30 to
# 200 mm large: 1 mm is some percent of them, with 10 mm nothing can be identified.
WORST_VOLUME_M = 0.01
GOOD_VOLUME_M = 0.001
# Views that contradict the others: where most do, it is not known which are right.
WORST_DROPPED = 0.5
# Error among the others over that of a camera alone: 1 when all hold still and see the same
# instants. A board at 0.1 m/s, 2 m away, moves 1 px in 20 ms: ten times a corner's noise.
WORST_RIG_OVER_ALONE = 4.0
# No corner detector is better than this, px: a smaller error of a camera alone is chance.
LEAST_ALONE_PX = 0.05


@dataclass(frozen=True, slots=True)
class Finding:
    """A sentence that warns, or that refuses a calibration."""

    refuses: bool
    text: str


@dataclass(frozen=True, slots=True)
class CameraNumbers:
    """What is known of one camera.

    Attributes:
        name: of the camera.
        model: of its lens.
        views: of the board, that were used.
        dropped: that contradicted the others.
        tilt_deg: by how much the board was turned in all.
        filled: share of the image that the board covered.
        empty: where nothing was seen, in words.
        focal_std: of the focal length, relative.
        sigma_px: of its corners in the rig, each axis.
        held_out_px: the same on views not used; NaN without such.
        alone_px: what it reached by itself, each axis.
        among: cameras in the rig.
    """

    name: str
    model: str
    views: int
    dropped: int
    tilt_deg: float
    filled: float
    empty: tuple[str, ...]
    focal_std: float
    sigma_px: float
    held_out_px: float
    alone_px: float
    among: int


@dataclass(frozen=True, slots=True)
class RigNumbers:
    """What is known of all cameras together.

    Attributes:
        cameras: how many.
        unknowns: how many were sought.
        rank: how many the views determine.
        weakest: the first that they do not, or "".
        length_bias: of known lengths, relative; NaN without.
        n_lengths: how many lengths were measured.
        halves_shape_rms_m: of points between the calibrations of two halves; NaN without.
        volume_std_m: of points, by the covariance; NaN without.
    """

    cameras: int
    unknowns: int
    rank: int
    weakest: str
    length_bias: float
    n_lengths: int
    halves_shape_rms_m: float
    volume_std_m: float


def camera_findings(one: CameraNumbers) -> list[Finding]:
    """What a camera's numbers warn of or refuse, in the order of what to film first."""
    name = f"camera {one.name}"
    empty = f"; nothing seen {' and '.join(one.empty[:3])}" if one.empty else ""
    film = f"film the board all over this camera's image, tilted 20 to 40 degrees{empty}"
    said = [
        low(
            (one.views, GOOD_VIEWS, LEAST_VIEWS),
            f"{name}: {one.views} views of the board, want {GOOD_VIEWS} "
            f"(least {LEAST_VIEWS}): {film}",
        ),
        low(
            (one.tilt_deg, GOOD_TILT_DEG, LEAST_TILT_DEG),
            f"{name}: its views are alike, the board turned by {one.tilt_deg:.0f} degrees in all, "
            f"want {GOOD_TILT_DEG:.0f} (least {LEAST_TILT_DEG:.0f}): film it tilted left, right, "
            "up, down",
        ),
        low(
            (one.filled, GOOD_FILLED, LEAST_FILLED),
            f"{name}: the board covered {100 * one.filled:.0f} % of the image, want "
            f"{100 * GOOD_FILLED:.0f} % (least {100 * LEAST_FILLED:.0f} %): {film}",
        ),
        high(
            (one.focal_std, GOOD_FOCAL_STD, WORST_FOCAL_STD),
            f"{name}: focal length known to {100 * one.focal_std:.2g} %, want "
            f"{100 * GOOD_FOCAL_STD:.2g} % (worst {100 * WORST_FOCAL_STD:.2g} %): film the board "
            "closer and tilted more",
        ),
        *_errors(one, name),
    ]
    return [finding for finding in said if finding is not None]


def _errors(one: CameraNumbers, name: str) -> list[Finding | None]:
    """How far its corners lie off: at all, on other views, and beside the other cameras."""
    held_out = one.held_out_px / one.sigma_px
    ratio = one.sigma_px / max(one.alone_px, LEAST_ALONE_PX)
    filmed = one.dropped + one.views
    return [
        refused(
            one.sigma_px > WORST_PX,
            f"{name}: corners lie {one.sigma_px:.1f} px off, limit {WORST_PX} px: the lens is no "
            f"{one.model}, the focus changed, or the board's numbers are wrong",
        ),
        high(
            (held_out, GOOD_HELD_OUT, WORST_HELD_OUT),
            f"{name}: error {one.held_out_px:.2f} px on views not used, {held_out:.1f} times that "
            "of views used: film more views of more kinds",
        ),
        refused(
            one.dropped > WORST_DROPPED * filmed,
            f"{name}: {one.dropped} of {filmed} views had to be dropped",
        ),
        refused(
            one.among > 1 and ratio > WORST_RIG_OVER_ALONE,
            f"{name}: fits itself to {one.alone_px:.2f} px but the other cameras only to "
            f"{one.sigma_px:.2f} px: the cameras are not simultaneous, or one moved; record with "
            "a common trigger, or hold the board still for each view",
        ),
    ]


def rig_findings(one: RigNumbers) -> list[Finding]:
    """What the numbers of all cameras warn of or refuse."""
    apart = "film more views that several cameras share"
    limits = f"want {1e3 * GOOD_VOLUME_M:.0f} mm (worst {1e3 * WORST_VOLUME_M:.0f} mm)"
    said = [
        refused(
            one.rank < one.unknowns,
            f"{one.unknowns - one.rank} of {one.unknowns} unknowns cannot be found from these "
            f"views (first {one.weakest}): film the board where two cameras see it, and tilted",
        ),
        high(
            (abs(one.length_bias), GOOD_LENGTH_BIAS, WORST_LENGTH_BIAS),
            f"known lengths on the board come out {100 * one.length_bias:+.2f} % (limit "
            f"{100 * WORST_LENGTH_BIAS:.0f} %): measure the board, or film more views",
        ),
        _untested(one),
        high(
            (one.halves_shape_rms_m, GOOD_VOLUME_M, WORST_VOLUME_M),
            "two halves of the recordings disagree by "
            f"{1e3 * one.halves_shape_rms_m:.2f} mm, {limits}: {apart}",
        ),
        high(
            (one.volume_std_m, GOOD_VOLUME_M, WORST_VOLUME_M),
            "points where the board was are known to "
            f"{1e3 * one.volume_std_m:.2f} mm, {limits}: {apart}",
        ),
    ]
    return [finding for finding in said if finding is not None]


def _untested(one: RigNumbers) -> Finding | None:
    if one.n_lengths or one.cameras < 2:
        return None
    return Finding(
        False,
        "too few moments with two cameras on the board to test half of the data on the other: "
        "film at least 8 common views a camera",
    )


Limits = tuple[float, float, float]


def low(number: Limits, text: str) -> Finding | None:
    """A (value, good, worst) of which more is better; NaN says nothing."""
    value, good, worst = number
    return Finding(value < worst, text) if value < good else None


def high(number: Limits, text: str) -> Finding | None:
    """A (value, good, worst) of which less is better; NaN says nothing."""
    value, good, worst = number
    return Finding(value > worst, text) if value > good else None


def refused(wrong: bool, text: str) -> Finding | None:
    """A finding that refuses, where something is wrong."""
    return Finding(True, text) if wrong else None
