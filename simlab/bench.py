"""The bench: everything physical that the simulated instruments are wired to, on one clock.

A bench is that of a case: of one drawn with its effects, or of the ordinary case, which has none.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property, reduce
from threading import RLock
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from simlab.article import JOINT_NAMES, JOINT_NODES, SENSOR_NODE
from simlab.beam import Real
from simlab.beside_the_beam import on_calibrator, on_suspended_mass
from simlab.case.blows import SAMPLE_RATE, UNIT_NOISE
from simlab.case.bundle import commitment, sealed, stated_setup, truth
from simlab.case.campaign import CONFIGURATIONS, Points, Row
from simlab.case.draw import Case
from simlab.case.effects.record import MainsHum
from simlab.case.simulate import as_tested, moved_specimen
from simlab.clock import Clock
from simlab.coupling import Complex
from simlab.elastomer import REFERENCE_TEMPERATURE, ElastomerCylinder, SimulatedCylinder
from simlab.hammer_operator import BlowKind, CampaignOperator, HammerOperator, SimulatedBlow
from simlab.ordinary import BenchConditions, ordinary_case
from simlab.sampling import MEMORY, Sampler, white_noise
from simlab.stand import BuiltCase, Stand
from simlab.tester_frame import BLANK, PIECES
from simlab.truth import direct_truth, free_truth, joint_truth, modal_truth

REACTION = 0.3
HAMMER_CHANNELS = ("hammer", "accelerometer")
BEAM, SUSPENDED, SUPPORTED = "beam", "suspended", "supported"
SENSOR, CALIBRATOR, MASS = "accelerometer", "calibrator", "mass"
"""The accelerometer as what is mounted: on the beam, on a hand-held calibrator, or on a mass that hangs in cords."""
SUSPENDED_MEMORY = 6.0
"""Seconds that a blow is heard on the hanging beam: its sharpest mode has died out to 1e-7 by then."""
WHOLE_TEST = 720
"""Sine points after which a drift that follows the order of the test is complete."""
NO_AMPLITUDE = 1e-12
"""Amplitude that stands for 0, m zero to peak, because the stiffness at 0 is not defined."""


class TesterActuator(Protocol):
    """The actuator that moves the specimen in the tester."""

    def signals(self, times: Real) -> tuple[Real, Real]:
        """Displacement in m and force in N at bench `times` (samples,) in s, as the sensors put them out."""


@runtime_checkable
class LoggingActuator(Protocol):
    """An actuator that keeps a log of every stretch of cycling."""

    @property
    def log(self) -> Sequence[object]:
        """Every stretch so far."""


@dataclass(frozen=True)
class Mounted:
    """The specimen in the tester: cylinders of joint `specimen` (I or II), or a known piece in configuration blank."""

    specimen: str
    configuration: str


class SimulatedBench:
    """Beam on two joints, hammer and accelerometer, and the cylinders in the tester; safe to share between threads.

    For one case, one set of conditions and one sequence of strikes at given times every signal is the same again.
    `ordinary_bench` and `case_bench` make one.
    """

    def __init__(self, case: Case, clock: Clock, conditions: BenchConditions, operator: HammerOperator) -> None:
        self.case = case
        self.seed = case.seed
        self.clock = clock
        self.conditions = conditions
        self.operator = operator
        self.built = BuiltCase.of(case)
        self.gains = self._draw_gains()
        self._weather = self._random(5).uniform([-0.2, 0, 0], [0.2, 2 * np.pi, 2 * np.pi])
        self._hum = [effect for effect in case.effects if isinstance(effect, MainsHum)]
        self._setup = 0
        self._sensor_on = BEAM
        self._blows: list[SimulatedBlow] = []
        self._mounted: Mounted | None = None
        self._at_tester = False
        self._actuator: TesterActuator | None = None
        self._lock = RLock()
        self._hang(suspended=False)

    # --- the beam and the hammer ---

    def set_up(self, number: int) -> None:
        """Begin hammer set `number` of the case, from 0: its gain, marks and peak force.

        Raises:
            ValueError: the case has no such set.
        """
        setups = self.built.campaign.setups
        if not 0 <= number < len(setups):
            raise ValueError(f"no set {number}; the case has sets 0 to {len(setups) - 1}")
        with self._lock:
            self._setup, self._at_tester = number, False
            self.conditions = replace(self.conditions, peak_force=setups[number].peak_force)

    @property
    def blows(self) -> tuple[SimulatedBlow, ...]:
        """Every blow so far, as it really happened."""
        with self._lock:
            return tuple(self._blows)

    def strike(
        self,
        node: int,
        direction: str,
        at: float | None = None,
        what: str | None = None,
        peak_force: float | None = None,
    ) -> None:
        """Strike `node` (1, 3 to 9, 11 in y; 1, 11 in x), with its peak at bench time `at` or soon.

        `what` is clean, double, weak, overload, soft or late; None is an ordinary blow, now and then a double hit.
        A positive force acts in the positive direction, at both ends.

        Raises:
            ValueError: no hammer reaches that point, or there is no such blow, or the force is not positive.
        """
        kind = None if what is None else BlowKind(what)
        mean = self.conditions.peak_force if peak_force is None else peak_force
        if not mean > 0.0:
            raise ValueError(f"a blow of {mean} N; the peak force must be positive")
        with self._lock:
            number = len(self._blows)
            if at is None:
                at = self.clock.now() + REACTION * (1 + self._random(4, number).uniform(-0.3, 0.3))
            blow = self.operator.strike(number, node, direction, at, mean, kind)
            blow = replace(blow, setup=self._setup)
            self._at_tester = False
            self._blows.append(blow)
            self._sampler.prepare(blow)

    def hammer_signals(self, start: float, rate: float, samples: int) -> dict[str, Real]:
        """``hammer`` in N and ``accelerometer`` in m/s^2, each (samples,), at bench times start + i / rate."""
        times = start + np.arange(samples) / rate
        with self._lock:
            if self._sensor_on == BEAM:
                clean = self._sampler.read(self._blows[self._silent_before :], start, rate, samples)
            else:
                beside = on_calibrator if self._sensor_on == CALIBRATOR else on_suspended_mass
                clean = beside(times, self._passed)
        first = round(start * rate)
        wider = np.sqrt(rate / (self.conditions.noise_rate or rate))
        noise = (wider * self.conditions.force_noise, wider * self.conditions.acceleration_noise)
        signals = {
            name: self.gains[name] * signal + rms * white_noise(self.seed, channel, first, samples)
            for channel, (name, signal, rms) in enumerate(zip(HAMMER_CHANNELS, clean, noise, strict=True))
        }
        for effect in self._hum:
            for tone, amplitude in effect.tones.items():
                signals["accelerometer"] += amplitude * np.sin(2 * np.pi * tone * times)
        return signals

    def _passed(self, omega: Real) -> Complex:
        """(lines,) what the chain makes of acceleration over force at `omega` (lines,) rad/s in the present set."""
        gain = self.built.campaign.setups[self._setup].gain
        chain = np.full(omega.shape, gain, dtype=np.complex128)
        return reduce(
            lambda known, effect: known * effect.passed(omega.astype(np.complex128)), self.built.effects, chain
        )

    def next_crossing(self, channel: str, level: float, after: float) -> float | None:
        """Bench time later than `after` when ``hammer`` first rises through `level` N; None if no known blow does.

        Raises:
            ValueError: the channel is not the hammer, or the level is not well above its noise.
        """
        if channel != "hammer":
            raise ValueError(f"no trigger on {channel!r}; the bench knows the crossings of 'hammer'")
        if level < 10 * self.conditions.force_noise or level <= 0.0:
            raise ValueError(f"a trigger level of {level} N is in the hammer's noise")
        force_level = level / self.gains["hammer"]
        blows = [blow for blow in self.blows if blow.pulses[-1].time > after]
        crossings = [pulse.crossing(force_level) for blow in blows for pulse in blow.pulses]
        for time in sorted(t for t in crossings if t is not None and t > after):
            before = time - 1e-5
            if sum(float(blow.force(before)) for blow in blows) < force_level:
                return time
        return None

    def accelerance(
        self,
        frequency: Real,
        node: int,
        direction: str,
        peak_force: float | None = None,
        temperature: float = REFERENCE_TEMPERATURE,
    ) -> Complex:
        """(lines,) exact accelerance of 3y in (m/s^2)/N for a straight force on the mark of `node` in the present set.

        `frequency` (lines,) in Hz, above zero; the joints are those of a blow of `peak_force` N at `temperature` C.
        """
        stand = Stand(self.built, frequency)
        force = peak_force or self.conditions.peak_force
        return stand.blow(Row(node, direction), self._setup, force, temperature=temperature)

    def _hang(self, *, suspended: bool) -> None:
        """Take the beam off its joints and hang it in two soft cords, or put it back; it comes to rest first."""

        def stand_at(frequency: Real) -> Stand:
            return Stand(self.built, frequency, suspended=suspended)

        with self._lock:
            self._sampler = Sampler(stand_at, self.temperature, SUSPENDED_MEMORY if suspended else MEMORY)
            self._silent_before = len(self._blows)

    # --- the tester ---

    def mount(self, specimen: str, configuration: str) -> None:
        """Put the cylinders of joint `specimen` (I or II) into the tester in compression, shear or angled.

        In the configuration blank, `specimen` is a known piece: blank, empty or mass. The `specimen` beam does not go
        into the tester: it is hung in cords (suspended) or put on its joints (supported). The accelerometer goes on the
        beam, on a calibrator or on a suspended mass.

        Raises:
            ValueError: no such specimen, piece or configuration.
        """
        if specimen == SENSOR and configuration in (BEAM, CALIBRATOR, MASS):
            with self._lock:
                self._sensor_on = configuration
            return
        if specimen == BEAM and configuration in (SUSPENDED, SUPPORTED):
            self._hang(suspended=configuration == SUSPENDED)
            return
        if configuration == BLANK:
            if specimen not in PIECES:
                raise ValueError(f"no piece {specimen!r} to calibrate by; there are {', '.join(PIECES)}")
        elif specimen not in self.built.article.joints:
            raise ValueError(f"no specimen {specimen!r}; there are {', '.join(self.built.article.joints)}")
        elif configuration not in CONFIGURATIONS:
            raise ValueError(f"no configuration {configuration!r}; there are {', '.join(CONFIGURATIONS)}")
        with self._lock:
            self._mounted, self._at_tester = Mounted(specimen, configuration), True

    @property
    def mounted(self) -> Mounted | None:
        """What is in the tester; None while it is empty."""
        with self._lock:
            return self._mounted

    def dynamic_stiffness(self, amplitude: ArrayLike, frequency: float) -> Complex:
        """k + ih in N/m as the machine measures it, shaped like its `amplitude` (m zero to peak), at `frequency` Hz.

        Raises:
            ValueError: the tester is empty.
        """
        found = self.conditions.frame.in_series(self.own_stiffness(amplitude, frequency), frequency)
        points = self._points(np.ravel(amplitude), frequency)
        return as_tested(self.built, np.ravel(found), points).reshape(np.shape(amplitude))

    def own_stiffness(self, amplitude: ArrayLike, frequency: float) -> Complex:
        """k + ih in N/m, shaped like `amplitude`, of the mounted specimen itself, as warm as the room.

        The specimen sees its share of the machine's amplitude.

        Raises:
            ValueError: the tester is empty.
        """
        mounted, temperature = self._require_mounted(), self.temperature(self.clock.now())
        if mounted.configuration == BLANK:
            return np.full(np.shape(amplitude), PIECES[mounted.specimen].dynamic_stiffness(frequency))
        return self.conditions.frame.specimen_share(
            lambda seen: self._specimen(seen, frequency, temperature), np.asarray(amplitude, np.float64), frequency
        )[1]

    def static_force(self, preset: ArrayLike) -> Real:
        """Force in N, shaped like `preset`, that holds the mounted specimen there, m.

        Raises:
            ValueError: the tester is empty.
        """
        mounted = self._require_mounted()

        def own(position: Real) -> Real:
            if mounted.configuration == BLANK:
                return PIECES[mounted.specimen].stiffness * position
            cylinder = self._cylinder(mounted)
            size = np.maximum(np.abs(position), NO_AMPLITUDE)
            static = self._specimen(size, cylinder.static_frequency, REFERENCE_TEMPERATURE).real
            return static * position * (1 + cylinder.locking * size)

        return self.conditions.frame.static_force(own, np.asarray(preset, np.float64))

    def third_harmonic(self, amplitude: ArrayLike) -> Real:
        """Third harmonic of the force over its first, in phase with it, shaped like `amplitude`, m zero to peak.

        Filled rubber has its own law; of linear cylinders it is as in the files of a case: 0.15 % of the tester, and
        more where an effect lets the stiffness change with amplitude.

        Raises:
            ValueError: the tester is empty.
        """
        mounted = self._require_mounted()
        amplitude = np.asarray(amplitude, np.float64)
        if mounted.configuration == BLANK:
            return np.zeros(amplitude.shape)
        cylinder = self._cylinder(mounted)
        if isinstance(cylinder, ElastomerCylinder):
            return cylinder.third_harmonic(mounted.configuration, amplitude)
        stiffness, step = self.own_stiffness(amplitude, 50.0), 0.05
        change = np.abs(self.own_stiffness(amplitude * (1 + step), 50.0) / stiffness - 1) / step
        return np.asarray(0.0015 + 0.05 * change)

    def _cylinder(self, mounted: Mounted) -> SimulatedCylinder:
        return self.built.article.joints[mounted.specimen].cylinders[0]

    def _specimen(self, amplitude: Real, frequency: float, temperature: float) -> Complex:
        """k + ih in N/m of the mounted cylinders, shaped like their own `amplitude`."""
        points = self._points(np.ravel(amplitude), frequency, temperature)
        return moved_specimen(self.built, points).reshape(np.shape(amplitude))

    def _points(self, amplitude: Real, frequency: float, temperature: float = REFERENCE_TEMPERATURE) -> Points:
        """Sine points of the mounted specimen at `amplitude` (points,), after as much of the test as was done."""
        mounted = self._require_mounted()
        if mounted.configuration == BLANK:
            mounted = Mounted(JOINT_NAMES[0], CONFIGURATIONS[0])
        done = len(self._actuator.log) if isinstance(self._actuator, LoggingActuator) else 0
        return Points.alike(
            JOINT_NAMES.index(mounted.specimen),
            CONFIGURATIONS.index(mounted.configuration),
            2e3 * amplitude,
            np.full(amplitude.size, frequency),
            temperature,
            order=min(done / (WHOLE_TEST - 1), 1.0),
        )

    def attach_actuator(self, actuator: TesterActuator) -> None:
        """Connect the tester's actuator, whose signals `tester_signals` passes on.

        Raises:
            RuntimeError: there is one already, whose signals would be lost.
        """
        with self._lock:
            if self._actuator is not None:
                raise RuntimeError("the bench has an actuator already")
            self._actuator = actuator

    def tester_signals(self, times: Real) -> dict[str, Real]:
        """``displacement`` in m and ``force`` in N at bench `times` (samples,) in s; zero without an actuator."""
        with self._lock:
            actuator = self._actuator
        if actuator is None:
            return {"displacement": np.zeros(np.shape(times)), "force": np.zeros(np.shape(times))}
        displacement, force = actuator.signals(times)
        if delay := self.conditions.frame.delay:
            displacement, _ = actuator.signals(times - delay)
        return {"displacement": displacement, "force": force}

    # --- the room, and the truth ---

    def temperature(self, time: float) -> float:
        """Temperature in degrees Celsius at bench `time`: that of the day within half a degree, drifting over hours.

        The day is that of the hammer set, or of the tester's points where something was mounted there since.
        """
        campaign = self.built.campaign
        at_beam = campaign.setups[self._setup].temperature
        day = np.mean(campaign.points.temperature) if self._at_tester else at_beam
        offset, slow, fast = self._weather
        return float(
            day
            + offset
            + 0.2 * np.sin(2 * np.pi * time / 5400.0 + slow)
            + 0.08 * np.sin(2 * np.pi * time / 1300.0 + fast)
        )

    def truth(self) -> dict[str, Any]:
        """The truth about the bench, ready for JSON; SI units, and the shape of the results that should equal it.

        ``inverse`` (joints at the mean blow's amplitude) and, of the ordinary bench, ``modes`` and ``direct`` (every
        sine point at 23 C) are what identification should find. The rest is why: what was put into the case, or
        ``free``, ``drawn`` and ``conditions``.
        """
        inverse = {"inverse": joint_truth(self.built)}
        if self.case.kind is not None:
            return truth(self.case) | inverse
        campaign = self.built.campaign
        return {
            "modes": modal_truth(self.built),
            **inverse,
            "direct": direct_truth(self.built),
            "free": free_truth(self.built),
            "drawn": {
                "node_positions": list(campaign.node_positions),
                "joint_nodes": dict(JOINT_NODES),
                "sensor_node": SENSOR_NODE,
                "article": asdict(self.built.article),
                "gains": dict(self.gains),
                "blow_amplitude": campaign.joint_amplitude * self.conditions.peak_force / 100.0,
            },
            "conditions": asdict(self.conditions),
        }

    @cached_property
    def _seal(self) -> dict[str, Any]:
        return sealed(self.truth() if self.case.kind is None else truth(self.case))

    def commitment(self) -> str:
        """SHA-256 of the sealed truth: asked for before anything is measured, it holds the bench to that truth."""
        return commitment(self._seal)

    def open_seal(self) -> dict[str, Any]:
        """Nonce and truth, of which the commitment is the hash."""
        return self._seal

    def drawing(self) -> dict[str, Any]:
        """The laboratory's statement of what was built and measured, as in the setup.json of the case's bundle."""
        return stated_setup(self.built.campaign)

    def _require_mounted(self) -> Mounted:
        mounted = self.mounted
        if mounted is None:
            raise ValueError("the tester is empty; mount a specimen first")
        return mounted

    def _draw_gains(self) -> dict[str, float]:
        errors = self.conditions.gain_error * self._random(6).uniform(-1, 1, len(HAMMER_CHANNELS))
        return {name: 1.0 + float(error) for name, error in zip(HAMMER_CHANNELS, errors, strict=True)}

    def _random(self, *stream: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, *stream])


def ordinary_bench(seed: int, clock: Clock, conditions: BenchConditions | None = None) -> SimulatedBench:
    """The bench of the paper as drawn by `seed`, without effects."""
    conditions = conditions or BenchConditions()
    operator = HammerOperator(seed, conditions.scatter, conditions.double_hits)
    return SimulatedBench(ordinary_case(seed, conditions), clock, conditions, operator)


def case_bench(case: Case, clock: Clock) -> SimulatedBench:
    """The bench of a drawn case: blows and sweeps of it are of the same case that `write_case` puts into a folder."""
    campaign = BuiltCase.of(case).campaign
    conditions = BenchConditions(
        peak_force=case.campaign.setups[0].peak_force,
        gain_error=0.0,
        force_noise=case.campaign.force_noise / UNIT_NOISE,
        acceleration_noise=case.campaign.acceleration_noise / UNIT_NOISE,
        noise_rate=SAMPLE_RATE,
        cross_axis=0.0,
    )
    return SimulatedBench(case, clock, conditions, CampaignOperator(case, campaign))
