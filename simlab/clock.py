"""Bench time: the one clock of the simulated laboratory, which may run faster than real time."""

import time


class Clock:
    """Seconds of bench time since the clock was made; bench time runs `speed` times as fast as the wall's.

    A clock has no state after it is made, so any number of threads may read it.

    Raises:
        ValueError: `speed` is not a positive finite number.
    """

    def __init__(self, speed: float = 1.0) -> None:
        if not 0.0 < speed < float("inf"):
            raise ValueError(f"the clock's speed is {speed}; it must be positive and finite")
        self.speed = speed
        self._zero = time.monotonic()

    def now(self) -> float:
        """Bench time in s."""
        return (time.monotonic() - self._zero) * self.speed

    def wall(self, duration: float) -> float:
        """Seconds on the wall that `duration` seconds of bench time take."""
        return duration / self.speed

    def monotonic(self, bench_time: float) -> float:
        """The time of `time.monotonic` at a bench time; every process of this computer has the same."""
        return self._zero + bench_time / self.speed

    def sleep(self, duration: float) -> None:
        """Sleep for `duration` seconds of bench time; not at all where it is negative."""
        self.sleep_until(self.now() + duration)

    def sleep_until(self, bench_time: float) -> None:
        """Sleep until the clock shows `bench_time`; return at once where that has passed."""
        while (remaining := bench_time - self.now()) > 0.0:
            time.sleep(self.wall(remaining))
