"""A lens model too small for the lens is named by views not fitted; a fitting one is left alone."""

import pytest

from freeswing.calib.camera.lens_choice import lens_warnings, weigh_lenses
from freeswing.calib.rig.solve_rig import solve_rig, start_cameras
from tests.calib import rigs


@pytest.mark.parametrize(("model", "advice"), [("PINHOLE", "OPENCV"), ("OPENCV", "")])
def test_held_out_views_choose_the_lens(model, advice):
    """Lenses that bend by some pixels, seen to 0.1 px."""
    cameras, points = rigs.rig(2), rigs.board()
    views = rigs.observe(cameras, rigs.poses(cameras, 24), points, 0.1)
    names, sizes = tuple(c.name for c in cameras), tuple(c.size_px for c in cameras)
    rig = solve_rig(points, start_cameras(names, sizes, (model,) * 2, points, views))
    choices = weigh_lenses(rig)
    assert [choice.advice for choice in choices] == [advice] * 2, choices
    said = lens_warnings(rig.cameras, choices)
    assert len(said) == 2 * bool(advice), said
    best = choices[0].held_out_px["OPENCV"]
    assert 0.08 < best < 0.13, f"{best} px on views not fitted, noise 0.1"
