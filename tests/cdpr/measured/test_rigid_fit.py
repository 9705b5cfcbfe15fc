import numpy as np
from scipy.spatial.transform import Rotation

from freeswing.cdpr.measured.rigid_fit import fit_rigid, is_planar_or_better
from freeswing.cdpr.rotation import exp_rotation, log_rotation

LAYOUT = np.array(
    [[0, 0, 0], [-0.18, -0.15, 0.04], [0.19, -0.14, 0.04], [0.2, 0.14, 0.04], [-0.19, 0.14, 0.04]]
)


def recorded(n=500, noise=0.0, seed=0, layout=LAYOUT):
    rng = np.random.default_rng(seed)
    R = exp_rotation(rng.normal(size=(n, 3)))
    t = rng.normal(size=(n, 3))
    points = np.einsum("tij,mj->tmi", R, layout) + t[:, None]
    return R, t, points + noise * rng.normal(size=points.shape), rng


def test_exact_points_give_exact_poses_down_to_three():
    R, t, points, rng = recorded()
    order = rng.permuted(np.tile(np.arange(5), (500, 1)), axis=1)
    points[np.arange(500)[:, None], order[:, :2]] = np.nan
    R_fit, t_fit = fit_rigid(LAYOUT, points)
    assert np.abs(R_fit - R).max() < 1e-12
    assert np.abs(t_fit - t).max() < 1e-12


def test_two_points_or_a_line_are_missing():
    line = np.outer(np.linspace(0, 1, 4), [1.0, 0.2, 0.1])
    assert not is_planar_or_better(line)
    _, _, points, _ = recorded(layout=line)
    assert np.isnan(fit_rigid(line, points)[1]).all()
    _, _, points, _ = recorded()
    points[:250, 2:] = np.nan
    R, t = fit_rigid(LAYOUT, points)
    assert np.isnan(R[:250]).all()
    assert np.isfinite(t[250:]).all()


def test_a_flat_layout_is_never_mirrored():
    flat = LAYOUT * [1, 1, 0]
    R, _, points, _ = recorded(noise=1e-3, layout=flat)
    R_fit, _ = fit_rigid(flat, points)
    worst = np.linalg.norm(log_rotation(R_fit @ R.swapaxes(1, 2)), axis=1).max()
    assert worst < 0.03, worst
    assert np.allclose(np.linalg.det(R_fit), 1.0)


def test_weighted_fit_agrees_with_scipy():
    _, _, points, rng = recorded(n=20, noise=0.05)
    weights = rng.uniform(0.1, 2.0, size=(20, 5))
    R, t = fit_rigid(LAYOUT, points, weights)
    for i in range(20):
        w = weights[i] / weights[i].sum()
        a, b = points[i] - w @ points[i], LAYOUT - w @ LAYOUT
        oracle = Rotation.align_vectors(a, b, weights[i])[0].as_matrix()
        assert np.abs(R[i] - oracle).max() < 1e-9, i
        assert np.allclose(t[i], w @ points[i] - oracle @ (w @ LAYOUT), atol=1e-9)
