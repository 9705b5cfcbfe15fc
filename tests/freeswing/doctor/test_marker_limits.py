"""What `check` says of markers and repeated runs, on both sides of every limit."""

from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.cdpr.measured.trajectory import Trajectory
from freeswing.doctor import markers
from freeswing.results.comparison import Row, Side, _verdict
from freeswing.session.repeated_runs import share_samples


def levels(found) -> list[str]:
    return [one.level for one in found if one.level != "note"]


def rigidity(**changes):
    """A run's markers, all alike to a micrometre but for the changes."""
    seen = {"left_out": (), "std_m": np.full(4, 1e-6), "all_m": 1e-6, "kept_m": 1e-6}
    run = {"layout_change_m": np.zeros((4, 3)), "trajectory": SimpleNamespace(slow=None)}
    found = SimpleNamespace(**{key: changes.get(key, value) for key, value in seen.items()})
    recording = SimpleNamespace(names=tuple("PABC"))
    examined = SimpleNamespace(rigidity=found, recording=recording)
    more = {key: changes.get(key, value) for key, value in run.items()}
    return SimpleNamespace(examined=examined, **more)


@pytest.mark.parametrize(("size", "said"), [(1.9e-3, []), (2.1e-3, ["warning"])])
def test_a_marker_lies_where_the_target_has_it_to_two_millimetres(size, said):
    target = SimpleNamespace(marker_names=tuple("PABC"))
    change = np.zeros((4, 3))
    change[1, 0] = size
    layout = SimpleNamespace(
        change_m=change, layout_m=np.zeros((4, 3)), from_target=None, run_std_m=1e-5
    )
    assert levels(markers._layout(SimpleNamespace(layout=layout, target=target))) == said


@pytest.mark.parametrize(("size", "level"), [(4.9e-3, "note"), (5.1e-3, "warning")])
def test_a_jump_is_another_reflection_beyond_five_millimetres(size, level):
    jump = SimpleNamespace(frames=np.array([3]), most_m=size, marker=1)
    faults = SimpleNamespace(exchanges=(), jumps=(jump,))
    recording = SimpleNamespace(names=tuple("PABC"), notes=(), times_s=np.arange(9.0))
    examined = SimpleNamespace(recording=recording, order=None, faults=faults, stand_outs=())
    (found,) = markers._faults("run a", SimpleNamespace(examined=examined))
    assert found.level == level


@pytest.mark.parametrize(("times", "said"), [(2.9, []), (3.1, ["warning"])])
def test_a_run_deserves_less_trust_from_three_times_the_usual(times, said):
    assert levels(markers._rigidity("run a", rigidity(kept_m=times * 1e-6), 1e-6)) == said


@pytest.mark.parametrize(("size", "said"), [(1.9e-3, []), (2.1e-3, ["warning"])])
def test_a_marker_was_touched_where_it_sits_two_millimetres_off(size, said):
    change = np.zeros((4, 3))
    change[2, 1] = size
    assert levels(markers._rigidity("run a", rigidity(layout_change_m=change), 1e-6)) == said


@pytest.mark.parametrize(("shared", "same"), [(35, False), (36, True)])
def test_runs_are_the_same_where_half_of_the_shorter_ones_stretches_are(shared, same):
    """Of 57 stretches of eight of 64 samples, 28 and 29 stand in 35 and 36 shared ones."""
    rng = np.random.default_rng(0)
    first, second = rng.normal(size=(64, 1)), rng.normal(size=(64, 1))
    second[:shared] = first[:shared]
    times = np.arange(64) / 100.0
    one, other = (Trajectory(times, ("x",), values) for values in (first, second))
    assert share_samples(one, other) == same


@pytest.mark.parametrize(("z", "words"), [(2.9, "they agree"), (-3.1, "they differ")])
def test_results_differ_beyond_three_deviations(z, words):
    side = Side(name="b", source="s")
    row = Row(name="com_x_m", values=(0.0, 1.0), stds=(0.1, 0.1), z=(None, z))
    assert words in _verdict(side, side, 1, [row])
