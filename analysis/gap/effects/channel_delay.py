"""Acceleration that comes late against force, by filters or multiplexed channels; up to 50 us."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class ChannelDelay(Effect):
    """Delay between the channels."""

    id = "channel_delay"
    title = "delay between the channels"
    form_is_known = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("tau", "s", 0.0, 33e-6),)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, chain=bench.chain * np.exp(-given["tau"] * bench.pole))
