"""What is told of every effect after the last round."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from freeswing.ident.diagnose.answer.final_verdicts import final_verdicts, rivals_of
from freeswing.ident.diagnose.decision import Candidate, Decision
from freeswing.ident.diagnose.search import Round

LOSSES = ("drag", "swivel", "pulley")


def word(effect: str, verdict: str, others: tuple[str, ...] = ()) -> Candidate:
    return Candidate(effect, verdict, -10.0, 0.5, others, "its round's reason")


def rounds() -> list[Round]:
    """Three losses are one group; then one of them is found beside the first."""
    anything: Any = SimpleNamespace()
    first = tuple(
        word(name, "confounded", tuple(o for o in LOSSES if o != name)) for name in LOSSES
    )
    first = (*first, word("tilt", "rejected"))
    second = (word("swivel", "accepted"), word("pulley", "rejected"), word("tilt", "rejected"))
    return [
        Round(anything, Decision(first, anything, "drag", LOSSES)),
        Round(anything, Decision(second, anything, "swivel", ("swivel",))),
    ]


def test_effects_found_beside_one_another_are_no_rivals() -> None:
    told = {one.effect: one for one in final_verdicts(rounds(), ("drag", "swivel"), {}, ())}
    assert told["swivel"].verdict == "accepted"
    assert told["swivel"].confounded_with == ()
    assert told["drag"].verdict == "confounded"
    assert told["drag"].confounded_with == ("pulley",)
    assert "beside swivel" in told["drag"].reason
    assert told["pulley"].confounded_with == ("drag", "swivel")
    assert told["tilt"].verdict == "rejected"
    assert rivals_of(rounds()) == {"drag": ("drag", "pulley"), "swivel": ("swivel",)}


def test_a_group_of_what_is_all_in_the_model_is_accepted() -> None:
    (one, two) = rounds()
    pair = tuple(word(a, "confounded", (b,)) for a, b in (("drag", "swivel"), ("swivel", "drag")))
    one = Round(one.before, Decision(pair, one.before, "drag", ("drag", "swivel")))
    told = {c.effect: c for c in final_verdicts([one, two], ("drag", "swivel"), {}, ())}
    assert told["drag"].verdict == told["swivel"].verdict == "accepted"


def test_what_the_final_model_has_not_is_rejected() -> None:
    told = final_verdicts(rounds(), (), {"clock": "no clock"}, ("clock",))
    assert {one.effect: one.verdict for one in told} == {
        "drag": "rejected",
        "swivel": "rejected",
        "pulley": "rejected",
        "tilt": "rejected",
        "clock": "not_identifiable",
    }
