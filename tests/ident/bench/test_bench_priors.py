"""What a bench takes for granted of what nobody measured: each width from what bodies can be."""
# Stubs stand for what is not looked at.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from freeswing.ident.bench import assemble, fit_rounds
from freeswing.ident.bench.assemble import Guess
from freeswing.ident.bench.channels import Channel
from freeswing.ident.bench.first_guesses import _variance
from freeswing.ident.bench.priors import wire_priors
from freeswing.ident.bench.priors.body_priors import platform_block, wide_body
from freeswing.ident.bench.priors.channel_priors import channel_blocks, gain_spread
from freeswing.ident.bench.priors.motion_priors import (
    amplitude_block,
    creep_block,
    loose_coordinates,
)
from freeswing.ident.bench.runs import Bench, BenchRun, KnownBody, Signal
from freeswing.ident.bench.swing import COMMON
from freeswing.ident.likelihood.unknowns import Gaussian, Unknown, Unknowns

TIMES = np.linspace(0.0, 1.0, 11)
RADIUS_M = 0.25
ENDS = RADIUS_M * np.array([[1.0, 0.0, 0.0], [-0.5, 0.75**0.5, 0.0], [-0.5, -(0.75**0.5), 0.0]])
MASS_KG = 2.0
TRIFILAR = SimpleNamespace(robot=SimpleNamespace(n_cables=3))
BODY = np.array([MASS_KG, 0.0, 0.0, 0.0, 0.03, 0.03, 0.04, 0.0, 0.0, 0.0])


def robot(gravity=(0.0, 0.0, -9.8)) -> SimpleNamespace:
    return SimpleNamespace(attachments_m=ENDS, gravity_m_s2=np.array(gravity), n_cables=3)


def run(**more) -> BenchRun:
    return BenchRun("a", "identify", TIMES, (Signal("chi", TIMES),), np.full(3, 1.5), **more)


def platform(gravity=(0.0, 0.0, -9.8), **more) -> Unknown:
    return platform_block(robot(gravity), Bench(()), [run(**more)], BODY)


def blocks() -> Unknowns:
    """Those of one run of a platform of which nothing but its wires is known."""
    parameter = SimpleNamespace(prior_std=1.0, scale=1.0, amplitude=True)
    model = SimpleNamespace(robot=robot(), start_values=np.zeros(1), parameters=[parameter])
    chart = SimpleNamespace(numbers=lambda zeta, rates: np.zeros(6))
    swing = SimpleNamespace(wires="wires.1", chart=chart, columns=())
    first = SimpleNamespace(zeta=None, rates=None)
    one = run()
    return assemble._unknowns(model, Bench((one,)), [one], [swing], [first], Guess(BODY, {}), {})


def std_of(name: str) -> np.ndarray:
    block = blocks().block(name)
    assert block.prior is not None
    return block.prior.std


def test_wires_are_measured_by_tape_and_hang_as_they_did() -> None:
    """A tape's millimetre; a knot or a hook's 3 % of 1.5 m; between runs 0.15 mm."""
    assert std_of("wires.1")[0] == pytest.approx(1e-3, rel=0.15)
    assert std_of(COMMON)[0] == pytest.approx(0.045, rel=0.15)
    assert std_of("wires_each")[0] == pytest.approx(1.5e-4, rel=0.15)


def test_a_swing_stays_within_a_right_angle() -> None:
    """Three deviations of its start are 90 degrees: none of what a person lets go is wider."""
    assert 3.0 * std_of("start")[0] == pytest.approx(np.pi / 2.0, rel=0.15)


def test_a_centre_of_mass_among_wires_that_share_the_weight() -> None:
    """A centre beside the middle by d changes tensions by up to 2 d / r: 4 % here.

    Up and down it lies where a body fills or hangs in the wires' ring: between r / 4 and 0.36 r.
    """
    prior = platform().prior
    assert prior is not None
    assert 2.0 * prior.std[1] / RADIUS_M == pytest.approx(0.04, rel=0.15)
    assert 0.25 < prior.std[3] / RADIUS_M < 0.36


