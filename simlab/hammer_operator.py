"""The operator with the hammer: blows as they come, with scatter in place, angle, force and width."""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from simlab.article import JOINT_NODES, NODE_POSITIONS
from simlab.beam import Load, Real
from simlab.case.campaign import Campaign, Row
from simlab.case.draw import Case
from simlab.case.effects.record import DoubleHit
from simlab.coupling import Complex

PULSE_WIDTH = 0.6e-3
PLACE_SCATTER = 1e-3
SETUP_BIAS = 0.5e-3
ANGLE_SCATTER = np.radians(1.0)
FORCE_SCATTER = 0.1
WIDTH_SCATTER = 0.05


class BlowKind(StrEnum):
    """A good blow, or one of the ways in which blows go wrong."""

    CLEAN = "clean"
    DOUBLE = "double"
    """The hammer bounces: 5 to 40 % of the peak again after 4 to 30 ms."""
    WEAK = "weak"
    """A tenth to a fifth of the force asked for."""
    OVERLOAD = "overload"
    """3 to 4 kN, beyond the range of the hammer and its input."""
    SOFT = "soft"
    """A soft tip, or a mitt in between: four to six times as long, so no force at high frequency."""
    LATE = "late"
    """The hammer first leans on the beam with a fifth of the peak force, and strikes 40 to 80 ms later."""


@dataclass(frozen=True)
class Pulse:
    """One contact of the hammer: peak force in N at `time`, with the half-height width of a sine-squared of `width` s.

    The shape is a Gaussian, which differs from a sine-squared at its foot only and is, unlike it, band-limited, so that
    its samples at any rate are exact.
    """

    time: float
    peak: float
    width: float = PULSE_WIDTH

    @property
    def _tau(self) -> float:
        return self.width / (4 * float(np.sqrt(np.log(2))))

    def force(self, times: Real | float) -> Real:
        """Force in N at `times` in s."""
        return np.asarray(self.peak * np.exp(-(((np.asarray(times) - self.time) / self._tau) ** 2)))

    def spectrum(self, frequency: Real, origin: float) -> Complex:
        """Fourier transform in N s at `frequency` in Hz, with time counted from `origin`."""
        size = self.peak * self._tau * np.sqrt(np.pi) * np.exp(-((np.pi * frequency * self._tau) ** 2))
        return np.asarray(size * np.exp(-2j * np.pi * frequency * (self.time - origin)))

    @property
    def foot(self) -> float:
        """Time before which the force is below 1e-15 of the peak."""
        return self.time - 6 * self._tau

    def crossing(self, level: float) -> float | None:
        """Time at which the force rises through `level` N above zero; None where the peak is lower."""
        if self.peak <= level:
            return None
        return self.time - self._tau * float(np.sqrt(np.log(self.peak / level)))


@dataclass(frozen=True)
class SimulatedBlow:
    """One blow as it happened.

    Attributes:
        number: how many blows came before it.
        row: where the operator aimed; a positive force acts in the positive direction.
        kind: how the operator struck.
        pulses: contacts of the hammer.
        load: where and how the force met the beam, as far as that is due to the operator.
        setup: number of the hammer set, from 0.
    """

    number: int
    row: Row
    kind: BlowKind
    pulses: tuple[Pulse, ...]
    load: Load
    setup: int = 0

    @property
    def peak_force(self) -> float:
        """Largest force in N."""
        return max(pulse.peak for pulse in self.pulses)

    @property
    def foot(self) -> float:
        """Time at which the hammer first touches."""
        return min(pulse.foot for pulse in self.pulses)

    def force(self, times: Real | float) -> Real:
        """Force in N at `times` in s."""
        return np.asarray(sum(pulse.force(times) for pulse in self.pulses))

    def spectrum(self, frequency: Real, origin: float) -> Complex:
        """Fourier transform in N s at `frequency` in Hz, with time counted from `origin`."""
        return np.asarray(sum(pulse.spectrum(frequency, origin) for pulse in self.pulses))


