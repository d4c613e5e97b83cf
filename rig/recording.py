"""Storing the measurements of a sequence: every blow and every sine point is stored before the next one begins."""

import time
from datetime import UTC, datetime

from analysis.dof import Dof
from analysis.modal.blow_check import BlowVerdict
from daq.block import Block
from rig.hammer import BlowSink
from rig.sweep import SinePoint
from rig.thermometer import Thermometer
from store.blows import add_blow, add_point, count_withdrawals, list_points
from store.catalogue import Catalogue
from store.dof import StoredDof
from store.runs import Run
from store.sine_records import SineRecord, add_sine_record
from store.waveform import Waveform, WaveformChannel, WaveformReference


class BlowRecorder(BlowSink):
    """Stores the blows of one hammer step, accepted and refused, as set `set_number` of a run.

    Raises StoreError where the catalogue cannot be read.
    """

    def __init__(self, catalogue: Catalogue, run: Run, set_number: int, thermometer: Thermometer) -> None:
        self._catalogue = catalogue
        self._run = run
        self._set_number = set_number
        self._thermometer = thermometer
        with catalogue.reading() as session:  # points of an earlier part of the run
            begun = [point for point in list_points(session, run.id) if point.set_number == set_number]
            self._withdrawn = {point.id: count_withdrawals(session, point.id) for point in begun}
        self._points = {Dof.parse(str(point.dof)): point for point in begun}

    def withdrawn(self, point: Dof) -> int:
        """Number of accepted blows at `point` that were withdrawn since this step began.

        Raises StoreError where the catalogue cannot be read.
        """
        if point not in self._points:
            return 0
        number = self._points[point].id
        with self._catalogue.reading() as session:
            return count_withdrawals(session, number) - self._withdrawn.get(number, 0)

    def add_blow(self, point: Dof, number: int, block: Block, verdict: BlowVerdict) -> None:
        """Store blow `number` (from 1) at `point` with its record and verdict.

        Raises StoreError where it could not be stored, RigError where the thermometer does not answer.
        """
        temperature = self._thermometer.celsius()
        reference = save_block(self._catalogue, self._run, block)
        with self._catalogue.writing() as session:
            if point not in self._points:
                stored = StoredDof(point.node, point.direction.value)
                self._points[point] = add_point(session, self._run.id, stored, self._set_number)
            add_blow(
                session,
                self._points[point],
                number,
                accepted=verdict.accepted,
                reason="; ".join(map(str, verdict.reasons)) or None,
                waveform=reference,
                peak_force=verdict.peak_force,
                temperature_c=temperature,
                struck_at=block.started_at,
            )


class SineRecorder:
    """Stores the sine points of a sweep; `elapsed` is the time of the latest stored one, where a run is resumed."""

    def __init__(self, catalogue: Catalogue, run: Run, elapsed: float = 0.0) -> None:
        self._catalogue = catalogue
        self._run = run
        # since the start of the run, and increasing even where the clock was set back
        already = max((datetime.now(UTC) - run.started_at).total_seconds(), elapsed)
        self._started = time.monotonic() - already

    def add_sine(self, point: SinePoint) -> None:
        """Store a sine point with its record. Raises StoreError where it could not be stored."""
        reference = save_block(self._catalogue, self._run, point.block)
        record = SineRecord(
            order_number=point.order_number,
            specimen=point.specimen,
            configuration=point.configuration,
            commanded_pp_mm=round(1e3 * point.amplitude_pp, 9),
            reached_pp_mm=1e3 * point.reached_pp,
            frequency=point.frequency,
            elapsed=time.monotonic() - self._started,
            recorded_at=point.block.started_at,
            temperature_c=point.temperature_celsius,
            waveform=reference,
        )
        with self._catalogue.writing() as session:
            add_sine_record(session, self._run.id, record)


def save_block(catalogue: Catalogue, run: Run, block: Block) -> WaveformReference:
    """Append a block to the waveform file of the run, with the raw counts of the converter.

    Raises StoreError where it could not be stored.
    """
    channels = tuple(
        WaveformChannel(channel.name, channel.unit, tuple(scaling), channel.sensitivity)
        for channel, scaling in zip(block.channels, block.scaling, strict=True)
    )
    waveform = Waveform(
        channels=channels,
        samples=block.counts,
        sample_rate=block.sample_rate,
        started_at=block.started_at,
        trigger_index=block.trigger_index,
        overloaded=block.overloaded,
    )
    return catalogue.waveforms.append(run.waveform_file, waveform)
