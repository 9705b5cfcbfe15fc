"""FIDIM's algebra: total least squares as published, essential parameters, rank loss, payloads."""

from __future__ import annotations

import numpy as np
import pytest

from freeswing.cdpr.model.regressor import regressor
from freeswing.cdpr.robot import INERTIA_NAMES
from freeswing.ident.fidim.essential_parameters import essential_parameters, near_zero
from freeswing.ident.fidim.fidim import fidim
from freeswing.ident.fidim.payload_mass import LoadedCentre, mass_from_payloads
from freeswing.ident.fidim.total_least_squares import total_least_squares
from freeswing.ident.judge.free_against_full import compare
from freeswing.ident.judge.validate import sigma_perp
from freeswing.ident.runs import Payload
from freeswing.ident.signals.derivatives import Signals
from freeswing.ident.signals.motions import free_motion, full_motion
from tests.ident.swings import REGULAR, TRUE_INERTIA, lengths_of, paper_model, swing

CHI = np.concatenate([[1.0], TRUE_INERTIA])


def exact_signals(equilibrium: int, **release: float) -> tuple[Signals, np.ndarray]:
    """True poses and derivatives every 0.1 s, and the lengths."""
    motion = swing(equilibrium, **release)
    times = np.arange(100) / 10.0
    zetas, rates, accelerations = motion.at(times)
    names = ("x", "y", "z", "phi", "theta", "chi")
    covariances = np.broadcast_to(1e-12 * np.eye(18), (100, 18, 18))
    made = Signals(
        "exact", names, times, zetas, rates, accelerations, covariances, np.full(6, 1e-6),
        (0.0, 10.0), 5.0, 0.0, 0,
    )  # fmt: skip
    return made, lengths_of(motion)


def exact_regressors(full: bool, equilibria=REGULAR) -> list[np.ndarray]:
    model, found = paper_model(), []
    for equilibrium in equilibria:
        signals, lengths = exact_signals(equilibrium)
        if full:
            motion = full_motion(model, signals, ("x", "y"))
        else:
            selected = signals.select(("x", "y"))
            motion = free_motion(model, selected, lengths, signals.values[0])
        found.append(regressor(model, motion))
    return found


def random_system(noise: float, seed: int = 0) -> np.ndarray:
    """W with W chi = 0 but for noise, (600, 10)."""
    generator = np.random.default_rng(seed)
    W = generator.standard_normal((600, 10)) * 3.0
    W[:, 0] -= W @ CHI
    return W + noise * generator.standard_normal(W.shape)


@pytest.mark.parametrize("full", [True, False])
def test_exact_swings_give_the_exact_inertia(full: bool):
    """The regressor vanishes on the true inertia: two separate paths to the pose agree with it."""
    found = fidim(exact_regressors(full))
    error = np.abs(found.values - TRUE_INERTIA).max()
    assert error < 1e-6, f"largest error {error}"
    assert found.solution.sigma_W < 1e-6, f"sigma_W {found.solution.sigma_W}"


def test_published_formulas_literally():
    """Eqs. (28)-(34), (40) as printed, against the triangular shortcut."""
    W = random_system(0.05)
    left, sizes, right = np.linalg.svd(W, full_matrices=False)
    W_hat = W - sizes[9] * np.outer(left[:, 9], right[9])
    chi = right[9] / right[9, 0]
    sigma = sizes[9] / np.sqrt(len(W) - 10)
    inverse = np.linalg.inv(W_hat[:, 1:].T @ W_hat[:, 1:])
    covariance = sigma**2 * (1 + np.sum(chi[1:] ** 2)) * inverse
    found = total_least_squares(W)
    assert np.allclose(found.values, chi[1:], rtol=1e-9), f"{found.values} {chi[1:]}"
    assert np.allclose(found.covariance, covariance, rtol=1e-7), "covariance differs"
    assert found.sigma_W == pytest.approx(sigma), f"{found.sigma_W} {sigma}"
    assert found.cost_C == pytest.approx((sizes[0] + 1) / sizes[8]), f"{found.cost_C}"


def test_standard_deviations_cover_when_the_assumption_holds():
    """Equal independent noise in all of W: 95 % intervals hold the truth 92 to 98 times in 100."""
    inside = []
    for seed in range(200):
        found = total_least_squares(random_system(0.05, seed))
        inside.append(np.abs(found.values - TRUE_INERTIA) < 1.96 * found.std)
    share = np.mean(inside)
    assert 0.92 < share < 0.98, f"coverage {share}"


def test_too_few_rows_and_bad_numbers_are_refused():
    with pytest.raises(ValueError, match="8 equations for 9 unknowns"):
        total_least_squares(np.ones((8, 10)))
    W = random_system(0.1)
    W[3, 3] = np.nan
    with pytest.raises(ValueError, match="not finite"):
        total_least_squares(W)


