"""Free and dependent coordinates: Xi-perp and its rate, conditioning, assembly modes."""

from itertools import combinations

import numpy as np
import pytest

from freeswing.cdpr.model.batch import evaluate
from freeswing.cdpr.model.equations import build_model
from freeswing.cdpr.model.free_motion import (
    admissible_rates,
    amplification,
    assemble,
    choose_free_coordinates,
    coordinate_indices,
    free_basis,
)
from freeswing.cdpr.robot import POSE_COORDINATES
from freeswing.cdpr.rotation import angle_rate_matrix
from freeswing.cdpr.simulation.free_swing import simulate
from tests.cdpr.model_cases import (
    ROBOTS,
    TABLE_2,
    random_states,
    report,
    rest_of,
    ring,
    robot_named,
    swing_start,
    true_inertia,
)

NONE = np.zeros(0)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
def test_every_choice_of_free_coordinates_spans_the_free_twists(n):
    model = build_model(ring(n))
    zetas, wishes = random_states(model.robot, 3, speed=0.2)
    inertia, tested = model.robot.inertia, 0
    rates = [admissible_rates(model, z, w, inertia) for z, w in zip(zetas, wishes, strict=True)]
    rates = np.array(rates)
    xi = evaluate(model.cables, zetas, [])[3].copy()
    xi[..., 3:] = xi[..., 3:] @ np.linalg.inv(angle_rate_matrix(zetas[:, 3:]))
    twists = (evaluate(model.twist_map, zetas, rates)[0] @ rates[..., None])[..., 0]
    for free in combinations(POSE_COORDINATES, 6 - n):
        amount = amplification(model, free, zetas).max()
        if amount > 100.0:
            continue
        tested += 1
        basis = free_basis(model, free, zetas, rates, NONE)
        chosen = coordinate_indices(free)
        follow = (basis.xi_perp @ rates[:, chosen, None])[..., 0]
        lengthening = np.abs(xi @ basis.xi_perp).max()
        assert lengthening < 1e-12 * amount, f"{free}: Xi Xi-perp is {lengthening:.1e}"
        assert np.abs(follow - twists).max() < 1e-12 * amount, free
    assert tested > 0


@pytest.mark.parametrize("name", ROBOTS)
def test_xi_perps_rate_is_a_difference_along_the_motion(name):
    model, inertia, zeta, rates = swing_start(name)
    motion = simulate(model, zeta, rates, (0.0, 0.5), inertia, tolerance_m=1e-13)
    free = choose_free_coordinates(model, zeta[None])[0]
    step, weights = 1e-3, ((1, 0.75), (2, -0.15), (3, 1 / 60))

    def at(time):
        poses, speeds, second = motion.at(np.array([time]))
        return free_basis(model, free, poses, speeds, NONE), speeds[0], second[0]

    middle, speed, second = at(0.25)
    for part in ("zeta_map", "xi_perp"):
        slope = sum(
            w * (getattr(at(0.25 + k * step)[0], part) - getattr(at(0.25 - k * step)[0], part))
            for k, w in weights
        )
        apart = np.abs(slope / step - getattr(middle, f"{part}_rate")).max()
        assert apart < 1e-7, f"{part}: {apart:.1e}"
    chosen = coordinate_indices(free)
    follow = middle.zeta_map[0] @ second[chosen] + middle.zeta_map_rate[0] @ speed[chosen]
    assert np.abs(follow - second).max() < 1e-10, "eqs. (7), (45)"


def test_near_singular_choices_are_told_apart():
    """Columns 1, 2 and 5 of Table 2: x and y make the rest of the pose move far more."""
    model = build_model(robot_named("bologna-4"))
    inertia = model.robot.inertia
    amounts = []
    for lengths in TABLE_2:
        rest = rest_of(model, inertia, lengths)
        amounts.append(float(amplification(model, ("x", "y"), rest.zeta)))
        best, least = choose_free_coordinates(model, rest.zeta[None])
        assert least < 1.3, f"{best}: {least:.2f}"
    report("amplification of x, y:", np.round(amounts, 1))
    worst = set(np.argsort(amounts)[-3:])
    assert worst == {0, 1, 4}, amounts
    assert min(amounts[k] for k in worst) > 15.0, amounts


