"""The arrow solver against dense linear algebra."""

import numpy as np

from freeswing.homing.arrow_least_squares import (
    Linearization,
    covariance,
    huber_weights,
    solve_arrow,
)


def dense(by_block, by_border):
    count, rows, size = by_block.shape
    matrix = np.zeros((count * rows, count * size + by_border.shape[-1]))
    for k in range(count):
        matrix[k * rows : (k + 1) * rows, k * size : (k + 1) * size] = by_block[k]
        matrix[k * rows : (k + 1) * rows, count * size :] = by_border[k]
    return matrix


def problem(count=7, rows=9, size=6, border=4, seed=0):
    rng = np.random.default_rng(seed)
    by_block, by_border = (rng.standard_normal((count, rows, k)) for k in (size, border))
    data = rng.standard_normal((count, rows))

    def linearize(blocks, shared):
        predicted = np.einsum("nmp,np->nm", by_block, blocks) + by_border @ shared
        none = np.zeros(border)
        return Linearization(predicted - data, by_block, by_border, none, none)

    return linearize, by_block, by_border, data


def test_linear_problem_is_solved_as_dense_least_squares():
    linearize, by_block, by_border, data = problem()
    solution = solve_arrow(linearize, np.zeros((7, 6)), np.zeros(4))
    expected = np.linalg.lstsq(dense(by_block, by_border), data.ravel(), rcond=None)[0]
    found = np.concatenate([solution.blocks.ravel(), solution.border])
    worst = np.abs(found - expected).max()
    assert solution.converged
    assert worst < 1e-9, f"differs from dense least squares by {worst:.1e}"


def test_covariance_and_predicted_variances_are_those_of_the_dense_inverse():
    linearize, by_block, by_border, _ = problem()
    linear = linearize(np.zeros((7, 6)), np.zeros(4))
    found = covariance(linear, np.ones((7, 9)))
    matrix = dense(by_block, by_border)
    inverse = np.linalg.inv(matrix.T @ matrix)
    assert found.rank == 4
    worst = np.abs(found.border - inverse[42:, 42:]).max()
    assert worst < 1e-12, f"border {worst:.1e}"
    blocks = np.array([inverse[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] for k in range(7)])
    worst = np.abs(found.blocks() - blocks).max()
    assert worst < 1e-12, f"blocks {worst:.1e}"
    hat = np.diag(matrix @ inverse @ matrix.T).reshape(7, 9)
    worst = np.abs(found.predicted(by_block, by_border) - hat).max()
    assert worst < 1e-12, f"variances of fitted residuals {worst:.1e}"


def test_a_border_that_nothing_determines_is_reported():
    linearize, _, by_border, _ = problem()
    by_border[..., 3] = by_border[..., 2]
    found = covariance(linearize(np.zeros((7, 6)), np.zeros(4)), np.ones((7, 9)))
    assert found.rank == 3, f"rank {found.rank}"
    assert np.isnan(found.border).all()


def test_huber_loss_reaches_its_stationary_point_quickly():
    linearize, by_block, by_border, data = problem(count=30, seed=3)
    data[::5, 0] += 50.0
    solution = solve_arrow(linearize, np.zeros((30, 6)), np.zeros(4), loss_limit=1.0)
    weighted = solution.weights * solution.linearization.residuals
    slope = np.abs(np.einsum("nmb,nm->b", by_border, weighted)).max()
    inner = np.abs(np.einsum("nmp,nm->np", by_block, weighted)).max()
    assert solution.converged, solution.stop
    assert max(slope, inner) < 1e-5, f"slopes {slope:.1e}, {inner:.1e} at the solution"
    assert solution.iterations < 80, f"{solution.iterations} iterations"


def test_huber_weights():
    weights = huber_weights(np.array([0.0, -2.0, 3.0, -12.0]), 3.0)
    assert np.allclose(weights, [1, 1, 1, 0.25]), f"{weights}"