def test_essential_parameters_by_the_ten_percent_rule():
    found = fidim([random_system(0.01).reshape(-1, 2, 10)])
    essential = essential_parameters(random_system(0.01))
    weak = found.solution.std_percent > 10.0
    names = np.array(INERTIA_NAMES)
    assert (essential == ~(weak & near_zero(TRUE_INERTIA))).all(), f"{names[essential]}"
    assert essential[[2, 3, 4, 5]].all(), f"{names[essential]}"
    assert not essential[6:].any(), f"{names[essential]}"
    assert len(found.reduced.values) == essential.sum(), f"{len(found.reduced.values)}"


def test_a_large_uncertain_parameter_is_reported_not_dropped():
    W = random_system(0.0)
    generator = np.random.default_rng(1)
    W[:, 4] *= 1e-3  # Ixx hardly acts
    W[:, 0] -= W @ CHI
    found = fidim([(W + 1e-3 * generator.standard_normal(W.shape)).reshape(-1, 2, 10)])
    assert found.essential[3], "Ixx was dropped though it is not near zero"
    assert any("Ixx_m2" in said for said in found.verdicts), f"{found.verdicts}"


def test_one_equilibrium_and_one_mode_lose_rank_or_excite_poorly():
    """Negative controls: said in words, with the parameters that stay in the dark."""
    model = paper_model()
    signals, _ = exact_signals(11, dx_m=1e-4, dy_m=0.0)
    generator = np.random.default_rng(0)
    W = regressor(model, full_motion(model, signals, ("x", "y")))
    with pytest.raises(ValueError, match=r"do not determine .* record larger swings"):
        fidim([W + 1e-3 * generator.standard_normal(W.shape)])
    signals, _ = exact_signals(11, dx_m=2e-3, dy_m=1e-3)
    wider = fidim([regressor(model, full_motion(model, signals, ("x", "y")))])
    assert any("poor excitation" in said for said in wider.verdicts), f"{wider.verdicts}"


def test_sigma_perp_is_the_error_per_sample():
    W = exact_regressors(True, (5,))[0]
    assert sigma_perp(W, TRUE_INERTIA) < 1e-6, f"{sigma_perp(W, TRUE_INERTIA)}"
    wrong = TRUE_INERTIA + np.eye(9)[2] * 0.01
    error = W @ np.concatenate([[1.0], wrong])
    expected = np.sqrt(np.sum(error**2) / 100)
    assert sigma_perp(W, wrong) == pytest.approx(expected), f"{sigma_perp(W, wrong)}"


def loaded_centre(mass: float, com: np.ndarray, payload: Payload, covariance: np.ndarray):
    total = mass + payload.mass_kg
    at = (mass * com + payload.mass_kg * payload.position_m) / total
    return LoadedCentre(payload, at, covariance)


def test_mass_from_payloads_is_exact_without_noise():
    com, tiny = TRUE_INERTIA[:3], 1e-10 * np.eye(3)
    loads = [Payload(1.0, np.array([0.2, 0.0, 0.05])), Payload(0.5, np.array([0.0, -0.15, 0.0]))]
    found = mass_from_payloads(com, tiny, [loaded_centre(8.0, com, p, tiny) for p in loads])
    assert found.mass_kg == pytest.approx(8.0, rel=1e-9), f"{found.mass_kg}"


def test_mass_intervals_cover():
    """Unloaded and loaded centres with noise: z-scores of the mass are standard."""
    generator = np.random.default_rng(2)
    com = TRUE_INERTIA[:3]
    covariance = np.diag([1e-4, 2e-4, 4e-4]) ** 2
    loads = [Payload(1.0, np.array([0.3, 0.0, 0.05])), Payload(1.0, np.array([0.0, -0.3, 0.0]))]
    scores = []
    for _ in range(300):
        centres = []
        for payload in loads:
            one = loaded_centre(8.0, com, payload, covariance)
            off = generator.multivariate_normal(np.zeros(3), covariance)
            centres.append(LoadedCentre(payload, one.com_m + off, covariance))
        base = com + generator.multivariate_normal(np.zeros(3), covariance)
        found = mass_from_payloads(base, covariance, centres)
        scores.append((found.mass_kg - 8.0) / found.std_kg)
    assert 0.85 < np.std(scores) < 1.15, f"z-scores spread {np.std(scores)}"
    assert abs(np.mean(scores)) < 0.25, f"z-scores centre {np.mean(scores)}"


def test_a_payload_at_the_centre_gives_no_mass():
    com, spread = TRUE_INERTIA[:3], 1e-8 * np.eye(3)
    centre = loaded_centre(8.0, com, Payload(1.0, com), spread)
    with pytest.raises(ValueError, match="no usable mass"):
        mass_from_payloads(com, spread, [centre])


def test_comparison_is_eq_48():
    free, full = np.full(9, 2.0), np.full(9, 2.1)
    shown = np.arange(9) < 2
    rows = compare(free, np.full(9, 0.03), full, np.full(9, 0.04), shown)
    assert [row.name for row in rows] == list(INERTIA_NAMES[:2]), f"{rows}"
    assert rows[0].difference_percent == pytest.approx(5.0), f"{rows[0]}"
    assert rows[0].z == pytest.approx(2.0), f"{rows[0]}"
