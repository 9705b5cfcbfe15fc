"""Makes `drive.json`, its curves and a driven robot's `diagnosis.json` of what was found."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from freeswing.cdpr.effects import driven_catalogue
from freeswing.ident.drive.asked_session import DriveSession
from freeswing.ident.drive.diagnose.candidates import Candidate
from freeswing.ident.drive.diagnose.diagnose import DriveDiagnosis, Verdict
from freeswing.ident.drive.diagnose.refit import Fitted
from freeswing.ident.drive.identify import DriveIdentification
from freeswing.ident.drive.joint import Estimate
from freeswing.ident.drive.kinematics import Kinematics
from freeswing.ident.drive.predicted_run import RunFit
from freeswing.ident.drive.records.ramps import Ramp
from freeswing.ident.drive.run_problem import DriveRun
from freeswing.ident.drive.trust import is_untold
from freeswing.results.driven.estimates import DriveResult
from freeswing.results.driven.motion import DriveMotion

Array = NDArray[np.float64]

SHOWN_ROWS = 250  # of a run, beside each other: what a page shows
SHOWN_RATES = 60  # of a spectrum
SPECTRUM_S = 1.0  # of a piece, so that the lowest rate is 1 Hz
DIGITS = 6  # of what is only shown
EVIDENCE_S = 0.5  # of a run: what an effect explains is told in pieces of this length
MOST_EVIDENCE = 5


def drive_document(
    name: str,
    session: DriveSession,
    found: DriveIdentification,
    effects: Sequence[str] = (),
    held: Sequence[str] = (),
) -> DriveResult:
    """The document; what the data do not determine has null values.

    Args:
        name: of the session.
        session: as it was asked.
        found: by all methods.
        effects: asked for beside the session's own numbers.
        held: numbers of the file that stay as declared for their sake.
    """
    estimates: dict[str, Any] = {}
    if found.regression is not None:
        names = session.asked.without_effects.dynamic.names
        estimates["inverse_dynamics"] = {
            "parameters": _parameters(names, found.regression.values, found.regression.std),
            "condition": found.regression.condition,
        }
    second: dict[str, Any] = {"second_start_z": found.second_start}
    joint = _estimate(found.joint)
    if found.output_error is not None:
        second["initial_values"] = "inverse_dynamics"
        estimates |= {"output_error": _estimate(found.output_error) | second, "joint": joint}
    else:
        estimates["joint"] = joint | second
    if found.kinematics is not None and found.published is not None:
        names = session.asked.kinematic.names
        estimates["kinematic"] = {
            **_kinematics(names, found.kinematics),
            "equation_18": _kinematics(names, found.published),
        }
    table = {
        "format": DriveResult.format(),
        "session": name,
        "estimates": estimates,
        "fit_percent": [_fit(fit) for fit in found.fits],
        "initial_fit_percent": [_fit(fit) for fit in found.initial if fit is not None],
        "used": [_used(session, run) for run in found.used],
        "ramps": [_ramp(session, ramp) for ramp in found.ramps],
        "slack": [_slack(session, fit) for fit in found.fits if _is_slack(fit)],
        "saturated": [_saturated(session, fit) for fit in found.fits if fit.saturated.any()],
        "residual": {
            "autocorrelation_10_ms": found.joint.autocorrelation,
            "times_noise": {fit.run.name: times_noise(session, fit) for fit in found.fits},
        },
    }
    return DriveResult.from_json(
        table | ({"effects": list(effects), "held": list(held)} if effects else {})
    )


def drive_motion_document(
    name: str, session: DriveSession, found: DriveIdentification
) -> DriveMotion:
    """What the page shows of every run: angles, residuals and their spectrum, tensions."""
    return DriveMotion.from_json(
        {
            "format": DriveMotion.format(),
            "session": name,
            "cables": [cable.name for cable in session.model.robot.cables],
            "tension_limits_N": session.model.drive.tension_limits_N,
            "angle_noise_rad": session.noise.angle_std_rad,
            "runs": [_shown(fit) for fit in found.fits],
        }
    )


def _shown(fit: RunFit) -> dict[str, Any]:
    rows = np.linspace(0, len(fit.gaps_rad) - 1, min(SHOWN_ROWS, len(fit.gaps_rad))).astype(int)
    rates, power = _spectrum(fit)
    pushing = np.mean(fit.motion.tensions_N < 0.0, axis=0)
    return {
        "run": fit.run.name,
        "role": fit.run.role,
        "times_s": fit.motion.times_s[rows],
        "angles_rad": _short(fit.run.record.angles_rad[rows]),
        "residuals_rad": _short(fit.gaps_rad[rows]),
        "tensions_N": _short(fit.motion.tensions_N[rows]),
        "slack_share": pushing,
        "spectrum_hz": _short(rates),
        "spectrum_rad2_hz": _short(power),
    }


def _short(values: Array) -> Array:
    """The numbers to `DIGITS` digits of the largest: a page shows no more."""
    size = float(np.abs(values).max(initial=0.0))
    return np.round(values, DIGITS - 1 - int(np.floor(np.log10(size)))) if size > 0.0 else values


def _spectrum(fit: RunFit) -> tuple[Array, Array]:
    """Power of the angles' residuals, motors together: rates (k,) and rad2/Hz (k,)."""
    from scipy.signal import welch  # takes a second to import, and few commands need it

    gaps, rate = fit.gaps_rad, fit.run.rate_hz
    piece = min(len(gaps), round(SPECTRUM_S * rate))
    rates, power = welch(gaps, rate, nperseg=piece, axis=0)
    rates, power = rates[1:], power[1:].mean(axis=1)
    places = np.unique(np.geomspace(1, len(rates), SHOWN_RATES).astype(int)) - 1
    sums = np.add.reduceat(power, places) / np.diff(np.append(places, len(rates)))
    return rates[places], sums


