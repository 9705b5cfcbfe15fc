"""The robot of the self-calibration paper, and its start pose at 40 N."""

from __future__ import annotations

import numpy as np

from freeswing.cdpr.robot import Cable, Platform, Robot

START = np.array([-1.363733, 0.963444, -0.460895, -0.056328, -0.068260, -0.556509])
START_N = np.full(3, 40.0)
LARGEST_N = np.full(3, 80.0)
PERTURBED_N = np.array([46.9, 23.9, 32.6])

X, Y, Z = np.eye(3)


def bologna_3(third_attachment_x_m: float = -0.211) -> Robot:
    """Table 1 of Ida, Merlet, Carricato 2019; the sign of the third attachment's x corrected."""
    entries = [[-2.030, -0.170, 0.806], [0.066, 0.920, 0.757], [-2.043, 2.241, 0.738]]
    attachments = [
        [0.020, -0.287, 0.250],
        [0.251, 0.153, 0.250],
        [third_attachment_x_m, 0.153, 0.250],
    ]
    axes = [(Y, -Z, -X), (-X, -Z, -Y), (-Y, Z, -X)]
    cables = [
        Cable(str(k + 1), np.array(entries[k]), 0.025, np.array(attachments[k]), *axes[k])
        for k in range(3)
    ]
    return Robot(
        "bologna-3",
        tuple(cables),
        free_coordinates=("phi", "theta", "chi"),
        platform=Platform(8.0, np.array([0.0, 0.0, 0.182])),
    )


def bologna_4() -> Robot:
    """Table 1 and eq. (43) of Ida, Briot, Carricato 2022, with a mass of 12 kg."""
    entries = [
        [0.219, -1.316, 0.527],
        [2.295, -1.158, 0.521],
        [2.153, 0.973, 0.560],
        [0.0532, 0.796, 0.532],
    ]
    attachments = [
        [-0.144, -0.219, 0.264],
        [0.115, -0.233, 0.270],
        [0.142, 0.220, 0.266],
        [-0.120, 0.236, 0.266],
    ]
    axes = [(Y, -Z, -X), (-X, -Z, -Y), (-Y, -Z, X), (X, -Z, Y)]
    cables = [
        Cable(str(k + 1), np.array(entries[k]), 0.025, np.array(attachments[k]), *axes[k])
        for k in range(4)
    ]
    inertia = np.array([0.051, 0.069, 0.037, 0.0, 0.0, 0.0])
    return Robot(
        "bologna-4",
        tuple(cables),
        free_coordinates=("x", "y"),
        platform=Platform(12.0, np.array([0.0, 0.0, 0.19]), inertia),
    )
