"""The free beam with what is attached to it: joints, cords, masses, springs, cuts.

H = R_ol - R_oj (1 + Z R_jj)^-1 Z R_jl, with R the receptance of the free beam between output o, load l and the places j
where something of dynamic stiffness Z is attached. Each frequency line takes one solve of the size of Z.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simlab.beam import FreeModes, Real

Complex = NDArray[np.complex128]

DYNAMIC_BELOW = 16_000.0
"""Free modes above this frequency (Hz) act through their static compliance: twice what a blow can excite."""


@dataclass(frozen=True, eq=False)
class Attachment:
    """Something that holds the beam, is carried by it, or is taken out of it.

    Attributes:
        shapes: (n, modes) of the free beam where it is attached.
        stiffness: (lines, n, n) or (n, n) dynamic stiffness; negative takes stiffness out.
    """

    shapes: Real
    stiffness: Complex


class CoupledBeam:
    """A free beam, prepared for attachments at `places` and for angular frequencies `omega`.

    Args:
        modes: of the free beam.
        places: (places, modes) shapes where something is attached.
        omega: (lines,) rad/s, complex.
        loss_factor: structural loss of the beam beside its damping ratios.
        damping_scale: factor on its damping ratios.

    Raises:
        ValueError: a line is not above zero.
    """

    def __init__(
        self, modes: FreeModes, places: Real, omega: Complex, loss_factor: float = 0.0, damping_scale: float = 1.0
    ) -> None:
        if np.any(omega.real <= 0.0):
            raise ValueError("frequency lines must lie above 0 Hz: a free beam has no static receptance")
        self.modes, self.omega = modes, omega
        self._places = places
        self._dynamic = modes.frequency < DYNAMIC_BELOW
        natural = modes.angular_frequency[self._dynamic]
        damping = damping_scale * modes.damping_ratio[self._dynamic]
        square = natural**2 * (1 + 1j * loss_factor)
        self._compliance: Complex = 1.0 / (square - omega[:, None] ** 2 + 2j * damping * natural * omega[:, None])
        self._static = 1.0 / modes.angular_frequency[~self._dynamic] ** 2
        self._between = self._receptance(places, places)

    def accelerance(self, output: Real, loads: Real, stiffness: Complex) -> Complex:
        """(loads, lines) acceleration of `output` (modes,) to unit forces on `loads` (loads, modes), (m/s^2)/N.

        `stiffness` (lines, places, places) is the dynamic stiffness of what is attached, in SI units.
        """
        system = np.eye(len(self._places)) + stiffness @ self._between
        reaction = np.linalg.solve(system, stiffness @ self._receptance(self._places, loads))
        output = output[None]
        receptance = self._receptance(output, loads) - self._receptance(output, self._places) @ reaction
        return np.asarray(-(self.omega**2) * receptance[:, 0].T)

    def motion(self, load: Real, stiffness: Complex) -> Complex:
        """(lines, places) displacement where something is attached, to a unit force on `load` (modes,), m/N."""
        system = np.eye(len(self._places)) + stiffness @ self._between
        free = self._receptance(self._places, load[None])
        return np.asarray(np.linalg.solve(np.swapaxes(system, 1, 2), free)[..., 0])

    def _receptance(self, outputs: Real, inputs: Real) -> Complex:
        """(lines, outputs, inputs) of the free beam."""
        pairs = (outputs[:, None, :] * inputs[None, :, :]).reshape(len(outputs) * len(inputs), -1)
        received = self._compliance @ pairs[:, self._dynamic].T + pairs[:, ~self._dynamic] @ self._static
        return np.asarray(received.reshape(-1, len(outputs), len(inputs)))


def block_diagonal(blocks: Sequence[Complex], lines: int) -> Complex:
    """(lines, N, N) with each of `blocks`, (lines, n, n) or (n, n), on the diagonal."""
    size = sum(block.shape[-1] for block in blocks)
    whole = np.zeros((lines, size, size), dtype=np.complex128)
    start = 0
    for block in blocks:
        end = start + block.shape[-1]
        whole[:, start:end, start:end] = block
        start = end
    return whole


def poles(modes: FreeModes, places: Real, stiffness_at: Callable[[float], Complex], highest: float) -> Complex:
    """(poles,) lambda in rad/s of the supported beam up to `highest` Hz, positive imaginary parts, sorted.

    Each pole is refined by Rayleigh-quotient iteration on the full complex problem, with the stiffness of the supports
    at the pole's own frequency. It starts from the undamped beam.

    Args:
        modes: of the free beam.
        places: (places, modes) shapes at the supports.
        stiffness_at: dynamic stiffness (places, places) of the supports at a frequency in Hz.
        highest: Hz.

    Raises:
        RuntimeError: an iteration does not converge.
    """
    start = np.diag(modes.angular_frequency**2) + places.T @ stiffness_at(0.5 * highest).real @ places
    values, vectors = np.linalg.eigh(start)
    near = values < (1.1 * 2 * np.pi * highest) ** 2
    found = [
        _pole(modes, places, stiffness_at, 1j * np.sqrt(value), vector)
        for value, vector in zip(values[near], vectors.T[near], strict=True)
    ]
    return np.array(sorted((p for p in found if p.imag <= 2 * np.pi * highest), key=lambda pole: pole.imag))


def _pole(
    modes: FreeModes, places: Real, stiffness_at: Callable[[float], Complex], pole: complex, vector: Real
) -> complex:
    square, damping = modes.angular_frequency**2, 2 * modes.damping_ratio * modes.angular_frequency
    shape: Complex = vector.astype(np.complex128)
    for _ in range(20):
        held = places.T @ stiffness_at(pole.imag / (2 * np.pi)) @ places
        impedance = np.diag(square + pole * damping + pole**2) + held
        slope = 2 * pole + damping
        shape = np.asarray(np.linalg.solve(impedance, slope * shape), dtype=np.complex128)
        shape = np.asarray(shape / np.linalg.norm(shape))
        step = complex(shape @ impedance @ shape) / (shape @ (slope * shape))
        pole = complex(pole - step)
        if abs(step) < 1e-11 * abs(pole):
            return pole
    raise RuntimeError(f"the pole near {pole.imag / (2 * np.pi):.1f} Hz did not converge")
