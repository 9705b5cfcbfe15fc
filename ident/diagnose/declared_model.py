"""The declared model fitted to the runs of a session: where a diagnosis starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from freeswing.cdpr.effects import Recorded, catalogue
from freeswing.cdpr.files.documents import DataError
from freeswing.cdpr.measured.slow_errors import BESIDE_STATED
from freeswing.cdpr.model.equations import Model, build_model
from freeswing.cdpr.robot import POSE_COORDINATES, Array, Robot
from freeswing.cdpr.system.progress import Progress
from freeswing.ident.diagnose.outstanding_runs import tempered
from freeswing.ident.diagnose.spectrum import residual_powers
from freeswing.ident.judge.physical_consistency import is_possible
from freeswing.ident.likelihood.blocks import INERTIA, first_unknowns
from freeswing.ident.likelihood.fit import fit
from freeswing.ident.likelihood.fit_swings import (
    CONVERGED_DECREASE,
    ONWARD,
    FreeSwing,
    LikelihoodFit,
    Swings,
)
from freeswing.ident.likelihood.samples_and_noise import UNIT_NOISE_M, UNIT_NOISE_RAD
from freeswing.ident.likelihood.session_estimates import astray, begun
from freeswing.ident.signals.usable_runs import PreparedRun

# One run is left out at a time: two others have to agree.
LEAST_RUNS = 3
MOST_STARTS = 3
ROUGH_TOLERANCE = 1.0
# Two starts that end within a tenth of the deviations have found one valley.
SAME_FIT = 0.1
# After the first stretch, roughly followed, they are apart by 0.14, after the next by 1e-4.
SAME_VALLEY = 0.5
# What an effect leaves is small beside the swings; what a fit in the wrong valley leaves is not.
SMALL_BESIDE_SWINGS = 0.25
AT_THE_NOISE = 2.0
FRAME = "platform_frame"


def with_frames(robot: Robot, nuisances: tuple[str, ...]) -> Model:
    """The declared model with nuisances of what is measured, each run's own.

    Frames differ from run to run by what the poses state, and by the robot's tolerance beside it,
    as where lengths are judged: while effects are missing, what the layout has wrong in all runs
    has no other place, and a frame held to what is stated bends the inertia instead.

    Args:
        robot: as declared.
        nuisances: names of effects on what is measured.
    """
    model = build_model(robot, nuisances)
    parameters = tuple(
        replace(one, source=BESIDE_STATED) if name.startswith(f"{FRAME}.") else one
        for name, one in zip(model.names, model.parameters, strict=True)
    )
    return replace(model, parameters=parameters)


def base_fit(
    model: Model,
    runs: list[PreparedRun],
    free: tuple[str, ...] | None,
    starts: list[Array],
    noise_scales: Array,
    progress: Progress | None,
) -> tuple[LikelihoodFit, list[PreparedRun], list[str]]:
    """The fit without effects in units of the noise, the runs in it, and sentences on the others.

    The first start that leads to residuals small beside the swings serves, else the likeliest of
    those tried until two have led to the same fit.

    Args:
        model: the declared one.
        runs: with role identify.
        free: coordinates to use of them, or None for full poses.
        starts: inertias to start from, each (9,), in the order in which to try them.
        noise_scales: of metres and radians, (2,).
        progress: told a label and a fraction.

    Raises:
        DataError: when fewer than three runs can be started, or no start leads to a fit.
    """
    found: list[tuple[LikelihoodFit, list[PreparedRun], list[str]]] = []
    failure, earlier = "", list[_Watch]()
    for inertia in starts[:MOST_STARTS]:
        try:
            kept, samples, states, left = begun(model, runs, free, inertia)
            refuse_few(kept)
            unknowns = first_unknowns(model, inertia, states, [run.payload for run in samples])
            swings = Swings(model, tuple(samples), noise_scales)
            watch = _Watch(earlier, len(kept))
            how = FreeSwing(tolerance=ROUGH_TOLERANCE, progress=progress, begun=watch)
            rough = fit(swings, unknowns, how)
        except _SameValleyError:
            break
        except (ValueError, np.linalg.LinAlgError) as error:
            failure = failure or str(error)
            continue
        earlier.append(watch)
        found.append((rough, kept, [f"run {one.run} left out: {one.why}" for one in left]))
        follows = is_possible(rough.inertia) and _follows(rough, noise_scales)
        if follows or any(_is_same(rough, other) for other, _, _ in found[:-1]):
            break
    if not found:
        raise DataError(f"the declared model could not be fitted to the runs: {failure}")
    most = max(len(kept) for _, kept, _ in found)
    best = min((one for one in found if len(one[1]) == most), key=lambda one: one[0].deviance)
    rough, kept, dropped = best
    swings = replace(rough.swings, samples=tempered(rough, noise_scales), scales=noise_scales)
    # In units of the noise a residual far above it would be followed to its last digit.
    power = rough.cost / rough.n_samples * float(np.max(rough.scales / noise_scales)) ** 2
    tolerance = CONVERGED_DECREASE * max(1.0, power)
    return (
        fit(swings, rough.unknowns, replace(ONWARD, tolerance=tolerance, foresees=True)),
        kept,
        dropped,
    )


class _SameValleyError(Exception):
    """A start has come to where an earlier one was, which was fitted."""


class _Watch:
    """Where a fit stands after its first stretch; ends it where an earlier one stood as well.

    Args:
        earlier: those of starts that led to a fit.
        runs: how many this one has.
    """

    def __init__(self, earlier: Sequence[_Watch], runs: int) -> None:
        self.earlier = tuple(earlier)
        self.runs = runs
        self.inertia = np.full(9, np.nan)

    def __call__(self, inertia: Array, stds: Array) -> None:
        """Told once the first stretch is fitted.

        Raises:
            _SameValleyError: where the rest would go the way of an earlier fit.
        """
        self.inertia = inertia
        for one in self.earlier:
            near = np.abs(inertia - one.inertia) < SAME_VALLEY * stds
            if one.runs == self.runs and bool(near.all()):
                raise _SameValleyError


def refuse_few(runs: list[PreparedRun]) -> None:
    """Raises DataError where runs are too few to leave one out."""
    if len(runs) < LEAST_RUNS:
        raise DataError(
            f"{len(runs)} usable runs with role identify: at least {LEAST_RUNS} are needed to "
            "decide on runs left out; record more swings about other equilibria"
        )


def _is_same(one: LikelihoodFit, other: LikelihoodFit) -> bool:
    """Whether two starts have led to one fit: a third would too, most likely."""
    if len(one.samples) != len(other.samples):
        return False
    level = abs(one.deviance - other.deviance) < 2.0 * ROUGH_TOLERANCE
    apart = np.abs(one.inertia - other.inertia)
    return level and bool(np.all(apart < SAME_FIT * one.std(INERTIA)))


def _follows(found: LikelihoodFit, noise_scales: Array) -> bool:
    near = astray(found) < SMALL_BESIDE_SWINGS
    return near or bool(residual_powers(found, noise_scales).mean() < AT_THE_NOISE)


def white_noise_scales(runs: list[PreparedRun], free: tuple[str, ...] | None) -> Array:
    """White noise of the samples over what their covariance (or the unit noise) states, (2,)."""
    ratios: list[list[float]] = [[], []]
    for run in runs:
        trajectory = run.run.trajectory
        stated = trajectory.standard_deviations()
        names = POSE_COORDINATES if free is None else free
        for name in names:
            group = int(name not in POSE_COORDINATES[:3])
            noise = run.signals.noise_std[run.signals.coordinates.index(name)]
            unit = UNIT_NOISE_RAD if group else UNIT_NOISE_M
            if stated is not None:
                unit = float(np.nanmedian(stated[:, trajectory.coordinates.index(name)]))
            ratios[group].append(float(noise / unit))
    return np.array([np.sqrt(np.mean(np.square(group))) if group else 1.0 for group in ratios])


def barred_effects(runs: list[PreparedRun], robot: Robot) -> dict[str, str]:
    """Effects that these data cannot show, and why."""
    recorded = Recorded(
        lengths=any(run.run.lengths_m is not None for run in runs),
        slow_errors=any(run.run.trajectory.slow is not None for run in runs),
    )
    why = {name: effect.cannot_show(robot, recorded) for name, effect in catalogue().items()}
    return {name: words for name, words in why.items() if words}