@pytest.mark.parametrize(("down", "along"), [(0.87, False), (0.93, True)])
def test_a_platform_hangs_along_an_axis_of_its_own(down, along) -> None:
    """Gravity leans to x: only within 26 degrees does the centre lie anywhere along z."""
    prior = platform((9.8 * np.sqrt(1.0 - down**2), 0.0, -9.8 * down)).prior
    assert prior is not None
    assert (prior.std[3] > 5.0 * prior.std[1]) == along


def test_a_mass_that_payloads_are_to_tell_is_known_to_half_of_it() -> None:
    weight = KnownBody(0.3, np.zeros(3), np.zeros(6))
    block = platform(payloads=(weight,))
    assert block.prior is not None
    assert block.prior.std[0] == pytest.approx(0.5 * MASS_KG, rel=0.15)
    trusted = platform()
    assert block.estimated is not None
    assert trusted.estimated is not None
    assert block.estimated[0]
    assert not trusted.estimated[0]


def test_a_body_of_which_only_the_size_is_known() -> None:
    """Moments up to two hoops through the wires; products of a body of 1 to 2.5 at 25 degrees.

    About whichever of its axes Izz is.
    """
    wide = wide_body(MASS_KG, RADIUS_M, 1.0)
    assert wide[3] == pytest.approx(2.0 * MASS_KG * RADIUS_M**2, rel=0.15)
    turn = np.deg2rad(25.0)
    product = 0.75 * np.sin(2.0 * turn)
    least, most = (1.75 + sign * 0.75 * np.cos(2.0 * turn) for sign in (-1.0, 1.0))
    assert product / most < wide[6] < 0.8 * product / least


def test_a_twist_of_twice_the_usual_is_one_deviation_off() -> None:
    prior = amplitude_block(Channel("dot", "dot_px", ("chi", "x"))).prior
    assert prior is not None
    assert prior.std[0] == pytest.approx(2.0**2 - 1.0, rel=0.15)


def test_yaw_may_creep_by_what_sway_of_half_its_energy_does() -> None:
    """Energy sets the frequency as the amplitude's square does: half of it may come or go."""
    prior = creep_block(3).prior
    assert prior is not None
    assert prior.std[0] == pytest.approx(0.5, rel=0.15)


def test_a_quiet_angle_counts_as_if_rest_leant_by_six_degrees() -> None:
    """Yaw about a vertical that leans so shows by its sine in pitch, of which no guess knows."""
    yaw, pitch = np.sin(np.linspace(0.0, 60.0, 4000)), np.zeros(4000)
    view = SimpleNamespace(
        values=np.column_stack([pitch, yaw, 5.0 * yaw]),
        known=np.ones((4000, 3), dtype=bool),
        direct=np.ones(3, dtype=bool),
        seen=np.eye(6)[[4, 5, 0]],  # two angles, and x, which is none
    )
    leans = np.sin(np.deg2rad(5.7)) * yaw
    assert _variance(view, 0) == pytest.approx(float(np.var(leans)), rel=0.15)
    assert _variance(view, 1) == pytest.approx(float(np.var(yaw)), rel=0.02)


def test_what_no_column_shows_stays_small() -> None:
    """Sway by a degree of the wires' length, an angle by 17 degrees; what is seen is free."""
    loose = loose_coordinates((SimpleNamespace(coordinate=5),), np.full(3, 1.5))
    np.testing.assert_allclose(loose[:3], 1.5 * np.deg2rad(1.15), rtol=0.15)
    np.testing.assert_allclose(loose[3:5], np.deg2rad(17.0), rtol=0.15)
    assert np.isinf(loose[5])


def test_a_dot_on_a_wall() -> None:
    """tan(angle + chi) over its slope: a wall hit at 60 degrees is within the deviations.

    One hit at 65 is beyond, in squares and in cubes; half a metre away the sway's gain is twice the
    yaw's.
    """
    channel = Channel("dot", "dot_px", ("chi", "x"), order=3)
    spread = dict(zip(channel.term_names, gain_spread(channel, np.full(9, 100.0)), strict=True))
    assert spread["chi"] == pytest.approx(100.0, rel=0.15)
    assert spread["x"] == pytest.approx(100.0 / 0.5, rel=0.15)
    near, far = (np.tan(np.deg2rad(angle)) for angle in (60.0, 65.0))
    assert near < spread["chi*chi"] / 100.0 < far
    cube_near, cube_far = ((1.0 + 3.0 * t**2) / 3.0 for t in (near, far))
    assert cube_near < spread["chi*chi*chi"] / 100.0 < cube_far