def _used(session: DriveSession, run: DriveRun) -> dict[str, Any]:
    """Of a run that was fitted, how much: after its first slack cable rigid ones say nothing."""
    whole = next(one for one in session.runs if one.name == run.name)
    seconds = (len(run.record.times_s) - 1) / run.rate_hz
    return {"run": run.name, "seconds": seconds, "whole": run is whole}


def _ramp(session: DriveSession, ramp: Ramp) -> dict[str, Any]:
    return {
        "run": ramp.run,
        "motor": session.model.robot.cables[ramp.motor].name,
        "slope_A_s": ramp.slope_A_s,
        "moved_s": ramp.moved_s,
        "ramp_N_m": ramp.read_N_m,
        "estimate_N_m": ramp.estimate_N_m,
        "estimate_on_this_ramp_N_m": ramp.of_estimate_N_m,
        "slope_costs_N_m": ramp.slope_costs_N_m,
        "breakaway_s": ramp.breakaway_s,
    }


def times_noise(session: DriveSession, fit: RunFit) -> float:
    """The angles' residual over what encoder counts leave."""
    return fit.rms_rad / session.noise.angle_std_rad


def _parameters(
    names: Sequence[str], values: Array, std: Array, on_bound: NDArray[np.bool_] | None = None
) -> list[dict[str, Any]]:
    entries, known = [], driven_catalogue()
    for k, name in enumerate(names):
        # What an effect adds has no size of its own to compare with.
        is_offset = name.partition(".")[0] in known
        lost = not np.isfinite(std[k]) if is_offset else is_untold(std[k], values[k])
        entry = {"name": name, "value": None if lost else values[k]}
        entry |= {"std": None if lost else std[k], "identifiable": not lost}
        entries.append(entry | {"on_bound": bool(on_bound is not None and on_bound[k])})
    return entries


