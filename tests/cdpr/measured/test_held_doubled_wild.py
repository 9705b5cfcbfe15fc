import numpy as np
import pytest

from freeswing.cdpr.files.problems import InputError
from freeswing.cdpr.measured.held_doubled_wild import (
    NORMAL_BY_MAD,
    _doubled,
    _is_finer,
    _single,
    check_stamps,
    sound_samples,
)
from freeswing.cdpr.measured.trajectory import Trajectory

TIMES = np.arange(400) / 100.0


def swing(noise=1e-4, step=1e-9, seed=0):
    """X and y in m, printed to a step."""
    waves = np.stack([0.1 * np.sin(4.0 * TIMES), 0.08 * np.cos(3.0 * TIMES)], axis=1)
    values = waves + noise * np.random.default_rng(seed).normal(size=waves.shape)
    return np.round(values / step) * step


def sound(values, times=TIMES):
    return sound_samples(Trajectory(times, ("x", "y"), values))


def test_a_clean_swing_is_left_as_it_is():
    made = Trajectory(TIMES, ("x", "y"), swing())
    assert sound_samples(made) is made


def test_a_capture_that_stalls_loses_its_repeats_alone():
    values = swing()
    values[100:131] = values[100]
    found = sound(values)
    assert np.flatnonzero(~found.is_known).tolist() == list(range(101, 131))
    assert found.notes == (
        "the same sample stands from 1.00 s on for 0.30 s: the capture stalled; the repeats are "
        "left out",
    )


@pytest.mark.parametrize(("alike", "is_held"), [(5, False), (6, True)])
def test_so_many_samples_alike_are_held(alike, is_held):
    values = swing()
    values[100 : 100 + alike] = values[100]
    assert bool(sound(values).notes) == is_held


def test_coarse_numbers_that_repeat_are_no_stall():
    values = swing(noise=0.0, step=0.02)
    assert (np.diff(values, axis=0) == 0.0).all(axis=1).mean() > 0.5
    assert sound(values).notes == ()


@pytest.mark.parametrize("times_each", [2, 3])
def test_samples_written_several_times_are_used_once(times_each):
    values = np.repeat(swing(), times_each, axis=0)
    times = np.arange(len(values)) / (100.0 * times_each)
    found = sound(values, times)
    assert np.array_equal(found.values, swing())
    assert found.sample_rate_hz == pytest.approx(100.0)
    assert f"every sample stands {times_each} times" in found.notes[0]


@pytest.mark.parametrize(("size_m", "is_wild"), [(1.0, True), (0.05, True), (2e-3, False)])
def test_a_wild_sample_is_left_out_and_named(size_m, is_wild):
    values = swing()
    values[250, 1] += size_m
    found = sound(values)
    assert np.flatnonzero(~found.is_known).tolist() == ([250] if is_wild else [])
    if is_wild:
        assert f"the sample at 2.50 s is {1e3 * size_m:.0f}." in found.notes[0].replace(
            "999.", "1000."
        ).replace("49.", "50.")
        assert "off its neighbours in y" in found.notes[0]


BLOCKS = {
    "two": (250, 252),
    "ten": (250, 260),
    "half a second": (250, 301),
    "first": (0, 1),
    "first five": (0, 5),
    "last": (399, 400),
    "last five": (395, 400),
}


@pytest.mark.parametrize("block", BLOCKS)
@pytest.mark.parametrize("size_m", [0.03, -0.5])
def test_wild_samples_together_are_left_out_and_named(block, size_m):
    values, (first, end) = swing(), BLOCKS[block]
    values[first:end, 1] += size_m
    found = sound(values)
    assert np.flatnonzero(~found.is_known).tolist() == list(range(first, end))
    (note,) = found.notes
    when = f"{TIMES[first]:.2f} s is" if end == first + 1 else f"to {TIMES[end - 1]:.2f} s are"
    assert when in note
    assert note.endswith("left out")
    assert abs(float(note.partition(" mm off")[0].rpartition(" ")[2]) - 1e3 * abs(size_m)) < 25.0


def motion_of(kind):
    """Motions that look wild and are none."""
    values = swing()
    if kind == "pushed camera":  # stays where it is
        values[200:, 0] += 0.05
    if kind == "longer than half a second":
        values[200:260, 0] += 0.05
    if kind == "release":  # a jerk, not a jump
        values[:150] = values[150]
        values += 1e-4 * np.random.default_rng(3).normal(size=values.shape)
    if kind == "knocked against a stop":  # velocities of 1 m/s turn round within a sample
        values[:, 0] = 0.02 * np.abs(np.mod(TIMES, 0.08) - 0.04) / 0.02
        values[:, 0] += 1e-5 * np.random.default_rng(4).normal(size=len(TIMES))
    if kind == "between gaps":  # what happened meanwhile nobody knows
        values[195:200] = np.nan
        values[210:215] = np.nan
        values[200:210, 0] += 0.004
    if kind == "3 mm":
        values[200:210, 0] += 0.0028
    if kind == "to and fro":  # there by 50 mm, back by 20
        values[200:210, 0] += 0.05
        values[210:, 0] += 0.03
    if kind == "noisy":  # 40 deviations are none
        values = swing(noise=2e-3)
        values[200:210, 0] += 0.04
    return values


@pytest.mark.parametrize(
    "kind",
    [
        "pushed camera", "longer than half a second", "release", "knocked against a stop",
        "between gaps", "3 mm", "to and fro", "noisy",
    ],
)  # fmt: skip
def test_what_may_be_motion_stays(kind):
    values = motion_of(kind)
    found = sound(values)
    assert found.notes == ()


