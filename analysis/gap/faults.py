"""What is wrong with a measurement itself: found first, named, and taken out before any physics is looked for."""

from __future__ import annotations

from dataclasses import dataclass

from analysis.gap.mains_detection import found_hum, mains_hum, without_tones
from analysis.gap.measurement import Measurement
from analysis.gap.record_effect import RecordEffect
from analysis.gap.record_faults import record_faults
from analysis.gap.row_faults import rows_put_right


@dataclass(frozen=True, eq=False)
class Examined:
    """A measurement that can be believed.

    Attributes:
        measurement: put right as far as that goes; the same object where nothing had to be changed.
        faults: a sentence for each fault that was found.
        effects: of the catalogue, those that records show by themselves; each is among the faults too.
    """

    measurement: Measurement
    faults: tuple[str, ...]
    effects: tuple[RecordEffect, ...]


def examined(measurement: Measurement) -> Examined:
    """Look for faults and take them out.

    Lines at which the mains hums and dead rows are left out; sets in another unit, rows of wrong polarity and rows that
    were swapped are put right. Blows that bounced are in the averages already and spoil coherence, no more.

    Raises:
        AnalysisError: every row is dead.
    """
    double_hit, faults = record_faults(measurement.blows)
    hum = mains_hum(measurement)
    effects = [] if double_hit is None else [double_hit]
    if hum is not None:
        effects.append(found_hum(hum))
        measurement = without_tones(measurement, hum)
    if measurement.sets:
        measurement, of_rows = rows_put_right(measurement)
        faults += of_rows
    return Examined(measurement, (*faults, *(each.fault for each in effects)), tuple(effects))
