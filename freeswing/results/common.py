"""Tables that several documents hold."""

from __future__ import annotations

from freeswing.results.codec import Entry, Numbers, absent, entry


@entry
class Parameter(Entry):
    """One number with its standard deviation, both in the unit of its name's suffix."""

    name: str
    value: float | None = None
    std: float | None = None


@entry
class InertiaParameter(Parameter):
    """One of the inertial parameters.

    Attributes:
        std_percent: of the value; None where the value is zero.
        essential: whether it is well determined, or not near zero.
    """

    std_percent: float | None = None
    essential: bool = True


@entry
class SeenDirection(Entry):
    """How well a displaced point is known along one direction of the data's own."""

    point: str = ""
    direction: tuple[float, ...] = ()
    std_m: float | None = None


@entry
class Evidence(Entry):
    """A piece of a held-out run that an effect explains.

    Attributes:
        run: its name.
        from_s: where the piece begins.
        to_s: where it ends.
        share: of everything that the effect explains.
    """

    run: str = ""
    from_s: float | None = None
    to_s: float | None = None
    share: float | None = None


@entry
class FoundEffect(Entry):
    """An effect that the data show.

    Attributes:
        effect: its name in the catalogue.
        part: of one cable or motor, its name.
        verdict: for effects of cameras.
        run: that it was found in, for effects of cameras.
        camera: that it was found on, likewise.
        parameters: its numbers.
        confounded_with: what the data cannot tell it from.
        motion: of stretching cables, whether they were fitted with their vibration.
        directions: along which data see a displaced point, best first.
        evidence: of a driven robot's: where it is seen, most telling first.
        before: agreement without it, for effects of cameras.
        after: agreement with it.
    """

    effect: str
    part: str = absent(default="")
    verdict: str = absent(default="")
    run: str = absent(default="")
    camera: str = absent(default="")
    parameters: tuple[Parameter, ...] = ()
    confounded_with: tuple[str, ...] | None = absent(default=None)
    motion: str = absent(default="")
    directions: tuple[SeenDirection, ...] = absent(default=())
    evidence: tuple[Evidence, ...] = absent(default=())
    before: Agreement | None = absent(default=None)
    after: Agreement | None = absent(default=None)


@entry
class Agreement(Entry):
    """How cameras agree on a run: reprojection, and rays beside the platform."""

    reprojection_px: float | None = None
    consistency_mm: float | None = None


@entry
class Pose(Entry):
    """A place of the platform: position and Tait-Bryan angles, or their deviations."""

    position_m: Numbers = ()
    angles_rad: Numbers = ()
