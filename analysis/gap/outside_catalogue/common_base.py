"""A base that carries all joints and moves as a whole, so that each joint feels the other: a table, a frame, a plate.

The catalogue has foundations of single joints. A common base is a rival of it, as changes at one place of the beam are.
"""

from dataclasses import dataclass, replace
from typing import ClassVar

from analysis.gap.bench import BeamBench, Setting, mass_on_spring
from analysis.gap.effect import Effect, Given, Mechanism
from analysis.gap.measurement import Measurement
from analysis.gap.outside_catalogue.local_change import LOCAL_CHANGE
from analysis.gap.parameter import Parameter


@dataclass(frozen=True)
class CommonBase(Effect):
    """A mass on a spring with structural damping, across the beam."""

    id = LOCAL_CHANGE
    title = "a base that all joints share"
    mechanism = Mechanism.ATTACHMENT
    law = "a base that all joints share"
    own_parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("f", "Hz", 200.0, 1.0, positive=True, starts=(-1.4, -0.7, -0.2, 0.3, 0.9, 1.6)),
        Parameter("k", "N/m", 1.5e7, 1.0, positive=True, starts=(0.0, 2.5)),
        Parameter("eta", "1", 0.05, 0.7, positive=True),
    )

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        base = mass_on_spring(given["k"], given["eta"], given["f"], bench.pole)
        return replace(bench, on_base=True, base=base)


def common_base(measurement: Measurement) -> tuple[Effect, ...]:
    """The base, as the only variant; empty where the beam has a single joint, or where it was not struck."""
    return (CommonBase(),) if measurement.sets and len(measurement.drawing.joints) > 1 else ()
