"""What the bench really is, in the shape of the results that identification should find."""

from __future__ import annotations

from typing import Any

import numpy as np

from simlab.article import Article
from simlab.assembly import Complex
from simlab.elastomer import CONFIGURATIONS, Elastomer
from simlab.supported_beam import SupportedBeam

BLOW_BAND = np.linspace(77.0, 900.0, 200)
SINE_FREQUENCIES = np.arange(5.0, 201.0, 5.0)
SINE_AMPLITUDES_PP_MM = ("0.1", "0.05", "0.01")
COUPLED = 1e-2
"""A term below this fraction of its diagonal has no loss factor worth the name."""


def modal_truth(beam: SupportedBeam, amplitude: float) -> dict[str, Any]:
    """Natural frequencies (Hz) and loss factors of the supported beam to 1024 Hz, lambda^2 = -w^2 (1 + i eta)."""
    square = -(beam.poles(amplitude) ** 2)
    return {
        "frequency_hz": (np.sqrt(square.real) / (2 * np.pi)).tolist(),
        "loss_factor": (square.imag / square.real).tolist(),
    }


def inverse_truth(article: Article, amplitude: float) -> dict[str, Any]:
    """Each joint's k, h (N/m, N, N m) and gamma at a blow's amplitude and 23 C, averaged over 77 to 900 Hz.

    ``k_spread`` and ``h_spread`` are the largest less the smallest value in that band.
    """
    truth = {}
    for name, joint in article.joints.items():
        band = joint.dynamic_stiffness(amplitude, BLOW_BAND)
        mean = band.mean(axis=0)
        truth[name] = {
            "k": mean.real.tolist(),
            "h": mean.imag.tolist(),
            "gamma": loss_factors(mean),
            "k_spread": np.ptp(band.real, axis=0).tolist(),
            "h_spread": np.ptp(band.imag, axis=0).tolist(),
        }
    return truth


def direct_truth(elastomer: Elastomer) -> dict[str, Any]:
    """k, h (N/m) and gamma of every sine point: specimen, configuration, amplitude in mm peak to peak, then lists."""
    return {
        specimen: {
            configuration: {
                amplitude: _point_list(
                    elastomer.dynamic_stiffness(specimen, configuration, 0.5e-3 * float(amplitude), SINE_FREQUENCIES)
                )
                for amplitude in SINE_AMPLITUDES_PP_MM
            }
            for configuration in CONFIGURATIONS
        }
        for specimen in elastomer.cylinders
    }


def _point_list(stiffness: Complex) -> dict[str, list[float]]:
    return {
        "frequency_hz": SINE_FREQUENCIES.tolist(),
        "k": stiffness.real.tolist(),
        "h": stiffness.imag.tolist(),
        "gamma": (stiffness.imag / stiffness.real).tolist(),
    }


def loss_factors(stiffness: Complex) -> list[list[float | None]]:
    """(3, 3) h / k, None where k is next to nothing beside its diagonal terms."""
    scale = np.sqrt(np.abs(np.outer(np.diag(stiffness.real), np.diag(stiffness.real))))
    return [
        [
            float(term.imag / term.real) if abs(term.real) > COUPLED * size else None
            for term, size in zip(row, sizes, strict=True)
        ]
        for row, sizes in zip(stiffness, scale, strict=True)
    ]
