"""Names and numbers as people read them."""

from __future__ import annotations

import math

from freeswing.results.common import Parameter
from freeswing.results.identification import BodyParameter

ESTIMATES = {
    "ml_full": "maximum likelihood, full poses",
    "ml_free": "maximum likelihood, free coordinates",
    "fidim_full": "FIDIM (total least squares), full poses",
    "fidim_free": "FIDIM (total least squares), free coordinates",
}
# Suffixes of names, the longest first: scale to the readable unit, and that unit.
_UNITS = {
    "N_m_s": (1e3, "mN m s"),
    "N_m_A": (1e3, "mN m/A"),
    "N_m": (1e3, "mN m"),
    "kg_m2": (1e3, "10⁻³ kg m²"),
    "m2_s2": (1e3, "10⁻³ m²/s²"),
    "m2_s": (1e3, "10⁻³ m²/s"),
    "s2_m": (1e6, "10⁻⁶ s²/m"),
    "s3_m": (1e6, "10⁻⁶ s³/m"),
    "1_s2": (1.0, "1/s²"),
    "m_s2": (1.0, "m/s²"),
    "m_s": (1e6, "µm/s"),
    "rad_s": (1.0, "rad/s"),
    "1_m": (1.0, "1/m"),
    "1_s": (1.0, "1/s"),
    "m2": (1e3, "10⁻³ m²"),
    "s2": (1e6, "10⁻⁶ s²"),
    "N_kg": (1.0, "N/kg"),
    "m": (1e3, "mm"),
    "kg": (1.0, "kg"),
    "rad": (1e3, "mrad"),
    "s": (1e3, "ms"),
    "hz": (1.0, "Hz"),
    "N": (1.0, "N"),
    "fraction": (100.0, "%"),
}
_EACH_CABLE = (("bias", "m"), ("mass_over_stiffness", "s2"))
HALF_WIDTH_95 = 1.959964


def plain(name: str) -> str:
    """`translational_drag` as words."""
    return name.replace("_", " ")


def motion_words(motion: str) -> str:
    """How stretching cables were fitted (`motion` of results/diagnosis.json), as words."""
    if not motion.startswith("quasi-static"):
        return motion
    why = motion.removeprefix("quasi-static").removeprefix(": ")
    slow = "without vibration: cables are as long as their tension makes them"
    return f"{slow}; {why}" if why else slow


def number(value: object, digits: int = 3) -> str:
    """A number to so many significant digits; a dash where there is none."""
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        return "–"
    if value != 0 and not 1e-3 <= abs(value) < 1e5:
        return f"{value:.{digits - 1}e}"
    decimals = digits - 1 - math.floor(math.log10(abs(value))) if value else digits - 1
    return f"{value:z.{max(decimals, 0)}f}"


def millimetres(value_m: object, digits: int = 3) -> str:
    """A length in metres as `0.42 mm`."""
    if not isinstance(value_m, int | float) or isinstance(value_m, bool):
        return "–"
    return f"{number(value_m * 1e3, digits)} mm"


def unit_of(name: str, effect: str = "") -> tuple[str, float, str]:
    """A parameter's name without its unit, the scale to the readable unit, and that unit.

    Args:
        name: of the parameter.
        effect: that it is of, if of one: of springs N_m means N/m, of friction N m.
    """
    for stem, suffix in _EACH_CABLE:  # bias_1_m is cable 1's, in metres
        if name.startswith(f"{stem}_") and name.endswith(f"_{suffix}"):
            return name.removesuffix(f"_{suffix}"), *_UNITS[suffix]
    if name.endswith("_N_m") and "spring" in f"{effect} {name}":
        return name.removesuffix("_N_m"), 1.0, "N/m"
    for suffix, (scale, unit) in _UNITS.items():
        if name.endswith(f"_{suffix}"):
            return name.removesuffix(f"_{suffix}"), scale, unit
    return name, 1.0, ""


def parameter_row(parameter: Parameter | BodyParameter, effect: str = "") -> dict[str, str]:
    """One parameter in a readable unit with its 95 % interval, digits following the interval."""
    stem, scale, unit = unit_of(parameter.name, effect)
    value, std = _scaled(parameter.value, scale), _scaled(parameter.std, scale)
    percent = getattr(parameter, "std_percent", None)
    percent = _percent(value, std) if percent is None else percent
    return {
        "name": plain(stem),
        "key": parameter.name,
        "value": with_decimals(value, std),
        "half_width": with_decimals(None if std is None else HALF_WIDTH_95 * std, std),
        "unit": unit,
        "percent": number(None if percent is None else HALF_WIDTH_95 * percent, 2),
        "raw": "" if parameter.value is None else repr(parameter.value),
        "weak": "" if getattr(parameter, "essential", True) else "not essential",
    }


def with_decimals(value: float | None, std: float | None) -> str:
    """A number with as many decimals as its standard deviation asks for."""
    if value is None:
        return "–"
    if not std or std < 0:
        return number(value, 5)
    decimals = min(max(1 - math.floor(math.log10(std)), 0), 9)
    return f"{value:z.{decimals}f}"


def _percent(value: float | None, std: float | None) -> float | None:
    """A standard deviation as a share of its value."""
    return None if not value or std is None else 100.0 * std / abs(value)


def _scaled(value: object, scale: float) -> float | None:
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        return None
    return value * scale
