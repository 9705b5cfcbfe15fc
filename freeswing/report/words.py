"""Names and numbers as people read them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

ESTIMATES = {
    "ml_full": "maximum likelihood, full poses",
    "ml_free": "maximum likelihood, free coordinates",
    "fidim_full": "FIDIM (total least squares), full poses",
    "fidim_free": "FIDIM (total least squares), free coordinates",
}
_SCALES = {"m": (1e3, "mm"), "m2": (1e3, "10⁻³ m²"), "kg": (1.0, "kg"), "rad": (1e3, "mrad")}
HALF_WIDTH_95 = 1.959964


def plain(name: str) -> str:
    """`translational_drag` as words."""
    return name.replace("_", " ")


def number(value: object, digits: int = 3) -> str:
    """A number to so many significant digits; a dash where there is none."""
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        return "–"
    if value != 0 and not 1e-3 <= abs(value) < 1e5:
        return f"{value:.{digits - 1}e}"
    decimals = digits - 1 - math.floor(math.log10(abs(value))) if value else digits - 1
    return f"{value:.{max(decimals, 0)}f}"


def millimetres(value_m: object, digits: int = 3) -> str:
    """A length in metres as `0.42 mm`."""
    if not isinstance(value_m, int | float) or isinstance(value_m, bool):
        return "–"
    return f"{number(value_m * 1e3, digits)} mm"


def parameter_row(parameter: Mapping[str, Any]) -> dict[str, str]:
    """One parameter in a readable unit with its 95 % interval, digits following the interval."""
    stem, _, suffix = str(parameter["name"]).rpartition("_")
    scale, unit = _SCALES.get(suffix, (1.0, suffix.replace("_", " ")))
    name = stem if suffix in _SCALES else str(parameter["name"])
    value, std = _scaled(parameter.get("value"), scale), _scaled(parameter.get("std"), scale)
    return {
        "name": plain(name),
        "key": str(parameter["name"]),
        "value": _with_decimals(value, std),
        "half_width": _with_decimals(None if std is None else HALF_WIDTH_95 * std, std),
        "unit": unit,
        "std_percent": number(parameter.get("std_percent", _percent(value, std)), 2),
        "raw": "" if parameter.get("value") is None else repr(parameter["value"]),
        "weak": "" if parameter.get("essential", True) else "not essential",
    }


def _percent(value: float | None, std: float | None) -> float | None:
    """A standard deviation as a share of its value."""
    return None if not value or std is None else 100.0 * std / abs(value)


def _scaled(value: object, scale: float) -> float | None:
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        return None
    return value * scale


def _with_decimals(value: float | None, std: float | None) -> str:
    if value is None:
        return "–"
    if not std or std < 0:
        return number(value, 5)
    decimals = min(max(1 - math.floor(math.log10(std)), 0), 9)
    return f"{value:.{decimals}f}"
