"""The beam on its supports: accelerances and complex modes of a free bar held by dynamic stiffnesses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simlab.beam import FreeModes, Real

Complex = NDArray[np.complex128]
StiffnessLaw = Callable[[float], Complex]
"""Dynamic stiffness (supports, supports) of the supports at a frequency in Hz."""

DYNAMIC_BELOW = 16_000.0
"""Free modes above this frequency (Hz) act through their static compliance: twice what a blow can excite."""


@dataclass(frozen=True)
class Lines:
    """What depends on the frequency lines alone and is the same for every blow.

    Attributes:
        frequency: (lines,) Hz, above zero.
        compliance: (lines, dynamic modes) modal receptance 1 / (w_r^2 - w^2 + 2 i zeta_r w_r w).
        supports: (lines, supports, supports) receptance of the free bar between its supports.
    """

    frequency: Real
    compliance: Complex
    supports: Complex


class Assembly:
    """A free bar and where it is held.

    Args:
        modes: of the free bar.
        supports: (supports, modes) shapes at the supported degrees of freedom.
    """

    def __init__(self, modes: FreeModes, supports: Real) -> None:
        self.modes = modes
        self.supports = supports
        self._dynamic = modes.frequency < DYNAMIC_BELOW

    def lines(self, frequency: Real) -> Lines:
        """Prepare for frequency lines (lines,) in Hz.

        Raises:
            ValueError: a line is not above zero.
        """
        if frequency.size and frequency.min() <= 0.0:
            raise ValueError("frequency lines must lie above 0 Hz: a free bar has no static receptance")
        natural, damping = self.modes.angular_frequency[self._dynamic], self.modes.damping_ratio[self._dynamic]
        omega = 2 * np.pi * frequency[:, None].astype(np.complex128)
        compliance: Complex = 1.0 / (natural**2 - omega**2 + 2j * damping * natural * omega)
        count = len(self.supports)
        pairs = (self.supports[:, None, :] * self.supports[None, :, :]).reshape(count**2, -1)
        supports = self._receptance(compliance, pairs).reshape(-1, count, count)
        return Lines(frequency, compliance, supports)

    def accelerance(self, lines: Lines, stiffness: Complex, response: Real, load: Real) -> Complex:
        """(lines,) acceleration of `response` (modes,) to a unit force on `load` (modes,), (m/s^2)/N.

        The supports' dynamic stiffness (lines, supports, supports) in SI units is added to the free receptance:
        H = R_ol - R_oj (1 + k R_jj)^-1 k R_jl.
        """
        response_at_supports = self._receptance(lines.compliance, self.supports * response)
        load_at_supports = self._receptance(lines.compliance, self.supports * load)
        system = np.eye(len(self.supports)) + stiffness @ lines.supports
        reaction = np.linalg.solve(system, stiffness @ load_at_supports[..., None])[..., 0]
        direct = self._receptance(lines.compliance, (response * load)[None])[:, 0]
        receptance = direct - (response_at_supports * reaction).sum(axis=1)
        return np.asarray(-((2 * np.pi * lines.frequency) ** 2) * receptance)

    def poles(self, stiffness_at: StiffnessLaw, highest: float) -> Complex:
        """(poles,) lambda in rad/s of the supported bar up to `highest` Hz, positive imaginary parts, sorted.

        Each pole is refined by Rayleigh-quotient iteration on the full complex problem with the supports' stiffness
        at the pole's own frequency, started from the undamped bar.
        """
        square = self.modes.angular_frequency**2
        start = np.diag(square) + self.supports.T @ stiffness_at(0.5 * highest).real @ self.supports
        values, vectors = np.linalg.eigh(start)
        wanted = values < (1.1 * 2 * np.pi * highest) ** 2
        found = [
            self._pole(stiffness_at, 1j * np.sqrt(v), q) for v, q in zip(values[wanted], vectors.T[wanted], strict=True)
        ]
        return np.array(sorted((p for p in found if p.imag <= 2 * np.pi * highest), key=lambda pole: pole.imag))

    def _pole(self, stiffness_at: StiffnessLaw, pole: complex, vector: Real) -> complex:
        square, damping = self.modes.angular_frequency**2, 2 * self.modes.damping_ratio * self.modes.angular_frequency
        shape: Complex = vector.astype(np.complex128)
        for _ in range(20):
            held = self.supports.T @ stiffness_at(pole.imag / (2 * np.pi)) @ self.supports
            impedance = np.diag(square + pole * damping + pole**2) + held
            slope = 2 * pole + damping
            shape = np.asarray(np.linalg.solve(impedance, slope * shape), dtype=np.complex128)
            shape = np.asarray(shape / np.linalg.norm(shape))
            step = complex(shape @ impedance @ shape) / (shape @ (slope * shape))
            pole = complex(pole - step)
            if abs(step) < 1e-11 * abs(pole):
                return pole
        raise RuntimeError(f"the pole near {pole.imag / (2 * np.pi):.1f} Hz did not converge")

    def _receptance(self, compliance: Complex, products: Real) -> Complex:
        """(lines, rows) sums of products of shapes (rows, modes) with the modal receptances, and the static rest."""
        rest = (products[:, ~self._dynamic] / self.modes.angular_frequency[~self._dynamic] ** 2).sum(axis=1)
        return np.asarray(compliance @ products[:, self._dynamic].T + rest)
