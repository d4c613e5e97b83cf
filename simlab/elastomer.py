"""The elastomer cylinders: stiffness and loss against amplitude, frequency and temperature.

The law is this bench's own.  Filled rubber is taken as a network of contacts whose breaking amplitudes are
log-normally distributed: those that have broken at amplitude x carry no more, and those that are just breaking cost
energy.  With z = ln(x / median) / spread, N and n the normal distribution and its density::

    k(x) ~ 1 - share N(z)        loss factor(x) = floor + gain share n(z) / (1 - share N(z))

The constants give what direct tests show between 0.1 and 0.01 mm peak to peak: 2.1 times the stiffness in compression
and 1.5 times in shear, and half the loss factor in both.  Frequency matters below 50 Hz; above
77 Hz the stiffness is flat to 0.1 %.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]

BLOW_AMPLITUDE = 3e-6
"""Deformation amplitude (zero to peak, m) at which a cylinder has the stiffness it is named by."""
REFERENCE_TEMPERATURE = 23.0

WEIGHTS = {
    "compression": ((0.0, 1.0), (0.0, 0.0)),
    "shear": ((1.0, 0.0), (1.0, 0.0)),
    "angled": ((0.5, 0.5), (0.5, 0.5)),
}
"""How much (shear, compression) of the lower and of the upper cylinder each configuration shows."""
CONFIGURATIONS = tuple(WEIGHTS)

RELAXATION = 0.12
RELAXATION_FREQUENCY = 15.0
RELAXATION_LOSS = 0.05
SOFTENING = 0.003
LOSS_SOFTENING = 0.004
STATIC_LOCKING = 60.0


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

    def stiffness(self, amplitude: float) -> float:
        """Stiffness over that of the unbroken network."""
        return float(1.0 - self.share * ndtr(np.log(amplitude / self.median) / self.spread))

    def loss_factor(self, amplitude: float) -> float:
        """Loss factor h / k."""
        z = np.log(amplitude / self.median) / self.spread
        breaking = self.share * np.exp(-0.5 * z**2) / np.sqrt(2 * np.pi)
        return float(self.loss_floor + self.loss_gain * breaking / self.stiffness(amplitude))


COMPRESSION = Contacts(share=0.7560, median=25e-6, spread=1.1, loss_floor=0.0756, loss_gain=0.2233)
SHEAR = Contacts(share=0.4982, median=25e-6, spread=1.1, loss_floor=0.0621, loss_gain=0.5361)


@dataclass(frozen=True)
class Cylinder:
    """One cylinder, bonded between metal caps; stiffnesses are those of a 100 N blow well above 50 Hz at 23 C.

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

    def dynamic_stiffness(
        self, amplitude: float, frequency: ArrayLike, temperature: float = REFERENCE_TEMPERATURE
    ) -> Complex:
        """(..., 3) shear, compression (N/m) and rotation (N m), k + ih, for frequencies (...) in Hz.

        `amplitude` is that of the whole deformation, zero to peak in m, whatever its direction, so that in an angled
        pair both mechanisms see all of it.  The imaginary part belongs to e^(+i w t).

        Raises:
            ValueError: the amplitude is not positive.
        """
        if not amplitude > 0.0:
            raise ValueError(f"amplitude {amplitude} m: a dynamic stiffness needs a positive amplitude")
        relaxed = np.exp(-np.asarray(frequency, dtype=np.float64) / RELAXATION_FREQUENCY)
        warmer = temperature - REFERENCE_TEMPERATURE
        stiffness = (1 - RELAXATION * relaxed) * (1 - SOFTENING * warmer)
        loss = (1 + RELAXATION_LOSS * relaxed) * (1 - LOSS_SOFTENING * warmer)
        columns = [
            value
            * (contacts.stiffness(amplitude) / contacts.stiffness(BLOW_AMPLITUDE))
            * stiffness
            * (1 + 1j * contacts.loss_factor(amplitude) * loss)
            for value, contacts in (
                (self.shear, self.shear_contacts),
                (self.compression, self.compression_contacts),
                (self.rotation, self.compression_contacts),
            )
        ]
        return np.stack(columns, axis=-1)


@dataclass(frozen=True)
class Elastomer:
    """The cylinders of both joints, lower and upper, as they are in the bench and as the tester gets them."""

    cylinders: dict[str, tuple[Cylinder, Cylinder]]

    def dynamic_stiffness(
        self,
        specimen: str,
        configuration: str,
        amplitude: float,
        frequency: ArrayLike,
        temperature: float = REFERENCE_TEMPERATURE,
    ) -> Complex:
        """k + ih in N/m, shaped like `frequency` (Hz), at zero-to-peak `amplitude` m and `temperature` C.

        Compression is the lower cylinder alone, b; shear both, a + a; angled both at 45 degrees, half of each a and b.

        Raises:
            ValueError: no such specimen or configuration, or the amplitude is not positive.
        """
        self.require(specimen, configuration)
        weights = WEIGHTS[configuration]
        return sum(
            (
                cylinder.dynamic_stiffness(amplitude, frequency, temperature)[..., :2] @ weight
                for cylinder, weight in zip(self.cylinders[specimen], weights, strict=True)
            ),
            start=np.zeros(np.shape(frequency), dtype=np.complex128),
        )

    def static_force(self, specimen: str, configuration: str, preset: float) -> float:
        """Force in N that holds the specimen at `preset` m: the stiffness without its contacts, locking up slowly.

        Raises:
            ValueError: no such specimen or configuration.
        """
        if preset == 0.0:
            return 0.0
        static = self.dynamic_stiffness(specimen, configuration, abs(preset), 0.0).real
        return float(static * preset * (1 + STATIC_LOCKING * abs(preset)))

    def third_harmonic(self, specimen: str, configuration: str, amplitude: float) -> float:
        """Third harmonic of the force over the first: 0.1 % at 0.01 mm peak to peak, 0.7 % at 0.1 mm.

        It is in phase with the first (a force c1 sin p + c3 sin 3p), a little less in shear.

        Raises:
            ValueError: no such specimen or configuration.
        """
        self.require(specimen, configuration)
        share = {"compression": 1.0, "angled": 0.9, "shear": 0.6}[configuration]
        return float(share * 0.007 * (amplitude / 50e-6) ** 0.85)

    def require(self, specimen: str, configuration: str) -> None:
        """Raise ValueError unless there are such a specimen and such a configuration."""
        if specimen not in self.cylinders:
            raise ValueError(f"no specimen {specimen!r}; there are {', '.join(self.cylinders)}")
        if configuration not in WEIGHTS:
            raise ValueError(f"no configuration {configuration!r}; there are {', '.join(WEIGHTS)}")


def scattered(cylinder: Cylinder, rng: np.random.Generator, scale: float) -> Cylinder:
    """A sample of the same make: 1.5 % in stiffness, 3 % in loss and breaking amplitude, times `scale`."""

    def near(value: float, relative: float) -> float:
        return value * (1 + scale * relative * float(np.clip(rng.standard_normal(), -2, 2)))

    def contacts(mean: Contacts) -> Contacts:
        return replace(mean, median=near(mean.median, 0.03), loss_floor=near(mean.loss_floor, 0.03))

    return Cylinder(
        shear=near(cylinder.shear, 0.015),
        compression=near(cylinder.compression, 0.015),
        rotation=near(cylinder.rotation, 0.1),
        shear_contacts=contacts(cylinder.shear_contacts),
        compression_contacts=contacts(cylinder.compression_contacts),
    )
