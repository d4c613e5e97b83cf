"""The mains and its multiples on the accelerometer.

Shows in the records of blows, or in dips of coherence at single lines (`analysis.gap.mains_detection`), where it
is found before anything is fitted; in accelerances it is noise at lines that are then left out. Ground loops of a
hundredth to a tenth of a metre per square second are usual on a bench with an unshielded cable.
"""

from __future__ import annotations

from dataclasses import dataclass

from analysis.gap.effect import Effect
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class MainsHum(Effect):
    """Hum of the mains."""

    id = "mains_hum"
    title = "mains hum"
    law = "found in records"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("amplitude", "m/s^2", 0.0, 0.05, least=0.0),)
