"""The bench: everything physical that the simulated instruments are wired to, on one clock."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from threading import RLock
from typing import Any, Protocol

import numpy as np

from simlab.article import JOINT_NODES, NODE_POSITIONS, SENSOR_NODE, draw_article
from simlab.assembly import Complex
from simlab.beam import Real
from simlab.clock import Clock
from simlab.elastomer import REFERENCE_TEMPERATURE
from simlab.hammer_operator import Blow, BlowKind, HammerOperator
from simlab.sampling import Sampler, blow_amplitude, white_noise
from simlab.supported_beam import Load, SupportedBeam
from simlab.suspension import cords_for
from simlab.tester_frame import BLANK, PIECES, TesterFrame
from simlab.truth import direct_truth, inverse_truth, modal_truth

REACTION = 0.3
HAMMER_CHANNELS = ("hammer", "accelerometer")
BEAM, BEAM_CONFIGURATIONS = "beam", ("suspended", "supported")
SUSPENDED_MEMORY = 6.0
"""Seconds that a blow is heard on the hanging bar: its sharpest mode has died out to 1e-7 by then."""


class Actuator(Protocol):
    """What moves the specimen in the tester."""

    def signals(self, times: Real) -> tuple[Real, Real]:
        """Displacement in m and force in N at bench `times` (samples,) in s, as the sensors put them out."""


@dataclass(frozen=True)
class Conditions:
    """How the bench behaves, apart from its seed.

    Attributes:
        peak_force: mean peak force of a blow, N; a harder hammer level softens the joints.
        double_hits: probability that an ordinary blow bounces.
        tolerances: scale of what is drawn off its nominal value (bar, positions, cylinders); 0 is the drawing itself.
        scatter: scale of the hand's scatter in place, angle, force and width; 0 is a hammer in a guide.
        gain_error: largest relative error of a sensor's gain; 0 is exact.
        force_noise, acceleration_noise: white noise of the two sensors, N and m/s^2 rms a sample.
        cross_axis: cross-axis sensitivity of the accelerometer, through which it sees the bar bend out of plane.
        frame: what the tester adds to the specimen in it; nothing by default.
    """

    peak_force: float = 100.0
    double_hits: float = 0.03
    tolerances: float = 1.0
    scatter: float = 1.0
    gain_error: float = 0.005
    force_noise: float = 0.02
    acceleration_noise: float = 0.008
    cross_axis: float = 0.01
    frame: TesterFrame = field(default_factory=TesterFrame)


@dataclass(frozen=True)
class Mounted:
    """What is in the tester: cylinders of joint `specimen` (I or II), or a known piece in configuration blank."""

    specimen: str
    configuration: str


class Bench:
    """Beam on two joints, hammer and accelerometer, and the cylinders in the tester; safe to share between threads.

    For one seed, one set of conditions and one sequence of strikes at given times every signal is the same again.
    """

    def __init__(self, seed: int, clock: Clock, conditions: Conditions | None = None) -> None:
        self.seed = seed
        self.clock = clock
        self.conditions = conditions or Conditions()
        self.article = draw_article(seed, self.conditions.tolerances)
        self.elastomer = self.article.elastomer
        self.hand = HammerOperator(seed, self.conditions.scatter, self.conditions.double_hits)
        self.gains = self._draw_gains()
        self._weather = self._random(5).uniform([-0.2, 0, 0], [0.2, 2 * np.pi, 2 * np.pi])
        self._beam = SupportedBeam(self.article, self.conditions.cross_axis)
        self._sampler = Sampler(self._beam, self.temperature)
        self._silent_before = 0  # blows on the beam as it hung or stood before
        self._blows: list[Blow] = []
        self._mounted: Mounted | None = None
        self._actuator: Actuator | None = None
        self._lock = RLock()

    # --- the beam and the hammer ---

    @property
    def blows(self) -> tuple[Blow, ...]:
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
        """Let the hand strike `node` (1, 3 to 9, 11 in y; 1, 11 in x), with its peak at bench time `at` or soon.

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
            blow = self.hand.strike(number, node, direction, at, mean, kind)
            self._blows.append(blow)
            self._sampler.prepare(blow)

    def hammer_signals(self, start: float, rate: float, samples: int) -> dict[str, Real]:
        """``hammer`` in N and ``accelerometer`` in m/s^2, each (samples,), at bench times start + i / rate."""
        with self._lock:
            clean = self._sampler.read(self._blows[self._silent_before :], start, rate, samples)
        first = round(start * rate)
        noise = (self.conditions.force_noise, self.conditions.acceleration_noise)
        return {
            name: self.gains[name] * signal + rms * white_noise(self.seed, channel, first, samples)
            for channel, (name, signal, rms) in enumerate(zip(HAMMER_CHANNELS, clean, noise, strict=True))
        }

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
        """(lines,) exact accelerance of 3y in (m/s^2)/N for a straight force at the drawing's `node`.

        `frequency` (lines,) in Hz, above zero; the joints are those of a blow of `peak_force` N at `temperature` C.
        """
        load = Load(NODE_POSITIONS[node - 1], **{direction: 1.0})
        amplitude = blow_amplitude(peak_force or self.conditions.peak_force)
        return self._beam.accelerance(self._beam.lines(frequency), load, amplitude, temperature)

    def hang(self, suspended: bool) -> None:
        """Take the beam off its joints and hang it in two soft cords, or put it back; it comes to rest first."""
        with self._lock:
            if suspended:
                hanging = SupportedBeam(self.article, self.conditions.cross_axis, cords_for(self.article))
                self._sampler = Sampler(hanging, self.temperature, SUSPENDED_MEMORY)
            else:
                self._sampler = Sampler(self._beam, self.temperature)
            self._silent_before = len(self._blows)

    # --- the tester ---

    def mount(self, specimen: str, configuration: str) -> None:
        """Put the cylinders of joint `specimen` (I or II) into the tester in compression, shear or angled.

        In the configuration blank, `specimen` is a known piece: blank, empty or mass. The `specimen` beam does not go
        into the tester: it is hung in cords (suspended) or put on its joints (supported).

        Raises:
            ValueError: no such specimen, piece or configuration.
        """
        if specimen == BEAM and configuration in BEAM_CONFIGURATIONS:
            self.hang(configuration == BEAM_CONFIGURATIONS[0])
            return
        if configuration != BLANK:
            self.elastomer.require(specimen, configuration)
        elif specimen not in PIECES:
            raise ValueError(f"no piece {specimen!r} to calibrate by; there are {', '.join(PIECES)}")
        with self._lock:
            self._mounted = Mounted(specimen, configuration)

    @property
    def mounted(self) -> Mounted | None:
        """What is in the tester; None while it is empty."""
        with self._lock:
            return self._mounted

    def dynamic_stiffness(self, amplitude: float, frequency: float) -> complex:
        """k + ih in N/m as the machine finds it that moves by `amplitude` m, zero to peak, at `frequency` Hz.

        Raises:
            ValueError: the tester is empty.
        """
        return self.conditions.frame.in_series(self.own_stiffness(amplitude, frequency), frequency)

    def own_stiffness(self, amplitude: float, frequency: float) -> complex:
        """k + ih in N/m of what is mounted itself, at what it sees of the machine's `amplitude`, as warm as today.

        Raises:
            ValueError: the tester is empty.
        """
        mounted, temperature = self._require_mounted(), self.temperature(self.clock.now())
        if mounted.configuration == BLANK:
            return PIECES[mounted.specimen].dynamic_stiffness(frequency)

        def own(seen: float) -> complex:
            where = (mounted.specimen, mounted.configuration)
            return complex(self.elastomer.dynamic_stiffness(*where, seen, frequency, temperature))

        return self.conditions.frame.specimen_share(own, amplitude, frequency)[1]

    def static_force(self, preset: float) -> float:
        """Force in N that holds what is mounted at `preset` m.

        Raises:
            ValueError: the tester is empty.
        """
        mounted = self._require_mounted()

        def own(position: float) -> float:
            if mounted.configuration == BLANK:
                return PIECES[mounted.specimen].stiffness * position
            return self.elastomer.static_force(mounted.specimen, mounted.configuration, position)

        return self.conditions.frame.static_force(own, preset)

    def third_harmonic(self, amplitude: float) -> float:
        """Third harmonic of the force over its first, in phase with it, at zero-to-peak `amplitude` m.

        Raises:
            ValueError: the tester is empty.
        """
        mounted = self._require_mounted()
        if mounted.configuration == BLANK:
            return 0.0
        return self.elastomer.third_harmonic(mounted.specimen, mounted.configuration, amplitude)

    def attach_actuator(self, actuator: Actuator) -> None:
        """Connect the tester's actuator, whose signals `tester_signals` passes on."""
        with self._lock:
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

    # --- the room, and what is true ---

    def temperature(self, time: float) -> float:
        """Temperature in degrees Celsius at bench `time`: 23 within half a degree, drifting over hours."""
        offset, slow, fast = self._weather
        return float(
            23.0
            + offset
            + 0.2 * np.sin(2 * np.pi * time / 5400.0 + slow)
            + 0.08 * np.sin(2 * np.pi * time / 1300.0 + fast)
        )

    def truth(self) -> dict[str, Any]:
        """What the bench really is, ready for JSON; SI units, and the shape of the results that should equal it.

        ``modes``, ``inverse`` (joints at the mean blow's amplitude) and ``direct`` (every sine point at 23 C) are what
        identification should find; ``free``, ``drawn`` and ``conditions`` are why.
        """
        amplitude = blow_amplitude(self.conditions.peak_force)
        return {
            "modes": modal_truth(self._beam, amplitude),
            "inverse": inverse_truth(self.article, amplitude),
            "direct": direct_truth(self.elastomer),
            "free": {
                "frequency_hz": self._beam.free.frequency[3:6].tolist(),
                "damping_ratio": self._beam.free.damping_ratio[3:6].tolist(),
                "out_of_plane_hz": self._beam.free_across.frequency[3:5].tolist(),
            },
            "drawn": {
                "node_positions": list(NODE_POSITIONS),
                "joint_nodes": dict(JOINT_NODES),
                "sensor_node": SENSOR_NODE,
                "article": asdict(self.article),
                "gains": dict(self.gains),
                "blow_amplitude": amplitude,
            },
            "conditions": asdict(self.conditions),
        }

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
