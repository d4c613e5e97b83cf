"""The tester's plant: a servo-hydraulic actuator that holds a specimen at a preset and cycles it about that.

The servo loop has a finite bandwidth and yields a little to a stiff specimen, so the amplitude reached is less than the
amplitude commanded. Amplitude and mean approach what is commanded, the phase never jumps, and each cycle's amplitude
scatters by an absolute amount: 0.1 mm peak to peak is clean, 0.01 mm is near the limit of the machine.

Every command starts a segment; signals at any time of the last ten minutes follow in closed form from the segments and
the seed, so that asking twice gives the same samples.
"""

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simlab.bench import Mounted

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

# where a segment tabulates the specimen: densely about the steady amplitude, coarsely over all the machine can do
_COARSE = np.geomspace(2e-7, 5e-4, 9)
_FINE = np.geomspace(0.75, 1.33, 33)
HISTORY = 600.0
"""Bench time in s for which signals can be asked for afterwards; devices that record them are seconds behind."""
DROPPED = 100  # segments beyond that time that are dropped together, as this copies the others
_NOISE_TICK = 1e-7  # s; two samples closer than this share their noise


class TesterBench(Protocol):
    """The part of the bench that the actuator works against; amplitudes zero to peak in m, results shaped like them.

    Of many amplitudes together, because the tester's reply to a command waits for them.
    """

    @property
    def mounted(self) -> Mounted | None:
        """What is in the tester; None while it is empty."""

    def dynamic_stiffness(self, amplitude: ArrayLike, frequency: float) -> Complex:
        """k + ih in N/m at `amplitude` and `frequency` Hz, with all that the machine moves besides."""

    def own_stiffness(self, amplitude: ArrayLike, frequency: float) -> Complex:
        """k + ih in N/m of the specimen alone while the machine moves by `amplitude` at `frequency` Hz."""

    def static_force(self, preset: ArrayLike) -> Real:
        """Force in N that holds the specimen at `preset` m."""

    def third_harmonic(self, amplitude: ArrayLike) -> Real:
        """Third harmonic of the force over its first, in phase with it."""


@dataclass(frozen=True)
class Servo:
    """The performance of the machine; the defaults are of ordinary quality.

    Attributes:
        natural_frequency: of the closed loop, Hz.
        damping_ratio: of the closed loop.
        stiffness: of the loop against the specimen, N/m; the specimen's stiffness over it is the droop.
        amplitude_time: time constant with which amplitude approaches its steady value, s.
        stopping_time: the same when cycling is stopped, s.
        ramp_velocity: of the mean on the way to a preset, m/s.
        cycle_noise: standard deviation of a cycle's peak-to-peak displacement, m.
        displacement_noise: of a displacement sample, m rms.
        force_noise: of a force sample, N rms.
    """

    natural_frequency: float = 300.0
    damping_ratio: float = 0.7
    stiffness: float = 4e7
    amplitude_time: float = 0.05
    stopping_time: float = 0.01
    ramp_velocity: float = 1e-3
    cycle_noise: float = 3e-7
    displacement_noise: float = 3e-8
    force_noise: float = 0.05

    def response(self, frequency: float) -> float:
        """Amplitude of the unloaded loop over its command at `frequency` Hz."""
        ratio = frequency / self.natural_frequency
        return 1 / abs(1 - ratio**2 + 2j * self.damping_ratio * ratio)


@dataclass(frozen=True, slots=True)
class Dwell:
    """The truth about one stretch of steady cycling; what a measurement of it should find.

    Attributes:
        specimen: the joint whose cylinders were cycled.
        configuration: compression, shear or angled.
        frequency: Hz.
        commanded_pp: commanded peak-to-peak displacement, m.
        amplitude_pp: peak-to-peak displacement about which the settled cycles scatter, m.
        stiffness: k of the specimen itself, at what it sees of that amplitude, N/m.
        damping: h of the specimen itself, N/m.
        start: bench time of the command, s.
        stiffness_slope, damping_slope: change of k and h with the logarithm of amplitude, N/m.
    """

    specimen: str
    configuration: str
    frequency: float
    commanded_pp: float
    amplitude_pp: float
    stiffness: float
    damping: float
    start: float
    stiffness_slope: float = 0.0
    damping_slope: float = 0.0


