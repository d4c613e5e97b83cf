"""The kinds of bench that cases are drawn on: the paper's, a long soft one and a short hard one."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from simlab.beam import Real, SimulatedBeam


def _paper_joints() -> Mapping[str, tuple[float, float]]:
    return {"I": (0.36e6, 2.30e6), "II": (0.49e6, 2.70e6)}


@dataclass(frozen=True, eq=False)
class BenchKind:
    """A bench as drawn, and how it is measured; its nodes keep their numbers.

    Attributes:
        beam: nominal.
        inset_mm: least distance of the joints from the ends, and the end of that range (exclusive); whole millimetres.
        unevenness: largest shift of the nodes between the joints, m, to either side.
        joints: shear and compression stiffness of one cylinder, N/m, from which a sample is up to 18 % off.
        amplitudes_pp_mm, sine_frequencies: of the tester's grid, mm and Hz.
        levels: peak forces of the hammer sets, N, of which a case has one choice.
    """

    beam: SimulatedBeam = field(default_factory=SimulatedBeam)
    inset_mm: tuple[int, int] = (53, 60)
    unevenness: float = 0.0
    joints: Mapping[str, tuple[float, float]] = field(default_factory=_paper_joints)
    amplitudes_pp_mm: tuple[float, ...] = (0.1, 0.05, 0.01)
    sine_frequencies: Real = field(default_factory=lambda: np.arange(5.0, 201.0, 5.0))
    levels: tuple[tuple[float, ...], ...] = ((100.0, 100.0, 400.0), (100.0, 400.0))


PAPER = BenchKind()
LONG_AND_SOFT = BenchKind(
    beam=SimulatedBeam(length=1.18, height=0.022, width=0.044, damping_ratios=(0.003, 0.0012, 0.0015)),
    inset_mm=(90, 150),
    unevenness=0.012,
    joints={"I": (0.16e6, 0.95e6), "II": (0.12e6, 0.80e6)},
    amplitudes_pp_mm=(0.2, 0.06, 0.02),
    sine_frequencies=np.round(np.geomspace(4.0, 150.0, 24), 1),
    levels=((60.0, 60.0, 240.0), (60.0, 60.0), (60.0,)),
)
SHORT_AND_HARD = BenchKind(
    beam=SimulatedBeam(length=0.70, height=0.030, width=0.060, damping_ratios=(0.002, 0.001)),
    inset_mm=(35, 60),
    unevenness=0.006,
    joints={"I": (0.75e6, 4.6e6), "II": (0.70e6, 5.2e6)},
    amplitudes_pp_mm=(0.08, 0.03, 0.01, 0.004),
    sine_frequencies=np.arange(10.0, 241.0, 10.0),
    levels=((150.0, 150.0, 500.0), (80.0, 200.0, 500.0), (150.0, 500.0)),
)
DRAWINGS = {"paper": PAPER, "long_and_soft": LONG_AND_SOFT, "short_and_hard": SHORT_AND_HARD}
