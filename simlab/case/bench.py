"""The bench of a case: the instruments' bench with the article, the effects and the noise of one case.

Its beam and its rubber are the case's, so blows and sweeps through the instruments are of the same case that
`write_case` puts into a folder.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol, runtime_checkable

import numpy as np

from simlab.assembly import Complex
from simlab.beam import Real
from simlab.bench import Bench, Conditions, Mounted
from simlab.case.article import JOINT_NAMES
from simlab.case.blows import RECORD_SECONDS, SAMPLE_RATE
from simlab.case.bundle import stated_setup, truth
from simlab.case.campaign import CONFIGURATIONS, Campaign, Points, Row
from simlab.case.draw import Case
from simlab.case.effects.record import DoubleHit, MainsHum
from simlab.case.expected import expected_joints
from simlab.case.seal import commitment, sealed
from simlab.case.simulate import Stand, direct_stiffness, specimen_stiffness, stand_of
from simlab.clock import Clock
from simlab.elastomer import BLOW_AMPLITUDE, REFERENCE_TEMPERATURE
from simlab.hammer_operator import Blow, BlowKind, HammerOperator, Pulse
from simlab.sampling import Sampler
from simlab.supported_beam import Load
from simlab.tester_frame import BLANK

WHOLE_TEST = 720
"""Sine points after which a drift that follows the order of the test is complete."""


@dataclass(frozen=True, kw_only=True)
class MarkedLoad(Load):
    """A blow by its row and set; `position` is how far, m, it is beside the row's mark."""

    row: Row
    setup: int


@runtime_checkable
class Logging(Protocol):
    """An actuator that keeps a log of every stretch of cycling."""

    @property
    def log(self) -> Sequence[object]:
        """Every stretch so far."""


class CaseHand(HammerOperator):
    """Strikes as the case's campaign says; `setup` is the number of the hammer set, from 0."""

    def __init__(self, case: Case, campaign: Campaign) -> None:
        super().__init__(case.seed, double_hits=0.0)
        self.setup = 0
        self._campaign = campaign
        self._bouncing = [effect for effect in case.effects if isinstance(effect, DoubleHit)]

    def strike(
        self, number: int, node: int, direction: str, time: float, peak_force: float, kind: BlowKind | None = None
    ) -> Blow:
        """A blow as `HammerOperator` makes it, on the campaign's marks, with its width and with the case's bounces."""
        blow = super().strike(number, node, direction, time, peak_force, kind)
        rng = np.random.default_rng([self.seed, 8, number])
        beside = self._campaign.place_scatter * float(np.clip(rng.standard_normal(), -3, 3))
        load = MarkedLoad(position=beside, row=Row(node, direction), setup=self.setup)
        # a half-sine is above half its height for two thirds of its width, a sine-squared for half of it
        widened = self._campaign.pulse_width * 4 / 3 / Pulse(0.0, 1.0).width
        pulses = [replace(pulse, width=pulse.width * widened) for pulse in blow.pulses]
        if blow.kind is BlowKind.CLEAN and kind is None:
            bounces = [effect.bounce(rng) for effect in self._bouncing]
            pulses += [
                replace(pulses[0], time=time + bounce[0], peak=pulses[0].peak * bounce[1])
                for bounce in bounces
                if bounce is not None
            ]
        return replace(blow, load=load, pulses=tuple(pulses))


class CaseBeam:
    """The case's stand for the sampler of blows."""

    def __init__(self, case: Case) -> None:
        self._case = case

    def lines(self, frequency: Real) -> Stand:
        """The stand at frequency lines (lines,) in Hz, all above zero."""
        return stand_of(self._case, frequency)

    def accelerance(
        self,
        lines: Stand,
        load: Load,
        amplitude: float,
        temperature: float,  # noqa: ARG002 - the case's rubber knows no weather, its bench does
    ) -> Complex:
        """(lines,) accelerometer reading per force, (m/s^2)/N, under a blow that would deform cylinders by `amplitude`.

        The case's own amplitudes follow from the peak force that `amplitude` stands for.

        Raises:
            TypeError: the load is not a marked one.
        """
        if not isinstance(load, MarkedLoad):
            raise TypeError("a case's beam needs to know which row of which set a blow belongs to")
        return lines.blow(load.row, load.setup, 100.0 * amplitude / BLOW_AMPLITUDE, load.position)


