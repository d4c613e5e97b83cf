"""Labelled blows of the simulated hand, judged: false alarms, misses and what they are called.

Every blow is recorded as on a real bench: triggered at 5 N, pre-trigger 50 ms, 2 s at 5120 Hz, in steps of a 24-bit
converter and clipped at its range. The device's own report of an overload is withheld. Beams, hands, points and hammer
levels change with the seed.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Real
from analysis.modal.blow_check import BlowFault, BlowLimits, BlowVerdict, check_blow, check_point
from simlab.bench import SimulatedBench, ordinary_bench
from simlab.clock import Clock
from simlab.ordinary import BenchConditions
from tests.bench.bench_modes import POINTS

RATE, SAMPLES, PRE_TRIGGER = 5120.0, 10_240, 256
TRIGGER_LEVEL = 5.0  # N
RANGE, ACCELERATION_RANGE = 2200.0, 490.0  # N, m/s^2
LIMITS = BlowLimits(lowest_peak_force=30.0, highest_frequency=1024.0)
BAND = (20.0, 1024.0)
BENCHES = 50
EXPECTED = {  # and how many of each a bench gets
    "clean": (None, 60),
    "double": (BlowFault.DOUBLE_HIT, 40),
    "weak": (BlowFault.WEAK, 8),
    "overload": (BlowFault.CLIPPED, 8),
    "clipped": (BlowFault.CLIPPED, 8),  # a clean blow, its acceleration cut at 50 to 90 % of its peak
    "soft": (BlowFault.SOFT, 8),
    "late": (BlowFault.LATE_TRIGGER, 8),
}
BLOWS_A_POINT = 6


@dataclass(frozen=True)
class Judged:
    """A blow's label and its verdict."""

    what: str
    verdict: BlowVerdict


def main() -> None:
    """Print the share refused and the share rightly called, by label; then the same for blows at a wrong point."""
    judged = [blow for seed in range(BENCHES) for blow in labelled_blows(seed)]
    print(f"{'label':<10}{'blows':>7}{'refused':>9}{'rightly called':>16}   called")
    for what, (fault, _) in EXPECTED.items():
        verdicts = [blow.verdict for blow in judged if blow.what == what]
        refused = sum(not verdict.accepted for verdict in verdicts)
        right = refused if fault is None else sum(fault in verdict.faults for verdict in verdicts)
        names = Counter(str(name) for verdict in verdicts for name in verdict.faults)
        print(
            f"{what:<10}{len(verdicts):>7}{refused:>9}{'' if fault is None else right:>16}   "
            + ", ".join(f"{name} {count}" for name, count in names.most_common()),
            flush=True,
        )
    wrong_points()


def labelled_blows(seed: int) -> list[Judged]:
    """Blows of every kind on one bench, in any order."""
    rng = np.random.default_rng(seed)
    bench = ordinary_bench(
        seed, Clock(), BenchConditions(peak_force=float(np.exp(rng.uniform(np.log(60), np.log(300)))))
    )
    labels = [what for what, (_, count) in EXPECTED.items() for _ in range(count)]
    rng.shuffle(labels)
    judged = []
    for number, what in enumerate(labels):
        point = POINTS[rng.integers(len(POINTS))]
        # a light blow stays one: a tenth to a fifth of 100 N is weak, of 300 N it is not
        peak = 100.0 if what == "weak" else None
        kind = "clean" if what == "clipped" else what
        force, acceleration = record(bench, 1 + 5.0 * number, point.node, str(point.direction), kind, peak)
        reach = float(np.max(np.abs(acceleration))) * rng.uniform(0.5, 0.9) if what == "clipped" else ACCELERATION_RANGE
        force, acceleration = converted(force, RANGE, RANGE), converted(acceleration, ACCELERATION_RANGE, reach)
        judged.append(Judged(what, check_blow(force, acceleration, RATE, PRE_TRIGGER, LIMITS)))
    return judged


def converted(signal: Real, full_scale: float, reach: float) -> Real:
    """In steps of a 24-bit converter, cut at `reach`."""
    step = full_scale / 2**23
    return np.asarray(np.round(np.clip(signal, -reach, reach) / step) * step)


def record(
    bench: SimulatedBench, at: float, node: int, direction: str, what: str, peak_force: float | None = None
) -> tuple[Real, Real]:
    """Force and acceleration (samples,) of one blow, as a triggered device takes them."""
    bench.strike(node, direction, at=at, what=what, peak_force=peak_force)
    crossing = bench.next_crossing("hammer", TRIGGER_LEVEL, at - 1.0)
    assert crossing is not None
    signals = bench.hammer_signals(crossing - PRE_TRIGGER / RATE, RATE, SAMPLES)
    return signals["hammer"], signals["accelerometer"]


def wrong_points() -> None:
    """One blow in a point's six goes to a neighbour's mark, across the beam; in as many points none does."""
    across = [point for point in POINTS if point.direction == "y"]
    found = alarms = misses = blamed = 0
    along = [point for point in POINTS if point.direction == "x"]
    for seed in range(BENCHES // 2):
        rng = np.random.default_rng([seed, 1])
        bench = ordinary_bench(1000 + seed, Clock())
        time = 1.0
        for index, point in [*enumerate(across), *((-1, point) for point in along)]:
            struck = [point] * BLOWS_A_POINT
            wrong = int(rng.integers(BLOWS_A_POINT)) if index >= 0 and rng.random() < 0.5 else None
            if wrong is not None:
                struck[wrong] = across[index - 1] if index else across[1]
            pairs = []
            for each in struck:
                pairs.append(record(bench, time, each.node, str(each.direction), "clean"))
                time += 5.0
            force, acceleration = (np.array(signal) for signal in zip(*pairs, strict=True))
            inconsistent = [reason is not None for reason in check_point(force, acceleration, RATE, BAND)]
            alarms += sum(inconsistent) - (wrong is not None and inconsistent[wrong])
            blamed += BLOWS_A_POINT - (wrong is not None)
            if wrong is not None:
                found, misses = found + inconsistent[wrong], misses + (not inconsistent[wrong])
    print(f"at a neighbour's mark: {found} of {found + misses} found; {alarms} of {blamed} right ones inconsistent")


if __name__ == "__main__":
    main()