class HammerOperator:
    """Strikes the article; every blow is drawn from the seed, its number and what is asked, and from nothing else.

    Args:
        seed: of the operator.
        scatter: scale of all scatter; 0 is a hammer in a guide.
        double_hits: probability that an ordinary blow bounces.
    """

    def __init__(self, seed: int, scatter: float = 1.0, double_hits: float = 0.03) -> None:
        self.seed = seed
        self.scatter = scatter
        self.double_hits = double_hits

    def strike(
        self, number: int, node: int, direction: str, time: float, peak_force: float, kind: BlowKind | None = None
    ) -> SimulatedBlow:
        """A blow whose main peak, of about `peak_force` N, is at `time`; `kind` None is an ordinary blow.

        Raises:
            ValueError: no hammer reaches that point.
        """
        _require_reachable(node, direction)
        rng = np.random.default_rng([self.seed, 2, number])
        if kind is None:
            kind = BlowKind.DOUBLE if rng.random() < self.double_hits else BlowKind.CLEAN
        load = self._load(rng, node, direction)
        width = PULSE_WIDTH * (1 + self.scatter * WIDTH_SCATTER * _bounded(rng))
        main = Pulse(time, peak_force * (1 + self.scatter * FORCE_SCATTER * _bounded(rng)), width)
        return SimulatedBlow(number, Row(node, direction), kind, _pulses(kind, main, rng), load)

    def place_bias(self, node: int, direction: str) -> tuple[float, float]:
        """How far off, m, the mark at a point is for all of its blows: along and across for y, up and across for x."""
        rng = np.random.default_rng([self.seed, 3, node, "xy".index(direction)])
        first, second = self.scatter * SETUP_BIAS * np.clip(rng.standard_normal(2), -3, 3)
        return float(first), float(second)

    def _load(self, rng: np.random.Generator, node: int, direction: str) -> Load:
        """Place and lean of this blow. That a transverse blow off the middle line twists the beam is left out."""
        place = NODE_POSITIONS[node - 1]
        first, across = (
            bias + self.scatter * PLACE_SCATTER * _bounded(rng) for bias in self.place_bias(node, direction)
        )
        lean, lean_across = (self.scatter * ANGLE_SCATTER * _bounded(rng) for _ in range(2))
        straight = float(np.sqrt(1.0 - np.sin(lean) ** 2 - np.sin(lean_across) ** 2))
        load = Load(place, z=float(np.sin(lean_across)))
        if direction == "x":
            return replace(load, x=straight, y=float(np.sin(lean)), r=-first * straight, s=-across * straight)
        # the end points are struck just inside the edge
        position = min(max(place + first, 0.0), NODE_POSITIONS[-1])
        return replace(load, position=position, y=straight, x=float(np.sin(lean)))


class CampaignOperator(HammerOperator):
    """Strikes as the campaign of a drawn case says: on its marks, with its pulse width and the bounces of the case."""

    def __init__(self, case: Case, campaign: Campaign) -> None:
        super().__init__(case.seed, double_hits=0.0)
        self._campaign = campaign
        self._bouncing = [effect for effect in case.effects if isinstance(effect, DoubleHit)]

    def strike(
        self, number: int, node: int, direction: str, time: float, peak_force: float, kind: BlowKind | None = None
    ) -> SimulatedBlow:
        """A blow as `HammerOperator` makes it, with what the campaign and the effects change.

        Raises:
            ValueError: no hammer reaches that point.
        """
        blow = super().strike(number, node, direction, time, peak_force, kind)
        rng = np.random.default_rng([self.seed, 8, number])
        beside = self._campaign.place_scatter * _bounded(rng)
        load = self._campaign.straight(blow.row)
        if direction == "y":
            load = replace(load, position=load.position + beside)
        # a half-sine is above half its height for two thirds of its width, a sine-squared for half of it
        widened = self._campaign.pulse_width * 4 / 3 / PULSE_WIDTH
        pulses = [replace(pulse, width=pulse.width * widened) for pulse in blow.pulses]
        if blow.kind is BlowKind.CLEAN and kind is None:
            bounces = [effect.bounce(rng) for effect in self._bouncing]
            pulses += [
                replace(pulses[0], time=time + bounce[0], peak=pulses[0].peak * bounce[1])
                for bounce in bounces
                if bounce is not None
            ]
        return replace(blow, load=load, pulses=tuple(pulses))


def _require_reachable(node: int, direction: str) -> None:
    """Raise ValueError unless a hammer reaches `node` in `direction`: 1, 3 to 9, 11 in y, and the end faces in x."""
    if direction == "y" and 1 <= node <= len(NODE_POSITIONS) and node not in JOINT_NODES.values():
        return
    if direction == "x" and node in (1, len(NODE_POSITIONS)):
        return
    raise ValueError(f"no hammer reaches {node}{direction}; it reaches 1, 3 to 9 and 11 in y, and 1 and 11 in x")


def _pulses(kind: BlowKind, main: Pulse, rng: np.random.Generator) -> tuple[Pulse, ...]:
    match kind:
        case BlowKind.DOUBLE:
            return main, replace(
                main, time=main.time + rng.uniform(4e-3, 30e-3), peak=main.peak * rng.uniform(0.05, 0.4)
            )
        case BlowKind.WEAK:
            return (replace(main, peak=main.peak * rng.uniform(0.1, 0.2)),)
        case BlowKind.OVERLOAD:
            return (replace(main, peak=rng.uniform(3000.0, 4000.0)),)
        case BlowKind.SOFT:
            return (replace(main, width=main.width * rng.uniform(4.0, 6.0)),)
        case BlowKind.LATE:
            lean = Pulse(main.time - rng.uniform(40e-3, 80e-3), main.peak * rng.uniform(0.15, 0.25), 40e-3)
            return lean, main
        case BlowKind.CLEAN:
            return (main,)


def _bounded(rng: np.random.Generator) -> float:
    """A standard normal number within three standard deviations."""
    return float(np.clip(rng.standard_normal(), -3, 3))
