"""Results for other libraries, where these are installed: pandas and ArviZ."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from freeswing.cdpr.robot import INERTIA_NAMES
from freeswing.results.common import Parameter

Rows = Sequence[Sequence[float | None]]


def to_dataframe(rows: Sequence[dict[str, Any]]) -> Any:
    """Rows of name, value and std as a pandas.DataFrame with the names as its index.

    Raises:
        ImportError: without pandas.
    """
    try:
        import pandas
    except ImportError as absent:
        raise ImportError("to_dataframe() needs pandas: pip install pandas") from absent
    return pandas.DataFrame(list(rows)).set_index("name")


def to_arviz(parameters: Sequence[Parameter], correlation: Rows, draws: int, seed: int) -> Any:
    """Draws of a Gaussian with these values, standard deviations and correlations.

    Args:
        parameters: of which the nine inertial ones are taken.
        correlation: of these, (9, 9).
        draws: how many, in one chain.
        seed: decides them.

    Raises:
        ImportError: without ArviZ.
        ValueError: where correlations or deviations are not known.
    """
    try:
        import arviz
    except ImportError as absent:
        raise ImportError("to_arviz() needs ArviZ: pip install arviz") from absent
    found = {one.name: one for one in parameters if one.name in INERTIA_NAMES}
    chosen = [found[name] for name in INERTIA_NAMES if name in found]
    known = [(p.value, p.std) for p in chosen if p.value is not None and p.std is not None]
    if len(known) != len(INERTIA_NAMES) or len(correlation) != len(INERTIA_NAMES):
        raise ValueError(
            "this result keeps no correlations of the nine parameters; identify's does"
        )
    mean, std = np.array(known).T
    covariance = np.array(correlation, dtype=np.float64) * np.outer(std, std)
    drawn = np.random.default_rng(seed).multivariate_normal(mean, covariance, draws)
    posterior = {p.name: drawn[None, :, k] for k, p in enumerate(chosen)}
    if int(arviz.__version__.split(".")[0]) >= 1:
        return arviz.from_dict({"posterior": posterior})
    return arviz.from_dict(posterior=posterior)