@dataclass(frozen=True)
class _Segment:
    """Motion from one command to the next: exponential in amplitude, a ramp in mean, constant in frequency."""

    amplitudes: Real  # (knots,) m, rising, where stiffness and third harmonic are tabulated
    stiffness: Complex  # (knots,) N/m
    third: Real  # (knots,)
    positions: Real  # (knots,) m, rising, where the static force is tabulated
    static: Real  # (knots,) N
    start: float = 0.0
    frequency: float = 0.0
    cycles: float = 0.0  # completed since the machine was switched on, at `start`
    amplitude_from: float = 0.0  # zero to peak, m
    amplitude_to: float = 0.0
    noise_from: float = 0.0  # share of the cycle noise: 0 at rest, 1 while cycling
    noise_to: float = 0.0
    time_constant: float = 1.0
    mean_from: float = 0.0
    mean_to: float = 0.0
    ramp_velocity: float = 1.0

    def cycles_at(self, times: Real) -> Real:
        return self.cycles + self.frequency * np.maximum(times - self.start, 0.0)

    def amplitude_at(self, times: Real) -> tuple[Real, Real]:
        """Zero-to-peak amplitude without the cycle noise, m, and share of the cycle noise."""
        fade = np.exp(-np.maximum(times - self.start, 0.0) / self.time_constant)
        amplitude = self.amplitude_to + (self.amplitude_from - self.amplitude_to) * fade
        return amplitude, self.noise_to + (self.noise_from - self.noise_to) * fade

    def mean_at(self, times: Real) -> Real:
        travelled = self.ramp_velocity * np.maximum(times - self.start, 0.0)
        if self.mean_to >= self.mean_from:
            return np.minimum(self.mean_from + travelled, self.mean_to)
        return np.maximum(self.mean_from - travelled, self.mean_to)

    def stiffness_at(self, amplitude: Real) -> tuple[Real, Real]:
        k = np.interp(amplitude, self.amplitudes, self.stiffness.real)
        return k, np.interp(amplitude, self.amplitudes, self.stiffness.imag)


_AT_REST = _Segment(np.array([0.0, 1.0]), np.zeros(2, dtype=complex), np.zeros(2), np.array([0.0, 1.0]), np.zeros(2))


