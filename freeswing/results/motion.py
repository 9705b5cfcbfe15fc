"""results/motion.json and diagnosis_motion.json: measured beside predicted motions."""

from __future__ import annotations

from typing import ClassVar

from freeswing.results.codec import Document, Entry, Numbers, absent, entry


@entry
class RunMotion(Entry):
    """Samples of one run in m and rad, one row a moment; None where a sample is missing.

    Attributes:
        run: its name.
        role: validate, or identify of those that were fitted.
        times_s: moments.
        coordinates: what was measured.
        measured: samples.
        before: predicted without missing effects.
        after: predicted with them, where there are any.
    """

    run: str
    role: str = ""
    times_s: Numbers = ()
    coordinates: tuple[str, ...] = ()
    measured: tuple[Numbers, ...] = ()
    before: tuple[Numbers, ...] | None = absent(default=None)
    after: tuple[Numbers, ...] | None = absent(default=None)


@entry
class Motion(Document):
    """The first held-out runs, and in motion.json the first that were fitted.

    Attributes:
        runs: held out.
        fitted: what the best estimate was fitted to; `before` is the motion found for them.
    """

    kind: ClassVar[str] = "motion"

    runs: tuple[RunMotion, ...] = ()
    fitted: tuple[RunMotion, ...] = absent(default=())
