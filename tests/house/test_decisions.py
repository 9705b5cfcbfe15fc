"""Constants that decide something: each has its reason at its line and tests that hold it."""

from __future__ import annotations

from collections import Counter

import pytest

from tests.house.constants import listed, named_numbers, numbers_of
from tests.house.in_place import can_be_in_place, early_names
from tests.house.wreck import HELD, LARGER, SMALLER, line_of, wrecked
from tests.places import ROOT

NAMED = [(held.file, name, held.tests) for held in HELD for name in held.names]


def test_each_is_named_once() -> None:
    assert len({(file, name) for file, name, _ in NAMED}) == len(NAMED) > 30


@pytest.mark.parametrize(("file", "name", "tests"), NAMED)
def test_a_held_constant_says_why_it_is_what_it_is(file: str, name: str, tests: str) -> None:
    """At its line, below it, or above the block of constants that it belongs to."""
    lines = (ROOT / file).read_text(encoding="utf-8").splitlines()
    (place,) = [k for k, line in enumerate(lines) if line.startswith(f"{name} = ")]
    above = place
    while above > 0 and " = " in lines[above - 1] and lines[above - 1].lstrip("_")[0].isupper():
        above -= 1
    told = "  # " in lines[place] or lines[above - 1].startswith("# ")
    assert told or lines[place + 1].startswith('"""'), lines[place]
    for path in tests.split():
        assert (ROOT / path.partition("::")[0]).is_file(), path


def test_a_wreck_changes_one_number_and_nothing_else() -> None:
    text = "A = 3\nB = 0.5  # why\nC = 10 * 2\n"
    assert wrecked(text, "A", LARGER) == "A = 4\nB = 0.5  # why\nC = 10 * 2\n"
    assert wrecked(text, "A", SMALLER) == "A = 2\nB = 0.5  # why\nC = 10 * 2\n"
    assert wrecked(text, "B", LARGER) == "A = 3\nB = 0.625  # why\nC = 10 * 2\n"
    assert wrecked(text, "C", SMALLER) == "A = 3\nB = 0.5  # why\nC = 16\n"
    with pytest.raises(ValueError, match="no line gives D a number"):
        line_of(text, "D")


def test_what_is_read_when_a_file_is_imported_is_not_changed_in_memory() -> None:
    text = "B = 2 * A\nclass C:\n    x: float = D\n@e(F)\ndef g(h=H):\n    return I\n"
    text += "j = lambda k=K: L\n"
    read = early_names(text)
    assert {"A", "D", "F", "H", "K"} <= read
    assert not {"B", "I", "L"} & read
    assert can_be_in_place(
        "vision/planar/dots.py", "REACH", "tests/vision/planar/test_planar_limits.py"
    )
    assert not can_be_in_place("calib/tags/accept_tag.py", "_LEAST_CONTRAST", __file__)


NUMBERS = named_numbers()
LISTED = listed()
LISTED_PLACES = [place for group in LISTED.values() for place in group.places]


def test_every_named_number_is_held_or_said_to_decide_nothing() -> None:
    accounted = {(file, name) for file, name, _ in NAMED} | {*LISTED_PLACES}
    new = [f"{file}: {name}" for file, name in NUMBERS if (file, name) not in accounted]
    assert new == [], f"hold them (tests/house/wreck.py) or list them (undeciding.toml): {new}"


def test_lists_of_numbers_name_what_is_there_and_each_once() -> None:
    places = [*LISTED_PLACES, *((file, name) for file, name, _ in NAMED)]
    assert len(NUMBERS) > 900, len(NUMBERS)
    assert sorted(set(places) - set(NUMBERS)) == []
    assert sorted(place for place, n in Counter(places).items() if n > 1) == []


def test_numbers_that_decide_nothing_say_why() -> None:
    assert all(len(group.reason.split()) > 5 for group in LISTED.values())


def test_numbers_with_a_name_are_found() -> None:
    text = (
        "A = 3\n_B_2: float = 1e-3 * 2\nC = D = -0.5\nE = True\nF = 'x'\ng = 1\nH = A\nI = (1, 2)\n"
        "J, _K = 1, 'x'\nL, M = f()\n"
    )
    assert numbers_of(text) == ["A", "_B_2", "C", "D", "J"]
