"""Sine points of the cylinders that the benches of `layouts` stand on, as a tester without faults measures them."""

import numpy as np

from analysis.direct.dynamic_stiffness import DynamicStiffness
from jointlab.identification.sine_points import IdentifiedSinePoint
from tests.jointlab.identification.layouts import CYLINDERS

FREQUENCIES = (20.0, 50.0, 100.0, 150.0, 200.0)
AMPLITUDES = (0.01, 0.1)
ERROR = 0.003  # relative standard deviation


def sine_points(*joints: str, wrong: tuple[str, str, float, float] | None = None) -> tuple[IdentifiedSinePoint, ...]:
    """All configurations, amplitudes (mm p-p) and frequencies; the force has the other sign in one point, if asked.

    Args:
        joints: whose cylinders are tested.
        wrong: joint, configuration, amplitude (mm p-p) and frequency (Hz) of the point with a swapped sign.
    """
    found = list[IdentifiedSinePoint]()
    for name in joints:
        shear, compression, loss, _ = CYLINDERS[name]
        for configuration, factor in (
            ("compression", compression),
            ("shear", 2 * shear),
            ("angled", shear + compression),
        ):
            for amplitude in AMPLITUDES:
                for frequency in FREQUENCIES:
                    swapped = (name, configuration, amplitude, frequency) == wrong
                    value = (-1e6 if swapped else 1e6) * factor * (1 + 1j * loss)
                    result = DynamicStiffness(
                        frequency=frequency,
                        amplitude_pp=1e-3 * amplitude,
                        complex_stiffness=value,
                        covariance=np.eye(2) * (ERROR * abs(value)) ** 2,
                    )
                    found.append(
                        IdentifiedSinePoint(
                            name, configuration, amplitude, frequency, result, len(found) + 1, 10.0 * len(found), 23.0
                        )
                    )
    return tuple(found)
