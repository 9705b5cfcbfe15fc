"""From which numbers on a calibration warns or refuses: both sides of each limit."""

from __future__ import annotations

from dataclasses import replace

import pytest

from freeswing.calib.verdict.halves_and_lengths import spread_of
from freeswing.calib.verdict.limits_of_use import (
    CameraNumbers,
    RigNumbers,
    camera_findings,
    rig_findings,
)

GOOD = CameraNumbers("a", "OPENCV", 20, 0, 40.0, 0.6, (), 5e-4, 0.1, 0.11, 0.1, 2)
GOOD_RIG = RigNumbers(2, 40, 40, "", 2e-4, 300, 2e-4, 3e-4)
NAN = float("nan")


def told(found):
    """Nothing, "warns" or "refuses": the worst of what is said, and the only one."""
    assert len(found) <= 1, [one.text for one in found]
    return "".join("refuses" if one.refuses else "warns" for one in found)


def test_a_good_calibration_is_not_commented_on() -> None:
    assert camera_findings(GOOD) == []
    assert rig_findings(GOOD_RIG) == []


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        ({"views": 12}, ""),
        ({"views": 11}, "warns"),
        ({"views": 6}, "warns"),
        ({"views": 5}, "refuses"),
        ({"tilt_deg": 25.1}, ""),
        ({"tilt_deg": 24.9}, "warns"),
        ({"tilt_deg": 10.1}, "warns"),
        ({"tilt_deg": 9.9}, "refuses"),
        ({"filled": 0.351}, ""),
        ({"filled": 0.349}, "warns"),
        ({"filled": 0.121}, "warns"),
        ({"filled": 0.119}, "refuses"),
        ({"focal_std": 0.00299}, ""),
        ({"focal_std": 0.00301}, "warns"),
        ({"focal_std": 0.0199}, "warns"),
        ({"focal_std": 0.0201}, "refuses"),
        ({"sigma_px": 2.99, "held_out_px": 3.0, "alone_px": 2.9}, ""),
        ({"sigma_px": 3.01, "held_out_px": 3.0, "alone_px": 2.9}, "refuses"),
        ({"held_out_px": 0.199}, ""),
        ({"held_out_px": 0.201}, "warns"),
        ({"held_out_px": 0.99}, "warns"),
        ({"held_out_px": 1.01}, "refuses"),
        ({"held_out_px": NAN}, ""),
        ({"dropped": 20}, ""),
        ({"dropped": 21}, "refuses"),
        ({"sigma_px": 0.399, "held_out_px": 0.4}, ""),
        ({"sigma_px": 0.401, "held_out_px": 0.4}, "refuses"),
        ({"sigma_px": 0.401, "held_out_px": 0.4, "among": 1}, ""),
        # A camera alone cannot be better than any corner detector is.
        ({"sigma_px": 0.199, "held_out_px": 0.2, "alone_px": 0.01}, ""),
        ({"sigma_px": 0.201, "held_out_px": 0.2, "alone_px": 0.01}, "refuses"),
    ],
)
def test_a_camera_on_both_sides_of_its_limits(change, verdict) -> None:
    found = camera_findings(replace(GOOD, **change))
    assert told(found) == verdict, (change, [one.text for one in found])


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        ({"rank": 39, "weakest": "a.fx"}, "refuses"),
        ({"length_bias": 0.00199}, ""),
        ({"length_bias": -0.00201}, "warns"),
        ({"length_bias": -0.0099}, "warns"),
        ({"length_bias": 0.0101}, "refuses"),
        ({"halves_shape_rms_m": 0.00099}, ""),
        ({"halves_shape_rms_m": 0.00101}, "warns"),
        ({"halves_shape_rms_m": 0.0099}, "warns"),
        ({"halves_shape_rms_m": 0.0101}, "refuses"),
        ({"volume_std_m": 0.00099}, ""),
        ({"volume_std_m": 0.00101}, "warns"),
        ({"volume_std_m": 0.0099}, "warns"),
        ({"volume_std_m": 0.0101}, "refuses"),
        ({"n_lengths": 0, "length_bias": NAN, "halves_shape_rms_m": NAN}, "warns"),
        ({"n_lengths": 0, "length_bias": NAN, "halves_shape_rms_m": NAN, "cameras": 1}, ""),
    ],
)
def test_a_rig_on_both_sides_of_its_limits(change, verdict) -> None:
    found = rig_findings(replace(GOOD_RIG, **change))
    assert told(found) == verdict, (change, [one.text for one in found])


def test_what_is_said_names_the_camera_the_number_and_what_to_film() -> None:
    (one,) = camera_findings(replace(GOOD, views=5, empty=("top left", "bottom")))
    assert one.text == (
        "camera a: 5 views of the board, want 12 (least 6): film the board all over this camera's "
        "image, tilted 20 to 40 degrees; nothing seen top left and bottom"
    )


@pytest.mark.parametrize(("square", "spread"), [(26.0, 1.0), (26.2, 26.2 / 8.0)])
def test_halves_that_differ_by_more_than_chance_widen(square, spread) -> None:
    """One in a thousand of honest lenses of eight numbers is beyond 26.1."""
    assert spread_of(square, 8) == pytest.approx(spread)
