"""Acquisition of one's own: a WAV file. Try: jointlab conformance daq wav://FILE --plugin own_daq.py:open_source."""

import time
import wave

import numpy as np

from daq.errors import ChannelError
from daq.instrument import Device
from daq.stream import Samples


class Replay:
    """The instrument. It begins again where the file ends."""

    def __init__(self, path):
        with wave.open(path, "rb") as file:
            self.rate, samples = file.getframerate(), np.frombuffer(file.readframes(-1), "<i2")  # 16 bits
            self.counts = samples.reshape(-1, file.getnchannels()).T
        self.devices = (Device("wav", "WAV file", path, tuple(f"wav/ai{n}" for n in range(len(self.counts)))),)

    def open(self, channels, sample_rate):
        """The channels as a stream."""
        if sample_rate > self.rate:
            raise ChannelError(f"the file has {self.rate} Hz, not {sample_rate:g} Hz")
        return Stream(self.rate, self.counts[[self.devices[0].inputs.index(each.physical) for each in channels]])

    def close(self):
        """Nothing is open."""


class Stream:
    """Channels of +-1 V, with as many samples as time has passed since the start."""

    def __init__(self, rate, counts):
        self.sample_rate, self.counts = rate, counts
        self.scaling, self.ranges = [(0.0, 1 / 2**15)] * len(counts), [(-1.0, 1.0)] * len(counts)

    def start(self):
        """Begin with sample 0."""
        self.began, self.given = time.monotonic(), 0

    def read(self, timeout):
        """The samples since the last read."""
        time.sleep(min(timeout, 0.01))
        first, self.given = self.given, int((time.monotonic() - self.began) * self.sample_rate)
        return Samples(first, np.take(self.counts, range(first, self.given), axis=1, mode="wrap"))

    def stop(self):
        """Nothing runs on."""

    close = stop


def open_source(address):
    """The instrument at wav://FILE."""
    return Replay(address.partition("://")[2])