def _estimate(found: Estimate) -> dict[str, Any]:
    std = np.where(found.determined, np.sqrt(np.maximum(np.diag(found.covariance), 0.0)), np.inf)
    safe = np.where(np.isfinite(found.covariance), found.covariance, 0.0)
    size = np.where(np.isfinite(std) & (std > 0.0), std, 1.0)
    parameters = _parameters(found.asked.names, found.values, std, found.on_bound)
    for one, group in zip(parameters, found.asked.groups, strict=True):
        if len(group.members) > 1:
            one["tied"] = list(group.members[1:])
    return {
        "parameters": parameters,
        "correlation": safe / np.outer(size, size),
        "condition": found.found.condition,
        "iterations": found.found.iterations,
        "stopped": found.found.stopped,
    }


def _kinematics(names: Sequence[str], found: Kinematics) -> dict[str, Any]:
    std = np.where(found.determined, np.sqrt(np.maximum(np.diag(found.covariance), 0.0)), np.inf)
    return {
        "parameters": _parameters(names, found.values, std),
        "rms_rad": found.rms_rad,
        "condition": found.found.condition,
        "stopped": found.found.stopped,
    }


def _fit(fit: RunFit) -> dict[str, Any]:
    return {
        "run": fit.run.name,
        "role": fit.run.role,
        "equation_22": fit.equation_22,
        "matlab": fit.matlab,
        "rms_rad": fit.rms_rad,
    }


def _slack(session: DriveSession, fit: RunFit) -> dict[str, Any]:
    cables = session.model.robot.cables
    return {
        "run": fit.run.name,
        "samples": int(fit.motion.slack.any(axis=1).sum()),
        "cables": [cables[k].name for k in np.flatnonzero(fit.slack)],
        "from_s": float(fit.motion.times_s[min(fit.until, len(fit.motion.times_s) - 1)]),
        "least_tension_N": float(fit.motion.tensions_N.min()),
        "in_model": fit.motion.lengths_out_m is not None,
    }


def _is_slack(fit: RunFit) -> bool:
    """Whether a rigid cable would have had to push for more than a moment, or an elastic hangs."""
    elastic = fit.motion.lengths_out_m is not None
    return bool(fit.slack.any()) and (elastic or fit.until < len(fit.gaps_rad))


def _saturated(session: DriveSession, fit: RunFit) -> dict[str, Any]:
    cables = session.model.robot.cables
    motors = [cables[k].name for k in np.flatnonzero(fit.saturated)]
    return {"run": fit.run.name, "samples": int(fit.saturated.max()), "motors": motors}


def drive_diagnosis_document(name: str, session: DriveSession, found: DriveDiagnosis) -> dict:
    """The document `freeswing-diagnosis/1` of a driven robot's session.

    Motor angles tell far more than poses: `motor_rmse_rad` beside its noise decides.
    """
    steps = zip(found.ladder, found.ladder[1:], strict=False)
    document = {
        "format": "freeswing-diagnosis/1",
        "session": name,
        "before": _held_out(session, found.before),
        "candidates": [_candidate(verdict) for verdict in found.verdicts],
        "accepted": [
            _accepted(one, found.after, *pair)
            for one, pair in zip(found.accepted, steps, strict=True)
        ],
        "after": _held_out(session, found.after),
        "share_closed": _share(found),
        "parameters_before": _asked(found.before, len(session.asked.groups)),
        "parameters_after": _asked(found.after, len(session.asked.groups)),
        "ladder": [_held_out(session, fit) for fit in found.ladder],
        "unexplained": _unexplained(session, found),
    }
    return document


def _held_out(session: DriveSession, fit: Fitted) -> dict[str, Any]:
    told, noise = fit.held_out, session.noise
    entry: dict[str, Any] = {"effects": list(fit.given.model.effects), "sigma_perp": None}
    if told is None:
        return entry | {"prediction_rmse_m": None, "noise_floor_m": noise.pose_std[0]}
    return entry | {
        "prediction_rmse_m": told.poses_m,
        "noise_floor_m": noise.pose_std[0],
        "prediction_rmse_rad": told.poses_rad,
        "motor_rmse_rad": told.rms_rad,
        "motor_noise_rad": noise.angle_std_rad,
        "runs": [
            {"run": one.run.name, "motor_rmse_rad": one.rms_rad, "matlab_percent": one.matlab}
            for one in told.fits
        ],
    }


