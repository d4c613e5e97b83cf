"""How long experiments take on the rig, for steps with their default values."""

from functools import cache
from statistics import fmean

from analysis.gap.experiments.catalogue import RigTime
from jointlab.sequences.wording import SECONDS_A_BLOW
from rig.sequences.sequence import HammerStep
from rig.sequences.sweep_plan import SweepPlan

SETTLING = 3.0
"""s, until the amplitude of a sine is steady."""


@cache
def rig_time() -> RigTime:
    """Rig time of the paper's steps; a person changes the set-up, so that time is the default of `RigTime`."""
    hammer, sweep = HammerStep(step="hammer"), SweepPlan()
    records = fmean(sweep.record_duration(frequency, 0.0, 1.0) for frequency in sweep.frequencies)
    return RigTime(point=hammer.blows * SECONDS_A_BLOW, sine=SETTLING + records)
