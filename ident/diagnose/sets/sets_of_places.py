"""Which sets of wrong places may stand for one that was found, by linear evidence about its fit.

All anchors together follow what one of them and lengths told wrong do: nine numbers in place of
six. A search that adds one effect after another never holds the two against each other. About the
fit that was found the places are small and the residual is, so that every set of places has its
evidence in closed form: those that it drops are led back to nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from freeswing.cdpr.effects import effect_named
from freeswing.cdpr.model.equations import Model
from freeswing.cdpr.robot import Array, Robot
from freeswing.ident.diagnose.decision import CONFOUNDED_DIFFERENCE, REFITTED
from freeswing.ident.diagnose.leave_one_out import Evidence, score
from freeswing.ident.diagnose.model_probabilities import (
    CHANCE_OF_EFFECT,
    log_evidence,
    numbers_taken,
)
from freeswing.ident.diagnose.refit import Refit
from freeswing.ident.diagnose.screen import known_rows, screen
from freeswing.ident.diagnose.sets.fits_as_rivals import rival_among
from freeswing.ident.diagnose.sets.ways import Places, is_held_by
from freeswing.ident.diagnose.spectrum import independent_numbers
from freeswing.ident.diagnose.variants import effect_of, inside
from freeswing.ident.likelihood.blocks import columns_of


def is_place(name: str) -> bool:
    """Whether an effect is a part of the geometry that may be wrong."""
    effect = effect_named(name)
    return effect.stage == "kinematics" and not effect.nuisance and not effect.needs_tension


def count_of(robot: Robot, places: Sequence[str]) -> int:
    """How many numbers a set of places estimates."""
    return sum(int(inside(robot, key).sum()) for key in places)


@dataclass(frozen=True, slots=True)
class LinearSets:
    """Linear evidence for any set of places in place of the one that a fit has found.

    Attributes:
        found: that fit.
        model: with the effects of all places.
        values: where it was linearised: the fit's, and nothing for places that it does not have.
        evidence: over all unknowns.
        known: what is known of these beforehand, as rows of unit deviation.
        stays: columns of what every set estimates.
        columns: of each place's values.
        independent: numbers of each run that move independently, (r,).
    """

    found: Refit
    model: Model
    values: Array
    evidence: Evidence
    known: Array
    stays: np.ndarray
    columns: dict[str, np.ndarray]
    independent: Array

    def log_evidence(self, places: Places) -> float:
        """How likely a set makes the runs, what had to be true for it counted."""
        evidence, known, columns = self._without_others(places)
        rival = rival_among(evidence, known, columns, places, self.model.robot)
        odds = np.log(CHANCE_OF_EFFECT / (1.0 - CHANCE_OF_EFFECT)) * len(places)
        weights = np.ones((1, len(evidence.counts)))
        found = log_evidence(rival, evidence.counts, self.independent, weights)[0]
        return float(found + odds - rival.tries)

    def answer(self, places: Places) -> dict[str, Array]:
        """Values of a set's whole effects where it is all that is wrong, (k,) each."""
        evidence, _, columns = self._without_others(places)
        answered = score(evidence.subset(columns)).change[: len(columns)]
        values = self.values.copy()
        values[self._others(places)] = self.model.start_values[self._others(places)]
        first = self._first()
        of_values = columns >= first
        values[columns[of_values] - first] += answered[of_values]
        names = map(effect_of, places)
        return {name: values[self.model.place_of(name)] for name in names}

    def _first(self) -> int:
        return self.found.fit.inertia.size

    def _others(self, places: Places) -> np.ndarray:
        """Which values a set leads back to nothing."""
        mine = np.concatenate([self.columns[key] for key in places])
        every = np.unique(np.concatenate(list(self.columns.values())))
        return np.setdiff1d(every, mine) - self._first()

    def _without_others(self, places: Places) -> tuple[Evidence, Array, np.ndarray]:
        """Evidence, what is known, and columns of a set, the other places led back to nothing."""
        others = self._others(places)
        back = np.zeros(self.evidence.triangles.shape[-1])
        back[self._first() + others] = (self.model.start_values - self.values)[others]
        back[-1] = 1.0
        one = self.evidence
        triangles, known, rows = one.triangles.copy(), self.known.copy(), one.prior_rows.copy()
        for matrix in (triangles, known, rows):
            matrix[..., -1] = matrix @ back
        moved = replace(one, triangles=triangles, prior_rows=rows)
        mine = np.concatenate([self.stays, *(self.columns[key] for key in places)])
        return moved, known, np.unique(mine)


def linear_sets(
    found: Refit, key: str, others: Sequence[str], noise_scales: Array, colour: float
) -> LinearSets:
    """What any set of places makes of the runs in place of the one that was found.

    Args:
        found: the fit.
        key: of the place that it found last.
        others: keys of places that might be wrong instead.
        noise_scales: of metres and radians, (2,).
        colour: of the fit's residual.
    """
    fit = found.fit
    keys = list(dict.fromkeys([key, *others]))
    linear = screen(fit, keys, noise_scales, colour=colour)
    robot = fit.model.robot
    columns = {k: columns_of(linear.model, effect_of(k))[inside(robot, k)] for k in keys}
    known = known_rows(linear.model, linear.values, fit.samples)
    stays = np.setdiff1d(np.flatnonzero(fit.free), columns[key])
    independent = independent_numbers(fit, noise_scales)
    parts = linear.model, linear.values, linear.evidence, known, stays, columns
    own = rival_among(linear.evidence, known, np.flatnonzero(fit.free), (key,), robot)
    taken = numbers_taken(own, linear.evidence.counts, independent)
    counted = independent + taken / len(independent)
    return LinearSets(found, *parts, counted)


def likely_sets(sets: LinearSets, key: str) -> list[Places]:
    """Sets of no more numbers than the place that was found, nearly as likely or more so.

    At most as many as are fitted at a time, the likeliest first: every set of one or two is looked
    at, and what the likeliest of them become with one more.

    Args:
        sets: the linear evidence.
        key: of the place that was found.
    """
    robot = sets.model.robot
    most = count_of(robot, (key,))
    keys = [one for one in sets.columns if count_of(robot, (one,)) <= most]
    known: dict[Places, float] = {}

    def look_at(places: Sequence[str]) -> None:
        chosen = tuple(sorted(places))
        overlap = any(is_held_by(one, [o for o in chosen if o != one]) for one in chosen)
        if chosen in known or overlap or count_of(robot, chosen) > most:
            return
        known[chosen] = sets.log_evidence(chosen)

    for places in [*combinations(keys, 1), *combinations(keys, 2)]:
        look_at(places)
    for places in sorted(known, key=lambda one: -known[one])[:REFITTED]:
        for one in keys:
            if one not in places:
                look_at((*places, one))
    least = max(known.values()) - 0.5 * CONFOUNDED_DIFFERENCE
    likely = [one for one, log in known.items() if log >= least and one != (key,)]
    return sorted(likely, key=lambda one: -known[one])[:REFITTED]
