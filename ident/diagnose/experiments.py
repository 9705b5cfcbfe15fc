"""Which experiment would tell effects apart that a session's data cannot."""

from __future__ import annotations

SEPARATED_BY = {
    "amplitude": (
        {"translational_drag", "quadratic_drag", "swivel_friction", "swivel_viscous",
         "rotational_drag", "pulley_friction"},
        "record swings of clearly different amplitude and let them die away for at least three "
        "times as long: dry friction, linear and quadratic drag decay differently",
    ),
    "payload": (
        {"gravity_tilt", "constant_force", "cable_elasticity", "cable_mass", "tether",
         "torsion_spring"},
        "repeat some swings with a known payload: what scales with weight and what does not "
        "part ways",
    ),
    "equilibria": (
        {"anchor_offset", "attachment_offset", "pulley_radius", "pulley_axis", "marker_offset",
         "cable_length_bias", "gravity_tilt"},
        "record equilibria spread over the whole workspace, with large tilts of the platform, and "
        "state the cable lengths of each run",
    ),
    "time": (
        {"winch_creep", "cable_length_bias", "harmonic_force", "cable_elasticity"},
        "record one run several times as long with the winches locked",
    ),
}  # fmt: skip


def separating_experiment(effects: tuple[str, ...]) -> str:
    """A sentence that names the experiment which would separate a group of effects."""
    found = [
        advice for members, advice in SEPARATED_BY.values() if len(members & set(effects)) >= 2
    ]
    if found:
        return "; or ".join(found)
    return (
        "record more runs, about other equilibria and with other amplitudes, and one with a known "
        "payload"
    )