class Actuator:
    """The actuator in front of the specimen that the bench holds; commands take effect at the bench time `now` gives.

    Not guarded against two threads that command at once: the tester's controller is its only master. Signals may be
    asked for from any thread.
    """

    def __init__(self, bench: TesterBench, now: Callable[[], float], seed: int = 0, servo: Servo | None = None) -> None:
        self.servo = servo or Servo()
        self.servo_gain = 1.0  # 1 when healthy; a fault of the servo valve when not
        self._bench = bench
        self._now = now
        self._noise = _Noise(seed)
        self._past = [_AT_REST], [_AT_REST.start]  # segments and their starts
        self._log = list[Dwell]()

    def move(self, preset: float) -> None:
        """Stop cycling and ramp the mean to `preset`, m."""
        self._command(amplitude=0.0, frequency=self._last.frequency, preset=preset)

    def cycle(self, amplitude_pp: float, frequency: float) -> None:
        """Cycle with `amplitude_pp` m peak to peak (as commanded, not as reached) at `frequency` Hz."""
        self._command(amplitude=amplitude_pp / 2, frequency=frequency, preset=self._last.mean_to)

    def hold(self) -> None:
        """Stop cycling and ramping; the mean stays where it is."""
        self._command(amplitude=0.0, frequency=self._last.frequency, preset=self.mean(self._now()))

    def mean(self, time: float) -> float:
        """Mean position at bench `time`, m."""
        return float(self._at(time).mean_at(np.array([time]))[0])

    def amplitude_pp(self, time: float) -> float:
        """Peak-to-peak displacement at bench `time` without the cycle noise, m."""
        return float(2 * self._at(time).amplitude_at(np.array([time]))[0][0])

    def steady_pp(self) -> float:
        """Peak-to-peak displacement that the present command leads to, m; 0 at rest."""
        return 2 * self._last.amplitude_to

    def is_ramping(self, time: float) -> bool:
        """Whether the mean is still on its way to the preset."""
        return self.mean(time) != self._last.mean_to

    def rests_since(self, within: float) -> float | None:
        """Bench time in s from which it is at rest by its commands, to `within` m peak to peak; None if it cycles."""
        since = None
        for segment in reversed(self._past[0]):
            if segment.amplitude_to > 0.0:
                break
            fade = segment.time_constant * math.log(max(2 * segment.amplitude_from / within, 1.0))
            moves = max(fade, abs(segment.mean_to - segment.mean_from) / segment.ramp_velocity)
            since = segment.start + moves
            if moves > 0.0:
                break
        return since

    def force(self, time: float) -> tuple[float, float]:
        """Mean and peak-to-peak force at bench `time`, N, without noise."""
        segment, times = self._at(time), np.array([time])
        amplitude, _ = segment.amplitude_at(times)
        k, h = segment.stiffness_at(amplitude)
        mean = np.interp(segment.mean_at(times), segment.positions, segment.static)
        return float(mean[0]), float(2 * amplitude[0] * np.hypot(k, h)[0])

    def cycles_since_command(self, time: float) -> int:
        """Complete cycles since the last command."""
        segment = self._at(time)
        return max(math.floor(float(segment.cycles_at(np.array([time]))[0])) - math.ceil(segment.cycles), 0)

    def latest_cycles_pp(self, time: float, count: int) -> Real:
        """Peak-to-peak displacement, m, of the latest complete cycles since the last command, latest first."""
        segment = self._at(time)
        available = min(self.cycles_since_command(time), count)
        last = math.floor(float(segment.cycles_at(np.array([time]))[0]))
        middle = np.asarray(last - 0.5 - np.arange(available), dtype=np.float64)
        if available == 0:
            return middle
        when = segment.start + (middle - segment.cycles) / segment.frequency
        return np.asarray(2 * self._amplitude(segment, when, middle))

    def signals(self, times: Real) -> tuple[Real, Real]:
        """Displacement in m and force in N at bench `times` (samples,) in s, rising, as the sensors put them out."""
        displacement, force = np.empty_like(times), np.empty_like(times)
        segments, starts = self._past
        first = max(bisect_right(starts, times[0]) - 1, 0)
        last = max(bisect_right(starts, times[-1]) - 1, 0)
        edges = [0, *np.searchsorted(times, starts[first + 1 : last + 1]), times.size]
        for segment, begin, end in zip(segments[first : last + 1], edges, edges[1:], strict=False):
            part = slice(begin, end)
            displacement[part], force[part] = self._motion(segment, times[part])
        ticks = np.rint(times / _NOISE_TICK).astype(np.int64)
        displacement += self.servo.displacement_noise * self._noise.at(ticks, stream=1)
        force += self.servo.force_noise * self._noise.at(ticks, stream=2)
        return displacement, force

    @property
    def log(self) -> tuple[Dwell, ...]:
        """Every stretch of cycling so far, in order."""
        return tuple(self._log)

    def _motion(self, segment: _Segment, times: Real) -> tuple[Real, Real]:
        mean, cycles = segment.mean_at(times), segment.cycles_at(times)
        amplitude = self._amplitude(segment, times, cycles)
        k, h = segment.stiffness_at(amplitude)
        phase = 2 * np.pi * (cycles - np.floor(cycles))
        sine, cosine = np.sin(phase), np.cos(phase)
        first = amplitude * (k * sine + h * cosine)
        square = np.maximum((amplitude * amplitude) * (k * k + h * h), 1e-30)
        # sin 3y = 3 sin y - 4 sin^3 y, y being the phase of the force
        third = np.interp(amplitude, segment.amplitudes, segment.third) * first * (3 - 4 * first * first / square)
        static = np.interp(mean, segment.positions, segment.static)
        return mean + amplitude * sine, static + first + third

    def _amplitude(self, segment: _Segment, times: Real, cycles: Real) -> Real:
        """Zero-to-peak amplitude, m, with noise that runs straight from one cycle's value to the next one's."""
        amplitude, share = segment.amplitude_at(times)
        number = np.floor(cycles)
        part, key = cycles - number, number.astype(np.int64)
        noise = (1 - part) * self._noise.at(key, stream=0) + part * self._noise.at(key + 1, stream=0)
        return np.maximum(amplitude + share * self.servo.cycle_noise / 2 * noise, 0.0)

    @property
    def _last(self) -> _Segment:
        return self._past[0][-1]

    def _at(self, time: float) -> _Segment:
        segments, starts = self._past
        return segments[max(bisect_right(starts, time) - 1, 0)]

    def _command(self, amplitude: float, frequency: float, preset: float) -> None:
        now, last = self._now(), self._last
        times = np.array([now])
        amplitude_from, noise_from = last.amplitude_at(times)
        mean_from = float(last.mean_at(times)[0])
        cycling, mounted = amplitude > 0.0, self._bench.mounted
        steady = self._steady(amplitude, frequency)
        knots, stiffness, third = last.amplitudes, last.stiffness, last.third
        if cycling:  # a stop fades out on the same tables
            knots = np.union1d(_COARSE, _FINE * steady)
            stiffness = self._stiffness(knots, frequency)
            third = self._bench.third_harmonic(knots) if mounted else np.zeros(knots.size)
        positions = np.linspace(min(mean_from, preset), max(mean_from, preset) + 1e-9, 9)
        static = self._bench.static_force(positions) if mounted else np.zeros(positions.size)
        if cycling and mounted is not None:
            at, less, more = self._bench.own_stiffness(steady * np.array([1.0, 0.99, 1.01]), frequency)
            slope = (more - less) / 0.02
            truth = at.real, at.imag, now, slope.real, slope.imag
            names = (mounted.specimen, mounted.configuration)
            self._log.append(Dwell(*names, frequency, 2 * amplitude, 2 * steady, *truth))
        segments, starts = self._past
        if (old := bisect_right(starts, now - HISTORY) - 1) >= DROPPED:
            self._past = segments, starts = segments[old:], starts[old:]
        segments.append(
            _Segment(
                start=now,
                frequency=frequency,
                cycles=float(last.cycles_at(times)[0]),
                amplitude_from=float(amplitude_from[0]),
                amplitude_to=steady,
                noise_from=float(noise_from[0]),
                noise_to=float(cycling),
                time_constant=self.servo.amplitude_time if cycling else self.servo.stopping_time,
                mean_from=mean_from,
                mean_to=preset,
                ramp_velocity=self.servo.ramp_velocity,
                amplitudes=knots,
                stiffness=stiffness,
                third=third,
                positions=positions,
                static=static,
            )
        )
        # last, because `signals` looks here first and may run in another thread
        starts.append(now)

    def _steady(self, amplitude: float, frequency: float) -> float:
        """Where the amplitude settles: the loop's response, less the droop at the amplitude that is reached."""
        if amplitude == 0.0:
            return 0.0
        unloaded = amplitude * self.servo_gain * self.servo.response(frequency)
        reached = unloaded
        for _ in range(4):  # converges by a factor of some hundred a step
            reached = unloaded / (1 + abs(complex(self._stiffness(reached, frequency))) / self.servo.stiffness)
        return reached

    def _stiffness(self, amplitude: ArrayLike, frequency: float) -> Complex:
        if self._bench.mounted is None or frequency == 0.0:
            return np.zeros(np.shape(amplitude), np.complex128)
        return self._bench.dynamic_stiffness(amplitude, frequency)


class _Noise:
    """Standard normal numbers that depend only on a seed, a stream and an integer key."""

    def __init__(self, seed: int) -> None:
        self._table = np.random.default_rng(seed).standard_normal(1 << 16)

    def at(self, keys: NDArray[np.int64], stream: int) -> Real:
        # multiplicative hashing, so that neighbouring keys fall anywhere in the table
        mixed = (keys.astype(np.uint64) + np.uint64(stream << 56)) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
        mixed *= np.uint64(0xBF58476D1CE4E5B9)
        return np.asarray(self._table[mixed >> np.uint64(48)])
