"""The paper's square with the sample's design for encoders: what the project's goals ask of it."""

import json

import pytest

from freeswing.main import main
from tests.places import SAMPLES

INCA = SAMPLES / "inca-6d"


@pytest.mark.slow
def test_the_square_is_held_within_the_goals(tmp_path):
    weights = ["--weights", str(INCA / "weights-encoders.toml"), "--method", "hinf-fastest"]
    words = ["--results", str(tmp_path)]
    assert main(["design", str(INCA), *weights, "--encoders", *words]) == 0
    runs = ["--friction-feed", "--survive", "--seed", "5"]
    assert main(["servo", str(INCA), "--task", str(INCA / "task.toml"), *runs, *words]) == 0
    trials = json.loads((tmp_path / "servo.json").read_text())["trials"]
    left = [1e3 * max(step["left_m"] for step in trial["steps"]) for trial in trials]
    late = [max(step["t90_s"] or 0.0 for step in trial["steps"]) for trial in trials]
    assert len(trials) == 7
    assert left[0] <= 0.5, left
    assert left[1] <= 5.0, left
    assert left[2] <= left[1] / 3, left
    assert max(late[:3]) <= 0.3, late
    for trial in trials:
        assert trial["held"], trial["why"]
        assert trial["outside"] == 0.0, trial["trial"]
