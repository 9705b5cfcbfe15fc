"""A soft umbilical or safety line that pulls on the platform."""

from __future__ import annotations

import casadi as ca

from freeswing.cdpr.effects.base import PAYLOAD, Effect, Instant, Parameter
from freeswing.cdpr.model.body import Expression
from freeswing.cdpr.robot import Robot

# Of the entries' spread: about where platforms hang below them, so that the pull told is one felt.
DEPTH = 0.7
SMALLEST_PULL_M_S2 = 1e-9
# The smaller the share, the more linear the force about no pull: a first step that was of no use
# from a half is of use from here.
LESS_AT_REST = 0.3


class Tether(Effect):
    """A taut spring between a point of the platform and an anchor on the frame, over the mass.

    Rather than by the anchor it is told by what it does at a place in the workspace: its pull
    there, its stiffness along the line, and which share of its length there is unstretched. The
    anchor lies at place + pull / (stiffness (1 - rest share)). A rest share of zero leaves the
    linear force pull - stiffness (point - place).
    """

    name = "tether"
    summary = "a soft spring that ties the platform to the frame"
    separated_by = (PAYLOAD,)

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Specific stiffness, the pull at `place`, the unstretched share, and where it is tied."""
        stiffness = Parameter("stiffness_1_s2", 0.0, 20.0, 0.5)
        pull = tuple(Parameter(f"pull_{axis}_m_s2", -10.0, 10.0, 0.3) for axis in "xyz")
        share = Parameter("rest_share", 0.0, 0.95, 0.3, start=0.5, amplitude=False)
        point = tuple(
            Parameter(f"point_{axis}_m", -0.4, 0.4, 0.1, amplitude=False) for axis in "xyz"
        )
        return (stiffness, *pull, share, *point)

    def further_shapes(self) -> tuple[dict[str, float], ...]:
        """A softer line: at no pull the direction of the force is not defined for any other."""
        return ({"rest_share": LESS_AT_REST},)

    def wrench(self, instant: Instant, values: Expression) -> Expression:
        """The spring's force at its point of the platform.

        With q = point - place and the anchor at place + a: stiffness (1 - rest / |a - q|) (a - q),
        written so that nothing is divided by the stiffness.
        """
        stiffness, pull, share = values[0], values[1:4], values[4]
        lever = instant.rotation @ values[5:8]
        q = instant.zeta[:3] + lever - place(instant)
        across = stiffness * (1 - share)
        toward = pull - across * q
        size, size_at_place = _length(toward), _length(pull)
        longer = (across * ca.dot(q, q) - 2 * ca.dot(pull, q)) / (size + size_at_place)
        force = toward + stiffness * share * longer * toward / size
        return instant.force_at(lever, force)


def place(instant: Instant) -> Expression:
    """Mean of the cable entries, lowered by 0.7 of their mean distance from it, (3,)."""
    count = len(instant.cables)
    mean = sum((cable.entry for cable in instant.cables), ca.SX.zeros(3)) / count
    spread = sum((ca.sumsqr(cable.entry - mean) for cable in instant.cables), ca.SX(0)) / count
    return mean - ca.vertcat(0, 0, DEPTH * ca.sqrt(spread))


def _length(vector: Expression) -> Expression:
    return ca.sqrt(ca.dot(vector, vector) + SMALLEST_PULL_M_S2**2)


EFFECT = Tether()
