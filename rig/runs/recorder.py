"""Writing the measurements of a sequence: every blow and every sine point is written before the next one begins."""

import time
from datetime import UTC, datetime

from analysis.dof import Dof
from analysis.modal.blow_check import BlowVerdict
from daq.block import Block
from rig.control import RunControl
from rig.hammer.session import BlowSink
from rig.runs.records import BlowRecord, RunRecords, SinePointRecord
from rig.sweep.driven_sweep import SinePoint
from rig.thermometer import Thermometer
from store.waveforms.waveform import Waveform, WaveformChannel


class BlowRecorder(BlowSink):
    """Writes the blows of one hammer step, accepted and refused, as set `set_number` of a run."""

    def __init__(self, records: RunRecords, set_number: int, thermometer: Thermometer, control: RunControl) -> None:
        self._records = records
        self._set_number = set_number
        self._thermometer = thermometer
        self._control = control

    def withdrawn(self, point: Dof) -> int:
        """Number of accepted blows at `point` that were withdrawn while the run is carried out."""
        return self._control.withdrawn(self._set_number, point)

    def add_blow(self, point: Dof, number: int, block: Block, verdict: BlowVerdict) -> None:
        """Write blow `number` (from 1) at `point` with its record and verdict.

        Raises StoreError where it could not be written, RigError where the thermometer does not answer.
        """
        record = BlowRecord(
            set_number=self._set_number,
            point=str(point),
            number=number,
            accepted=verdict.accepted,
            reason="; ".join(map(str, verdict.reasons)) or None,
            peak_force=verdict.peak_force,
            temperature_c=self._thermometer.celsius(),
            struck_at=block.started_at,
        )
        self._records.write(record, waveform_of(block))


class SineRecorder:
    """Writes the sine points of a sweep.

    Args:
        records: their destination.
        started_at: UTC, when the run began.
        elapsed: s from then to the latest sine point, where a run is resumed.
    """

    def __init__(self, records: RunRecords, started_at: datetime, elapsed: float = 0.0) -> None:
        self._records = records
        # since the start of the run, and increasing even where the clock was set back
        already = max((datetime.now(UTC) - started_at).total_seconds(), elapsed)
        self._started = time.monotonic() - already

    def add_sine(self, point: SinePoint) -> None:
        """Write a sine point with its record. Raises StoreError where it could not be written."""
        record = SinePointRecord(
            order_number=point.order_number,
            specimen=point.specimen,
            configuration=point.configuration,
            commanded_pp_mm=round(1e3 * point.amplitude_pp, 9),
            reached_pp_mm=1e3 * point.reached_pp,
            frequency=point.frequency,
            driven_frequency=point.driven_frequency if point.driven_frequency != point.frequency else None,
            elapsed=time.monotonic() - self._started,
            recorded_at=point.block.started_at,
            temperature_c=point.temperature_celsius,
        )
        self._records.write(record, waveform_of(point.block))


def waveform_of(block: Block) -> Waveform:
    """A block as it is stored, with the raw counts of the converter."""
    channels = tuple(
        WaveformChannel(channel.name, channel.unit, tuple(scaling), channel.sensitivity)
        for channel, scaling in zip(block.channels, block.scaling, strict=True)
    )
    return Waveform(
        channels=channels,
        samples=block.counts,
        sample_rate=block.sample_rate,
        started_at=block.started_at,
        trigger_index=block.trigger_index,
        overloaded=block.overloaded,
    )