def test_a_channels_zero_is_anywhere_within_ten_of_its_spread() -> None:
    channel = Channel("dot", "dot_px", ("chi",))
    values = np.array([1.0, -1.0] * 20)
    column = SimpleNamespace(channel=channel, values=values)
    swing = SimpleNamespace(columns=(column,))
    zero, _ = channel_blocks(channel, [swing], [], np.array([100.0]))
    assert zero.prior is not None
    assert zero.prior.std[0] == pytest.approx(10.0, rel=0.15)


@pytest.mark.parametrize(("order", "allowed"), [(3, True), (4, False)])
def test_a_channels_polynomial_ends_at_cubes(order, allowed) -> None:
    told = None
    try:
        Channel("dot", "dot_px", ("chi",), order=order)
    except ValueError as refused:
        told = refused
    assert (told is None) == allowed, told


def test_lengths_of_mean_poses_are_as_good_as_the_wires_ends(monkeypatch) -> None:
    """Two ends of a millimetre and a half each."""
    monkeypatch.setattr(wire_priors, "evaluate", lambda *_: (np.ones((11, 3)),))
    poses = tuple(Signal(name, TIMES) for name in ("x", "y", "z", "phi", "theta", "chi"))
    monkeypatch.setattr(wire_priors, "POSE_COORDINATES", [one.column for one in poses])
    given = replace(run(), lengths_m=None, signals=poses)
    found = wire_priors.with_lengths(SimpleNamespace(lengths=None, start_values=None), given)
    assert found.lengths_std_m == pytest.approx(np.hypot(1.5e-3, 1.5e-3), rel=0.1)


def test_a_run_whose_izz_is_a_hundredth_off_is_lost(monkeypatch) -> None:
    asked = []
    prior = Gaussian(np.full(10, 5.0), np.full(10, 0.1), "declared")
    body = np.array([5.0, 0.0, 0.0, 0.0, 5.0, 5.0, 5.0, 0.0, 0.0, 0.0])
    start = Unknown("platform", body, np.ones(10), prior)
    known = Unknowns((start,)).joined(Unknown(COMMON, np.zeros(1), np.ones(1)))
    fitted = {
        "value": lambda name: start.value, "std": lambda name: np.full(10, 0.1),
        "covariance_of": lambda name: np.eye(10), "covariance": np.eye(11),
    }  # fmt: skip

    def fit(_swings, unknowns, how):
        asked.append(unknowns)
        return SimpleNamespace(**fitted, unknowns=unknowns)

    monkeypatch.setattr(fit_rounds, "fit", fit)
    monkeypatch.setattr(fit_rounds, "_rough", lambda swings, unknowns: unknowns)
    monkeypatch.setattr(
        fit_rounds,
        "first_fit",
        lambda swings, unknowns: fit_rounds.fit(swings, unknowns, fit_rounds.ROUGH),
    )
    monkeypatch.setattr(fit_rounds, "_fastest", lambda *_: 1.0)
    monkeypatch.setattr(fit_rounds, "rescaled", lambda swings, *_, **__: swings)
    monkeypatch.setattr(
        fit_rounds, "weighed_mass", lambda bench, model, swings, found, *_: (found, None)
    )
    monkeypatch.setattr(fit_rounds, "considered", lambda swings, found, held: found)
    monkeypatch.setattr(fit_rounds, "replace", lambda found, **_: found)
    monkeypatch.setattr(fit_rounds, "scatter_std", lambda found: 0.0)
    none = SimpleNamespace(coordinates=(), signals=())
    ready = SimpleNamespace(swings=tuple(range(5)), unknowns=known, runs=[none] * 5)
    fit_rounds.solved(TRIFILAR, Bench(()), ready)
    priors = [b.prior for one in asked for b in one.blocks if b.name == "scatter"]
    assert priors, "it was looked for"
    assert priors[0].std[0] == pytest.approx(0.01 * 5.0, rel=0.15)
