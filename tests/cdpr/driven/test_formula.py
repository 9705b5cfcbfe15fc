import math

import pytest

from freeswing.cdpr.driven.formula import LONGEST_TEXT, Formula


@pytest.mark.parametrize(
    ("text", "value"),
    [
        (2, 2.0),
        ("1 + 2*3", 7.0),
        ("-(a - b)/2", -0.5),
        ("a*cos(t)", 3.0 * math.cos(0.3)),
        ("sqrt(a + 1)*sin(-t)", -2.0 * math.sin(0.3)),
    ],
)
def test_arithmetic(text, value):
    assert Formula.of(text).at({"a": 3.0, "b": 2.0, "t": 0.3}) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os')",
        "a.b",
        "a**9",
        "a if b else c",
        "sin(a, b)",
        "tan(a)",
        "a[0]",
        "lambda: 1",
        "1,",
        "",
        "'x'",
        "True",
        "a b",
        "1" + "+1" * LONGEST_TEXT,
    ],
)
def test_nothing_else_is_understood(text):
    with pytest.raises(ValueError, match=r"use|more than"):
        Formula.of(text)


@pytest.mark.parametrize(("text", "why"), [("1/(a-a)", "zero"), ("sqrt(a-5)", "no value")])
def test_no_value_is_said(text, why):
    with pytest.raises(ValueError, match=why):
        Formula.of(text).at({"a": 3.0})


def test_names_are_told():
    assert Formula.of("b*cos(a) + b").names == ("a", "b")
    assert Formula.of(1.5).is_number