class CaseBench(Bench):
    """A bench whose beam, rubber, hand and noise are those of `case`; safe to share between threads."""

    def __init__(self, case: Case, clock: Clock) -> None:
        stand = stand_of(case, np.ones(1))
        self.case = case
        self._built, self._campaign = stand.article, stand.campaign
        # white noise of unit variance a sample has this spectrum in a record
        unit = float(np.sqrt(RECORD_SECONDS / SAMPLE_RATE))
        conditions = Conditions(
            peak_force=case.campaign.setups[0].peak_force,
            gain_error=0.0,
            force_noise=case.campaign.force_noise / unit,
            acceleration_noise=case.campaign.acceleration_noise / unit,
            cross_axis=0.0,
        )
        super().__init__(case.seed, clock, conditions)
        self.hand: CaseHand = CaseHand(case, self._campaign)
        self._sampler = Sampler(CaseBeam(case), self.temperature)
        self._hum = [effect for effect in case.effects if isinstance(effect, MainsHum)]

    def set_up(self, number: int) -> None:
        """Begin hammer set `number` of the case, from 0: its gain, marks and peak force.

        Raises:
            ValueError: the case has no such set.
        """
        if not 0 <= number < len(self._campaign.setups):
            raise ValueError(f"no set {number}; the case has sets 0 to {len(self._campaign.setups) - 1}")
        with self._lock:
            self.hand.setup = number
            self.conditions = replace(self.conditions, peak_force=self._campaign.setups[number].peak_force)

    def hammer_signals(self, start: float, rate: float, samples: int) -> dict[str, Real]:
        """``hammer`` in N and ``accelerometer`` in m/s^2, each (samples,), at bench times start + i / rate."""
        signals = super().hammer_signals(start, rate, samples)
        times = start + np.arange(samples) / rate
        for effect in self._hum:
            for tone, amplitude in effect.tones.items():
                signals["accelerometer"] = signals["accelerometer"] + amplitude * np.sin(2 * np.pi * tone * times)
        return signals

    def accelerance(
        self,
        frequency: Real,
        node: int,
        direction: str,
        peak_force: float | None = None,
        temperature: float = REFERENCE_TEMPERATURE,  # noqa: ARG002 - the case's rubber knows no weather
    ) -> Complex:
        """(lines,) exact accelerance of 3y in (m/s^2)/N for a force on the mark of `node` in the present set.

        `frequency` (lines,) in Hz, above zero; the joints are those of a blow of `peak_force` N; any `temperature`.
        """
        force = peak_force or self.conditions.peak_force
        return stand_of(self.case, frequency).blow(Row(node, direction), self.hand.setup, force, 0.0)

    def dynamic_stiffness(self, amplitude: float, frequency: float) -> complex:
        """k + ih in N/m as the machine finds it that moves by `amplitude` m, zero to peak, at `frequency` Hz.

        Raises:
            ValueError: the tester is empty.
        """
        mounted = self._require_mounted()
        if mounted.configuration == BLANK:
            points = self._point(Mounted(JOINT_NAMES[0], CONFIGURATIONS[0]), amplitude, frequency)
            stiffness = np.array([super().own_stiffness(amplitude, frequency)])
            for effect in self.case.effects:
                stiffness = effect.tested(stiffness, points)
            return complex(self._campaign.tester_gain * stiffness[0])
        campaign = replace(self._campaign, points=self._point(mounted, amplitude, frequency))
        return complex(direct_stiffness(self._built, campaign, self.case.effects)[0])

    def own_stiffness(self, amplitude: float, frequency: float) -> complex:
        """k + ih in N/m of what is mounted itself, without what the tester does to it.

        Raises:
            ValueError: the tester is empty.
        """
        mounted = self._require_mounted()
        if mounted.configuration == BLANK:
            return super().own_stiffness(amplitude, frequency)
        point = self._point(mounted, amplitude, frequency)
        return complex(specimen_stiffness(self._built, point, self.case.effects)[0])

    def static_force(self, preset: float) -> float:
        """Force in N that holds what is mounted at `preset` m, by its stiffness at a tenth of a hertz.

        Raises:
            ValueError: the tester is empty.
        """
        if self._require_mounted().configuration == BLANK or preset == 0.0:
            return super().static_force(preset)
        return self.own_stiffness(abs(preset), 0.1).real * preset

    def third_harmonic(self, amplitude: float) -> float:
        """Third harmonic of the force over its first, in phase with it, at zero-to-peak `amplitude` m.

        As in the files: 0.15 % of the tester, and more where the stiffness changes with amplitude.

        Raises:
            ValueError: the tester is empty.
        """
        if self._require_mounted().configuration == BLANK:
            return 0.0
        stiffness, step = self.own_stiffness(amplitude, 50.0), 0.05
        change = abs(self.own_stiffness(amplitude * (1 + step), 50.0) / stiffness - 1) / step
        return 0.0015 + 0.05 * change

    def temperature(self, time: float) -> float:
        """Temperature in degrees Celsius at bench `time`: of the hammer set's day, and the tester's once it is used."""
        weather = super().temperature(time) - REFERENCE_TEMPERATURE
        if self.mounted is None:
            return self._campaign.setups[self.hand.setup].temperature + weather
        return float(np.mean(self._campaign.points.temperature)) + weather

    def truth(self) -> dict[str, Any]:
        """What was put into the case and, in ``inverse``, what identification should find; ready for JSON."""
        return truth(self.case) | {"inverse": expected_joints(self.case)}

    @cached_property
    def _seal(self) -> dict[str, Any]:
        return sealed(self.case)

    def commitment(self) -> str:
        """SHA-256 of the sealed truth: asked for before anything is measured, it holds the bench to that truth."""
        return commitment(self._seal)

    def open_seal(self) -> dict[str, Any]:
        """What the commitment is of: nonce and truth."""
        return self._seal

    def drawing(self) -> dict[str, Any]:
        """What the lab says that it built and measured, as in the setup.json of the case's bundle."""
        return stated_setup(self._campaign)

    def _point(self, mounted: Mounted, amplitude: float, frequency: float) -> Points:
        """One sine point of what is mounted, after as much of the test as the actuator has done."""
        done = len(self._actuator.log) if isinstance(self._actuator, Logging) else 0
        return Points(
            order=np.array([min(done / (WHOLE_TEST - 1), 1.0)]),
            time=np.array([self.clock.now()]),
            specimen=np.array([JOINT_NAMES.index(mounted.specimen)]),
            configuration=np.array([CONFIGURATIONS.index(mounted.configuration)]),
            amplitude_pp_mm=np.array([2e3 * amplitude]),
            frequency=np.array([frequency]),
            temperature=np.array([REFERENCE_TEMPERATURE]),
        )