def _candidate(verdict: Verdict) -> dict[str, Any]:
    one = verdict.candidate
    entry = {"effect": one.effect} | ({"part": one.part} if one.part else {})
    if verdict.fit is not None:
        entry |= {"parameters": _numbers(one, verdict.fit)}
    return entry | {
        "verdict": verdict.verdict,
        "delta_bic": verdict.delta_bic if np.isfinite(verdict.delta_bic) else None,
        "held_out_gain": verdict.held_out_gain if np.isfinite(verdict.held_out_gain) else None,
        "confounded_with": list(verdict.confounded_with),
        "reason": verdict.reason,
    }


def _accepted(one: Candidate, after: Fitted, below: Fitted, above: Fitted) -> dict[str, Any]:
    entry = {"effect": one.effect} | ({"part": one.part} if one.part else {})
    return entry | {"parameters": _numbers(one, after), "evidence": _evidence(below, above)}


def _numbers(one: Candidate, fit: Fitted) -> list[dict[str, Any]]:
    """A candidate's numbers by a fit that has it."""
    names, found, parameters = fit.found.asked.names, fit.found, []
    for group in one.groups:
        k = names.index(group.name)
        std = found.std[k] if found.determined[k] else None
        short = group.name.partition(".")[2]
        parameters.append({"name": short, "value": found.values[k], "std": std})
    return parameters


def _evidence(below: Fitted, above: Fitted) -> list[dict[str, Any]]:
    """Which seconds of which held-out runs an effect explains, most telling first."""
    if below.held_out is None or above.held_out is None:
        return []
    pieces = []
    for one, other in zip(below.held_out.fits, above.held_out.fits, strict=True):
        times = one.motion.times_s
        falls = np.sum(one.gaps_rad**2, axis=1) - np.sum(other.gaps_rad**2, axis=1)
        places = (times / EVIDENCE_S).astype(np.intp)
        for place, fall in enumerate(np.bincount(places, falls)):
            pieces.append((float(fall), one.run.name, EVIDENCE_S * place))
    whole = sum(fall for fall, _, _ in pieces)
    pieces.sort(key=lambda piece: -piece[0])
    return [
        {"run": run, "from_s": first, "to_s": first + EVIDENCE_S, "share": fall / whole}
        for fall, run, first in pieces[:MOST_EVIDENCE]
        if fall > 0.0
    ]


def _share(found: DriveDiagnosis) -> float | None:
    before, after = found.before.times_noise, found.after.times_noise
    return (before - after) / (before - 1.0) if before > 1.0 and np.isfinite(before) else None


def _asked(fit: Fitted, count: int) -> list[dict[str, Any]]:
    std = np.where(fit.found.determined, fit.found.std, np.inf)[:count]
    return _parameters(fit.found.asked.names[:count], fit.found.values[:count], std)


def _unexplained(session: DriveSession, found: DriveDiagnosis) -> dict[str, Any]:
    """What remains: which motor, how large, how fast."""
    if not found.unexplained or found.after.held_out is None:
        return {"present": found.unexplained, "signature": "", "evidence": {}}
    fits, cables = found.after.held_out.fits, session.model.robot.cables
    sizes = np.sqrt(np.mean([np.mean(fit.gaps_rad**2, axis=0) for fit in fits], axis=0))
    worst = int(np.argmax(sizes))
    gaps = max((fit.gaps_rad[:, worst] for fit in fits), key=lambda column: float(column.std()))
    power = np.abs(np.fft.rfft(gaps - gaps.mean())) ** 2
    rate_hz = np.argmax(power) * fits[0].run.rate_hz / len(gaps)
    signature = (
        f"motor {cables[worst].name}'s angle is off by {sizes[worst]:.2g} rad rms "
        f"({found.after.times_noise:.1f} times the noise over all motors), most at {rate_hz:.2g} Hz"
    )
    evidence = {"motor_rmse_rad": sizes, "frequency_hz": rate_hz}
    return {"present": True, "signature": signature, "evidence": evidence}
