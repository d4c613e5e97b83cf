"""Joints over frequency as plain values: document, store, and tables have the same ones."""

from typing import Any

import numpy as np

from analysis.inverse.frequency_law import FrequencyLaw
from analysis.inverse.frequency_laws import REFERENCE_FREQUENCY
from jointlab.identification.inverse import Inverse

PLACES = 9
"""Frequencies from the lowest to the highest line that was used; that where the joints are stated is added."""
FIELDS = {
    "k": "stiffness",
    "h": "damping",
    "gamma": "loss_factor",
    "k_ci95": "k_ci95",
    "h_ci95": "h_ci95",
    "gamma_ci95": "loss_factor_ci95",
    "observable": "observable",
}


def over_frequency(inverse: Inverse) -> dict[str, dict[str, Any]]:
    """By joint: its law, frequencies in Hz, and at each k, h and gamma (3, 3) with their 95 % intervals, SI.

    Empty where the joints are constant.
    """
    fit = inverse.fit
    if fit.law is FrequencyLaw.CONSTANT:
        return {}
    lines = fit.likelihood.model.frequency
    round_ones = (float(f"{each:.3g}") for each in np.geomspace(lines[0], lines[-1], PLACES))
    joints = {frequency: fit.joints_at(frequency) for frequency in sorted({REFERENCE_FREQUENCY, *round_ones})}
    return {
        name: {"law": fit.law.value, "frequency_hz": list(joints)}
        | {field: [getattr(each[name], own) for each in joints.values()] for field, own in FIELDS.items()}
        for name in fit.joints
    }
