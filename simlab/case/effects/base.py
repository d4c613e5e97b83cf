"""The form of every effect: a name, a law with its values, and the few places where it can touch a case."""

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simlab.article import SimulatedArticle
from simlab.beam import FreeModes, Load, Real
from simlab.case.campaign import Campaign, Points, Row
from simlab.coupling import Attachment, Complex
from simlab.elastomer import REFERENCE_TEMPERATURE

Value = float | str

LATER = {
    "frequency_dependence": 1,  # after what changes a loss that is tied to nothing
    "cubic_stiffness": 2,  # it and the state change what the rubber has become, relaxation included
    "temperature_shift": 2,
    "preload_stiffening": 2,
    "conditioning_drift": 2,
    "coulomb_friction": 3,  # beside the rubber
    "foundation_compliance": 1,  # under the cylinders with their patch
    "joint_mass": 2,  # on the beam, not on the foundation
    "frame_compliance": 1,  # in series with specimen and fixture
    "frame_resonance": 2,
    "transducer_lag": 2,  # of signals that show all of that
    "sensor_gain": 1,  # a chain passes all that the accelerometer sees
    "channel_delay": 1,
    "highpass_corner": 1,
}
"""Rank of an effect by name, else 0: effects on the same quantity act in this order, from the rubber outwards."""


@dataclass(frozen=True, eq=False)
class CylinderState:
    """The state of the cylinders of one joint; arrays are (n,), one for each line or sine point.

    Attributes:
        in_tester: whether the cylinders are in the tester; otherwise they are in the beam's stand.
        joint: I or II.
        frequency: Hz.
        deformation: amplitude, m zero to peak.
        component: share of the deformation in shear and in compression each.
        order: fraction of the test that is over.
        temperature: deg C.
        setup: number of the hammer set, from 0.
        configuration: (n,) of the tester; None in the stand.
        felt: (n, 2) amplitude in shear and in compression, m zero to peak, where each cylinder has its own.
    """

    in_tester: bool
    joint: str
    frequency: Real
    deformation: Real
    component: Real
    order: Real
    temperature: float | Real = REFERENCE_TEMPERATURE
    setup: int = 0
    configuration: NDArray[np.int64] | None = None
    felt: Real | None = None

    @property
    def amplitude(self) -> Real:
        """(n,) m zero to peak, in shear and in compression each."""
        return np.asarray(self.deformation * self.component)

    @property
    def amplitudes(self) -> Real:
        """(n, 2) m zero to peak, in shear and in compression."""
        return np.stack([self.amplitude] * 2, axis=1) if self.felt is None else self.felt


@dataclass(frozen=True, eq=False)
class RowReading:
    """One row of one hammer set on its way through the measuring chain.

    Attributes:
        row, setup: what was struck, in which set (from 0).
        position: of the row's node, m from the left end.
        order: fraction of the set that is over.
        frequency: (lines,) Hz.
        article: what was struck.
        omega: (lines,) rad/s, with minus the decay of an uncorrected window as imaginary part: what the chain makes of
            a signal is there before the window, so its response is taken at this omega.
    """

    row: Row
    setup: int
    position: float
    order: float
    frequency: Real
    article: SimulatedArticle
    omega: Complex


@dataclass(frozen=True, eq=False)
class SimulatedEffect(ABC):
    """An effect that the paper's model leaves out. A kind of effect overrides `draw` and the few hooks it needs.

    Attributes:
        size: fraction of the plausible range.
        law: which of the rival laws.
        values: parameters of the law by name, SI unless the name says otherwise.
    """

    size: float
    law: str
    values: Mapping[str, Value]

    name: ClassVar[str]
    """The class name in lower case with underscores, as truths and catalogues have it."""
    roving: ClassVar[bool] = False
    """Whether the joints change from row to row of a set."""
    felt: ClassVar[bool] = False
    """Whether each joint follows its own motion under each blow."""
    reduces_motion: ClassVar[bool] = False
    """Whether it takes part of the tester's motion, which the specimen then does not see."""
    sets: ClassVar[int] = 1
    """Hammer sets of a campaign without which it may not show."""

    def __init_subclass__(cls) -> None:
        cls.name = re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__).lower()

    @classmethod
    @abstractmethod
    def draw(cls, rng: np.random.Generator, size: float, article: SimulatedArticle) -> Self:
        """An effect of `size` (above 0, up to 1) of its plausible range on `article`."""

    @property
    def rank(self) -> int:
        """Effects of a lower one act first."""
        return LATER.get(self.name, 0)

    def number(self, name: str) -> float:
        """The value of a parameter that is a number."""
        return float(self.values[name])

    @property
    def window_decay(self) -> float:
        """Decay of an uncorrected exponential window, 1/s."""
        return 0.0

    def built(self, article: SimulatedArticle) -> SimulatedArticle:
        """The article, as this effect changes it."""
        return article

    def measured(self, campaign: Campaign) -> Campaign:
        """The campaign, as this effect changes it."""
        return campaign

    def cylinder(self, stiffness: Complex, state: CylinderState) -> Complex:
        """(n, 3) dynamic stiffness of one cylinder in shear, compression and rotation."""
        return stiffness

    def joints(self, stiffness: Complex, article: SimulatedArticle, omega: Complex) -> Complex:
        """(lines, 6, 6) dynamic stiffness of both joints in x, y, rotation of I, then of II."""
        return stiffness

    def deformed(self, motion: Complex, stiffness: Complex, omega: Complex) -> Complex:
        """(lines, 6) deformation of joints of `stiffness` (lines, 6, 6) where the beam has a `motion` (lines, 6)."""
        return motion

    def attachments(self, modes: FreeModes, article: SimulatedArticle, omega: Complex) -> list[Attachment]:
        """Further attachments of the beam."""
        return []

    def sensed(self, shape: Real, modes: FreeModes, article: SimulatedArticle) -> Real:
        """(modes,) shapes as the accelerometer takes them."""
        return shape

    def struck(self, load: Load, row: Row) -> Load:
        """Where and how a blow really meets the beam."""
        return load

    def read(self, accelerance: Complex, reading: RowReading) -> Complex:
        """(lines,) accelerance as the measuring chain gives it."""
        return np.asarray(accelerance * self.passed(reading.omega))

    def passed(self, omega: Complex) -> Complex:
        """Factor, () or (lines,), of acceleration over force by the chain alone, whatever the accelerometer sits on."""
        return np.ones((), dtype=np.complex128)

    def bounced(self, rng: np.random.Generator, frequency: Real, blows: tuple[int, int]) -> Complex:
        """Factor on the force's spectrum, broadcast to (blows, rows, lines), of single `blows` (blows, rows)."""
        return np.ones(1, dtype=np.complex128)

    def hummed(self, rng: np.random.Generator, frequency: Real, blows: tuple[int, int]) -> Complex:
        """The spectrum that is added to that of the acceleration, m/s^2 s, broadcast to (blows, rows, lines)."""
        return np.zeros(1, dtype=np.complex128)

    def tested(self, stiffness: Complex, points: Points) -> Complex:
        """(points,) dynamic stiffness as the tester gives it."""
        return stiffness


def either_sign(rng: np.random.Generator) -> float:
    """1 or -1."""
    return 1.0 if rng.random() < 0.5 else -1.0


def one_of(rng: np.random.Generator, *choices: str) -> str:
    """One of the choices."""
    return choices[int(rng.integers(len(choices)))]
