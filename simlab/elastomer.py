"""The cylinders: filled rubber with stiffness and loss by amplitude, frequency and temperature, or linear ones.

The law of the rubber is this bench's own. Filled rubber is taken as a network of contacts whose breaking amplitudes are
log-normally distributed: contacts that have broken at amplitude x carry nothing, and those that are just breaking cost
energy. With z = ln(x / median) / spread, N and n the normal distribution and its density::

    k(x) ~ 1 - share N(z)        loss factor(x) = floor + gain share n(z) / (1 - share N(z))

The constants give what direct tests show between 0.1 and 0.01 mm peak to peak: 2.1 times the stiffness in compression
and 1.5 times in shear, and half the loss factor in both. Frequency matters below 50 Hz; above 77 Hz the stiffness is
flat to 0.1 %.
"""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]

BLOW_AMPLITUDE = 3e-6
"""Amplitude (zero to peak, m) of a cylinder's deformation under a blow of 100 N, for which its stiffness is stated."""
REFERENCE_TEMPERATURE = 23.0

RELAXATION = 0.12
RELAXATION_FREQUENCY = 15.0
RELAXATION_LOSS = 0.05
SOFTENING = 0.003
LOSS_SOFTENING = 0.004


@dataclass(frozen=True)
class Contacts:
    """The network of contacts in one direction of loading.

    Attributes:
        share: fraction of the stiffness that contacts carry.
        median: breaking amplitude of half of them, m.
        spread: standard deviation of its natural logarithm.
        loss_floor: loss factor with nothing breaking.
        loss_gain: loss factor per breaking density.
    """

    share: float
    median: float
    spread: float
    loss_floor: float
    loss_gain: float

    def stiffness(self, amplitude: ArrayLike) -> Real:
        """Stiffness over that of the unbroken network, shaped like `amplitude` (m, zero to peak)."""
        return np.asarray(1.0 - self.share * ndtr(np.log(np.asarray(amplitude) / self.median) / self.spread))

    def loss_factor(self, amplitude: ArrayLike) -> Real:
        """Loss factor h / k, shaped like `amplitude` (m, zero to peak)."""
        z = np.log(np.asarray(amplitude) / self.median) / self.spread
        breaking = self.share * np.exp(-0.5 * z**2) / np.sqrt(2 * np.pi)
        return np.asarray(self.loss_floor + self.loss_gain * breaking / self.stiffness(amplitude))


COMPRESSION = Contacts(share=0.7560, median=25e-6, spread=1.1, loss_floor=0.0756, loss_gain=0.2233)
SHEAR = Contacts(share=0.4982, median=25e-6, spread=1.1, loss_floor=0.0621, loss_gain=0.5361)


@dataclass(frozen=True)
class ElastomerCylinder:
    """One cylinder of filled rubber, bonded between metal caps.

    Its stiffnesses are those under a blow of 100 N, well above 50 Hz, at 23 C. In the tester it locks up slowly under a
    preset.

    Attributes:
        shear: a of Eq. (8), N/m.
        compression: b, N/m.
        rotation: c, N m.
    """

    shear: float
    compression: float
    rotation: float
    shear_contacts: Contacts = SHEAR
    compression_contacts: Contacts = COMPRESSION

    static_frequency: ClassVar[float] = 0.0
    """Hz, of the stiffness that a preset meets."""
    locking: ClassVar[float] = 60.0
    """How that stiffness grows with the preset, 1/m."""

    def dynamic_stiffness(
        self, amplitude: ArrayLike, frequency: ArrayLike, temperature: ArrayLike = REFERENCE_TEMPERATURE
    ) -> Complex:
        """(..., 3) shear, compression (N/m) and rotation (N m), k + ih, for frequencies (...) in Hz.

        `amplitude` () or (...) is that of the whole deformation, zero to peak in m, in whatever direction, so that in
        an angled pair both mechanisms see all of it. The imaginary part belongs to e^(+i w t).

        Raises:
            ValueError: an amplitude is not positive.
        """
        if not np.all(np.asarray(amplitude) > 0.0):
            raise ValueError(f"amplitude {amplitude!r} m: a dynamic stiffness needs a positive amplitude")
        relaxed = np.exp(-np.asarray(frequency, dtype=np.float64) / RELAXATION_FREQUENCY)
        warmer = np.asarray(temperature) - REFERENCE_TEMPERATURE
        stiffness = (1 - RELAXATION * relaxed) * (1 - SOFTENING * warmer)
        loss = (1 + RELAXATION_LOSS * relaxed) * (1 - LOSS_SOFTENING * warmer)
        by_contacts = {
            contacts: contacts.stiffness(amplitude)
            / contacts.stiffness(BLOW_AMPLITUDE)
            * stiffness
            * (1 + 1j * contacts.loss_factor(amplitude) * loss)
            for contacts in {self.shear_contacts, self.compression_contacts}
        }
        columns = [
            self.shear * by_contacts[self.shear_contacts],
            self.compression * by_contacts[self.compression_contacts],
            self.rotation * by_contacts[self.compression_contacts],
        ]
        return np.stack(columns, axis=-1)

    def third_harmonic(self, configuration: str, amplitude: Real) -> Real:
        """Third harmonic of the force over the first: 0.1 % at 0.01 mm peak to peak, 0.7 % at 0.1 mm.

        It is in phase with the first (a force c1 sin p + c3 sin 3p), a little less in shear.
        """
        share = {"compression": 1.0, "angled": 0.9, "shear": 0.6}[configuration]
        return np.asarray(share * 0.007 * (amplitude / 50e-6) ** 0.85)


@dataclass(frozen=True)
class LinearCylinder:
    """One cylinder of constant complex stiffness k (1 + i gamma), as in the paper's model; effects change it.

    Attributes:
        shear, compression: a and b of Eq. (8), N/m.
        rotation: c, N m.
    """

    shear: complex
    compression: complex
    rotation: complex

    static_frequency: ClassVar[float] = 0.1
    """Hz, of the stiffness that a preset meets; some effects have no value at 0 Hz."""
    locking: ClassVar[float] = 0.0
    """How that stiffness grows with the preset, 1/m."""

    def dynamic_stiffness(
        self, _amplitude: ArrayLike, frequency: ArrayLike, _temperature: ArrayLike = REFERENCE_TEMPERATURE
    ) -> Complex:
        """(..., 3) shear, compression (N/m) and rotation (N m) for frequencies (...) in Hz."""
        constant = np.array([self.shear, self.compression, self.rotation], dtype=np.complex128)
        return np.broadcast_to(constant, (*np.shape(frequency), 3))


SimulatedCylinder = ElastomerCylinder | LinearCylinder


def scattered(cylinder: ElastomerCylinder, rng: np.random.Generator, scale: float) -> ElastomerCylinder:
    """A sample of the same make: 1.5 % in stiffness, 3 % in loss and breaking amplitude, times `scale`."""

    def near(value: float, relative: float) -> float:
        return value * (1 + scale * relative * float(np.clip(rng.standard_normal(), -2, 2)))

    def contacts(mean: Contacts) -> Contacts:
        return replace(mean, median=near(mean.median, 0.03), loss_floor=near(mean.loss_floor, 0.03))

    return ElastomerCylinder(
        shear=near(cylinder.shear, 0.015),
        compression=near(cylinder.compression, 0.015),
        rotation=near(cylinder.rotation, 0.1),
        shear_contacts=contacts(cylinder.shear_contacts),
        compression_contacts=contacts(cylinder.compression_contacts),
    )