@pytest.mark.parametrize(
    ("noise", "out_m", "back_m", "is_wild"),
    [
        (2e-3, 0.078, 0.078, False),
        (2e-3, 0.086, 0.086, True),
        (1e-6, 2.8e-3, 2.8e-3, False),
        (1e-6, 3.2e-3, 3.2e-3, True),
        (1e-6, 0.05, 0.036, True),
        (1e-6, 0.05, 0.034, False),
    ],
)
def test_how_far_out_and_back_is_wild(noise, out_m, back_m, is_wild):
    values = 0.1 * swing(noise=10.0 * noise)
    values[250:260, 0] += out_m
    values[260:, 0] += out_m - back_m
    assert bool(sound(values).notes) == is_wild


@pytest.mark.parametrize(
    ("factor", "unit"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")]
)
def test_times_in_another_unit_are_named(factor, unit):
    with pytest.raises(InputError, match=rf"as {unit} that is 100 Hz: times are in seconds"):
        check_stamps(Trajectory(factor * TIMES, ("x", "y"), swing()), "a.csv")
    check_stamps(Trajectory(1.7e9 + TIMES, ("x", "y"), swing()), "a.csv")
    check_stamps(Trajectory(50.0 * TIMES, ("x", "y"), swing()), "a.csv")


@pytest.mark.parametrize(("typical", "finer"), [(4.6, False), (5.5, True)])
def test_numbers_written_finer_than_neighbours_differ(typical, finer):
    """The least step is the print's; the median one that many of it."""
    values = np.cumsum([0.0, 1.0] + [typical] * 12)[:, None]
    assert _is_finer(values, np.zeros(13, bool)) == finer


@pytest.mark.parametrize(("share", "doubled"), [(0.37, False), (0.44, True)])
def test_so_many_samples_repeated_are_a_rate_written_twice(share, doubled):
    values = swing()
    for k in range(1, round(share * 399) + 1):
        values[2 * k - 1] = values[2 * k - 2]
    assert (_doubled(Trajectory(TIMES, ("x", "y"), values)) is not None) == doubled


@pytest.mark.parametrize(("times_each", "doubled"), [(4, True), (5, False)])
def test_written_more_often_it_is_a_stall(times_each, doubled):
    values = np.repeat(swing(), times_each, axis=0)
    made = Trajectory(np.arange(len(values)) / 100.0, ("x", "y"), values)
    assert (_doubled(made) is not None) == doubled


def with_spike(deviations: float, lopsided: float = 0.0) -> np.ndarray:
    """A wild sample of so many deviations; a neighbour is off by a share of it besides."""
    column = swing()[:, 0]
    off = column[1:-1] - 0.5 * (column[2:] + column[:-2])
    usual = NORMAL_BY_MAD * np.median(np.abs(off))
    size = deviations * usual
    column[250] += size - off[249]
    column[249] += lopsided * size
    return column[:, None]


@pytest.mark.parametrize(("deviations", "wild"), [(45.0, False), (56.0, True)])
def test_a_sample_is_wild_beyond_fifty_deviations(deviations, wild):
    assert bool(_single(with_spike(deviations), TIMES)[250]) == wild


@pytest.mark.parametrize(("lopsided", "wild"), [(0.21, True), (0.26, False)])
def test_a_wild_sample_pulls_both_neighbours_by_half(lopsided, wild):
    """What moves a neighbour too is a motion: here/after keep half, before is that far from it."""
    assert bool(_single(with_spike(1000.0, lopsided), TIMES)[250]) == wild


@pytest.mark.parametrize(("step_s", "followed"), [(0.9, True), (1.1, False)])
def test_steps_at_which_no_swing_is_followed(step_s, followed):
    made = Trajectory(step_s * np.arange(50.0), ("x", "y"), swing()[:50])
    if followed:
        check_stamps(made, "a.csv")
    else:
        with pytest.raises(InputError, match="times are in seconds"):
            check_stamps(made, "a.csv")


def thinned(seed: int, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every tenth row thrown away, stamps kept: twice and three times the step here and there."""
    keep = np.random.default_rng(seed).random(len(TIMES)) > 0.1
    keep[[0, 249, 250, 251]] = True
    return values[keep], TIMES[keep]


@pytest.mark.parametrize("seed", range(20))
def test_steps_over_dropped_rows_are_no_jumps(seed):
    """A turn of 1.5 rad/s: three steps at once are 45 mrad."""
    values = swing(noise=3e-4, seed=seed)
    values[:, 0] = 1.5 * TIMES + 3e-4 * np.random.default_rng(seed).normal(size=len(TIMES))
    values, times = thinned(seed, values)
    found = sound_samples(Trajectory(times, ("chi", "y"), values))
    assert found.notes == ()


@pytest.mark.parametrize("seed", range(5))
def test_wild_samples_beside_dropped_rows_are_found(seed):
    values = swing()
    values[250, 1] += 0.05
    values[100:120, 0] += 0.3
    values, times = thinned(seed, values)
    found = sound(values, times)
    off = times[~found.is_known]
    assert 2.5 in off
    assert np.array_equal(off[off < 2.0], times[(times > 0.995) & (times < 1.195)]), off
    assert len(found.notes) == 2, found.notes


def test_whole_millimetres_with_dropped_rows_are_no_wild_samples():
    """Most second differences are then zero, but for the last digit of a double."""
    values, times = thinned(4, 0.2 * swing(noise=1e-5, step=5e-3))
    assert sound(np.round(values, 3), times).notes == ()