def test_assembly_follows_a_swing():
    model, inertia, zeta, rates = swing_start("bologna-4")
    motion = simulate(model, zeta, rates, (0.0, 2.0), inertia)
    poses = motion.at(np.arange(0.0, 2.0, 0.01))[0]
    lengths = evaluate(model.lengths, zeta, [])[0]
    pairs = combinations(POSE_COORDINATES, 2)
    chosen = [pair for pair in pairs if amplification(model, pair, poses).max() < 10]
    assert len(chosen) >= 2, chosen
    for free in chosen:
        values = poses[:, coordinate_indices(free)]
        found = assemble(model, free, lengths, values, poses[0])
        apart = np.abs(found.zetas - poses).max()
        assert apart < 1e-9, f"{free}: {apart:.1e}"


def test_assembly_stops_where_the_mode_ends_and_never_jumps():
    """A fold of x, y: the mode cannot be followed beyond it, however the samples are spaced."""
    model = build_model(robot_named("bologna-4"))
    rest = rest_of(model, model.robot.inertia)
    way = np.linspace(0.0, 0.3, 301)[:, None] * [1.0, 0.0]
    values = rest.zeta[:2] + way
    ends = []
    for spacing in (1, 3, 20, 100):
        with pytest.raises(ValueError, match=r"sample \d+: .*\"auto\"") as error:
            assemble(model, ("x", "y"), rest.lengths_m, values[::spacing], rest.zeta)
        sample = int(str(error.value).split(":")[0].removeprefix("sample "))
        ends.append(way[::spacing][sample, 0])
        safe = assemble(model, ("x", "y"), rest.lengths_m, values[::spacing][:sample], rest.zeta)
        assert np.ptp(np.sign(safe.determinants)) == 0.0
    assert max(ends) - min(ends) <= 0.1 + 1e-9, f"ends at {ends} m"
    assert ends[0] == min(ends), ends


def test_assembly_names_wrong_inputs():
    model = build_model(robot_named("bologna-4"))
    rest = rest_of(model, model.robot.inertia)
    values = np.tile(rest.zeta[:2], (5, 1))
    values[3] = np.nan
    with pytest.raises(ValueError, match=r"sample 3: .*not finite"):
        assemble(model, ("x", "y"), rest.lengths_m, values, rest.zeta)
    with pytest.raises(ValueError, match=r"free_values has shape \(5, 3\)"):
        assemble(model, ("x", "y"), rest.lengths_m, np.zeros((5, 3)), rest.zeta)
    with pytest.raises(ValueError, match="4 cables leave 2"):
        assemble(model, ("x", "y", "z"), rest.lengths_m, values, rest.zeta)
    with pytest.raises(ValueError, match="not among the pose coordinates"):
        amplification(model, ("x", "yaw"), rest.zeta)


def test_admissible_rates_are_nearest_and_creep_along():
    model = build_model(robot_named("bologna-4"), ("winch_creep",))
    inertia, creep = true_inertia(model.robot), np.array([1e-3, -2e-3, 0.0, 5e-4])
    zetas, wishes = random_states(model.robot, 1)
    rates = admissible_rates(model, zetas[0], wishes[0], inertia, creep)
    jacobian = evaluate(model.cables, zetas[0], creep)[3]
    assert np.abs(jacobian @ rates - creep).max() < 1e-14
    free = np.linalg.svd(jacobian)[2][4:]
    assert np.abs(free @ (rates - wishes[0])).max() < 1e-14, "moved along a free direction"


def test_rates_are_admissible_where_cables_stretch():
    """The slip follows the rates through the tensions: three sweeps leave some."""
    values = np.array([4e-4, 4e-7])
    model, inertia, zeta, rates = swing_start("bologna-4", ("cable_elasticity",), values=values)
    found = admissible_rates(model, zeta, rates + 0.3, inertia, values)
    slip = evaluate(model.slip, 0.0, zeta, found, inertia, values)[0]
    assert np.abs(slip).max() < 1e-9, f"{np.abs(slip).max():.1e} m/s"
