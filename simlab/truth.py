"""The true values of a bench, in the form of identified results."""

from typing import Any

import numpy as np

from simlab.beam import free_modes
from simlab.case.campaign import AMPLITUDES_PP_MM, CONFIGURATIONS, SINE_FREQUENCIES, Points
from simlab.case.simulate import specimen_stiffness
from simlab.coupling import Complex, poles
from simlab.elastomer import REFERENCE_TEMPERATURE
from simlab.stand import BuiltCase, Stand

BLOW_BAND = np.linspace(77.0, 900.0, 200)
HIGHEST_MODE = 1024.0  # Hz
COUPLED = 1e-2
"""A term below this fraction of its diagonal has no loss factor worth stating."""


def modal_truth(built: BuiltCase) -> dict[str, Any]:
    """Natural frequencies (Hz) and loss factors under the reference set's blows, lambda^2 = -w^2 (1 + i eta)."""
    force = built.campaign.setups[0].peak_force

    def stiffness_at(frequency: float) -> Complex:
        return np.asarray(Stand(built, np.array([frequency])).support_stiffness(0, 0.5, force)[0])

    stand = Stand(built, BLOW_BAND[:1])
    square = -(poles(stand.modes, stand.supports, stiffness_at, HIGHEST_MODE) ** 2)
    return {
        "frequency_hz": (np.sqrt(square.real) / (2 * np.pi)).tolist(),
        "loss_factor": (square.imag / square.real).tolist(),
    }


def joint_truth(built: BuiltCase) -> dict[str, Any]:
    """Each joint's k, h (N/m, N, N m) and gamma under the reference set's blows at 23 C, averaged over 77 to 900 Hz.

    Where each blow has its own, they are the mean over what is struck; a window of the records is no part of a joint.
    ``k_spread`` and ``h_spread`` are the largest less the smallest value there. What couples the joints to each other,
    where a case has that, is left out.
    """
    both = Stand(built.without_window(), BLOW_BAND).usual_stiffness(0)
    truth = {}
    for i, name in enumerate(built.article.joints):
        own = slice(3 * i, 3 * i + 3)
        band = both[:, own, own]
        mean = band.mean(axis=0)
        truth[name] = {
            "k": mean.real.tolist(),
            "h": mean.imag.tolist(),
            "gamma": _loss_factors(mean),
            "k_spread": np.ptp(band.real, axis=0).tolist(),
            "h_spread": np.ptp(band.imag, axis=0).tolist(),
        }
    return truth


def direct_truth(built: BuiltCase) -> dict[str, Any]:
    """k, h (N/m) and gamma of the sine points: specimen, configuration, amplitude in mm peak to peak, then lists."""
    return {
        name: {
            configuration: {f"{amplitude:g}": _point_list(built, (i, j, amplitude)) for amplitude in AMPLITUDES_PP_MM}
            for j, configuration in enumerate(CONFIGURATIONS)
        }
        for i, name in enumerate(built.article.joints)
    }


def _point_list(built: BuiltCase, of: tuple[int, int, float]) -> dict[str, list[float]]:
    stiffness = specimen_stiffness(built, Points.alike(*of, SINE_FREQUENCIES, REFERENCE_TEMPERATURE))
    return {
        "frequency_hz": SINE_FREQUENCIES.tolist(),
        "k": stiffness.real.tolist(),
        "h": stiffness.imag.tolist(),
        "gamma": (stiffness.imag / stiffness.real).tolist(),
    }


def free_truth(built: BuiltCase) -> dict[str, list[float]]:
    """Natural frequencies (Hz) and damping ratios of the free beam."""
    in_plane, on_edge = (free_modes(beam) for beam in (built.article.beam, built.article.beam.on_edge()))
    return {
        "frequency_hz": in_plane.frequency[3:6].tolist(),
        "damping_ratio": in_plane.damping_ratio[3:6].tolist(),
        "out_of_plane_hz": on_edge.frequency[3:5].tolist(),
    }


def _loss_factors(stiffness: Complex) -> list[list[float | None]]:
    """(3, 3) h / k, None where k is small beside its diagonal terms."""
    scale = np.sqrt(np.abs(np.outer(np.diag(stiffness.real), np.diag(stiffness.real))))
    return [
        [
            float(term.imag / term.real) if abs(term.real) > COUPLED * size else None
            for term, size in zip(row, sizes, strict=True)
        ]
        for row, sizes in zip(stiffness, scale, strict=True)
    ]
