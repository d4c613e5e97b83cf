"""Accelerances of a set, by a roving hammer or a shaker, measured or imported, with coherence and variance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import Session

from store.arrays import decode_array, encode_array
from store.dof import StoredDof
from store.errors import NotFoundError, StoreError
from store.excitation import HAMMER, Excitation
from store.models.results import FrequencyResponseRow, FrequencyResponseSetRow
from store.runs import get_run

Real = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FrequencyResponseSet:
    """One complete set: of a roving hammer, or of a shaker that stays while the accelerometer roves.

    By reciprocity the two are alike; a set is always written as that of a hammer.

    Attributes:
        number: from 1 within the run; the first is the reference set.
        response: where the accelerometer sits, or the shaker pushes.
        inputs: (rows,) where the hammer struck, or the accelerometer went.
        frequency: (lines,) Hz, rising.
        accelerance: (rows, lines) complex64 or complex128, (m/s^2)/N.
        coherence: (rows, lines) in 0..1, or None where it was not measured.
        variance: (rows, lines) per real and imaginary part, ((m/s^2)/N)^2, or None where it is not known.
        averages: blows averaged at each point.
        peak_force: typical peak of the blows, or amplitude of the sine, N.
        window: of the records, as `blow_window` reads it; none for plain ones.
        sample_rate: Hz; block_seconds: length of a record, s.
        estimator: H1, ... or what an imported file leaves unsaid.
        source: the file it was imported from, or None.
        excitation: hammer, or sine for a shaker's.
    """

    number: int
    response: StoredDof
    inputs: tuple[StoredDof, ...]
    frequency: Real
    accelerance: NDArray[Any]
    averages: int
    peak_force: float
    temperature_c: float
    window: str
    sample_rate: float
    block_seconds: float
    estimator: str
    coherence: Real | None = None
    variance: Real | None = None
    source: str | None = None
    excitation: Excitation = HAMMER

    def __post_init__(self) -> None:
        shape = (len(self.inputs), self.frequency.size)
        if 0 in shape or len(set(self.inputs)) != len(self.inputs):
            raise StoreError(f"set {self.number}: inputs {', '.join(map(str, self.inputs))} are empty or not unique")
        if not np.all(np.diff(self.frequency) > 0):
            raise StoreError(f"set {self.number}: frequencies do not rise")
        if not np.iscomplexobj(self.accelerance):
            raise StoreError(f"set {self.number}: accelerance is not complex")
        for name in ("accelerance", "coherence", "variance"):
            array = getattr(self, name)
            if array is not None and array.shape != shape:
                raise StoreError(f"set {self.number}: {name} has shape {array.shape}, expected (rows, lines) = {shape}")


def add_frequency_responses(session: Session, analysis_id: int, run_id: int, measured: FrequencyResponseSet) -> None:
    """Store a set of `run_id` that `analysis_id` computed or imported.

    Raises:
        NotFoundError: there is no such run.
        StoreError: an array holds values that are not finite.
    """
    get_run(session, run_id)
    name = f"run {run_id}, set {measured.number}"
    row = FrequencyResponseSetRow(
        analysis_id=analysis_id,
        run_id=run_id,
        set_number=measured.number,
        response_node=measured.response.node,
        response_direction=measured.response.direction,
        frequency=encode_array(measured.frequency, f"{name}: frequency"),
        lines=int(measured.frequency.size),
        highest_frequency=float(measured.frequency[-1]),
        averages=measured.averages,
        peak_force=measured.peak_force,
        temperature_c=measured.temperature_c,
        window=measured.window,
        sample_rate=measured.sample_rate,
        block_seconds=measured.block_seconds,
        estimator=measured.estimator,
        source=measured.source,
        excitation=measured.excitation,
    )
    session.add(row)
    session.flush()

    def encoded(array: NDArray[Any] | None, index: int, what: str) -> bytes | None:
        return None if array is None else encode_array(array[index], f"{name}: {what} of {measured.inputs[index]}")

    session.add_all(
        FrequencyResponseRow(
            set_id=row.id,
            row_number=index + 1,
            input_node=dof.node,
            input_direction=dof.direction,
            accelerance=encoded(measured.accelerance, index, "accelerance"),
            coherence=encoded(measured.coherence, index, "coherence"),
            variance=encoded(measured.variance, index, "variance"),
        )
        for index, dof in enumerate(measured.inputs)
    )
    session.flush()


def list_frequency_responses(
    session: Session, run_id: int, analysis_id: int | None = None
) -> list[FrequencyResponseSet]:
    """The sets of a run from one analysis, the newest where none is named, in the order of their numbers.

    Raises:
        NotFoundError: the run has no frequency responses from that analysis.
        DamagedError: an array is not what was stored.
    """
    query = select(FrequencyResponseSetRow).filter_by(run_id=run_id)
    if analysis_id is None:
        newest = select(FrequencyResponseSetRow.analysis_id).filter_by(run_id=run_id)
        analysis_id = session.scalars(
            newest.order_by(FrequencyResponseSetRow.analysis_id.desc()).limit(1)
        ).one_or_none()
    rows = session.scalars(query.filter_by(analysis_id=analysis_id).order_by(FrequencyResponseSetRow.set_number))
    found = [_set(session, row) for row in rows]
    if not found:
        whose = "" if analysis_id is None else f" of analysis {analysis_id}"
        raise NotFoundError(f"run {run_id} has no frequency responses{whose}")
    return found


def _set(session: Session, row: FrequencyResponseSetRow) -> FrequencyResponseSet:
    name = f"run {row.run_id}, set {row.set_number}"
    query = select(FrequencyResponseRow).filter_by(set_id=row.id).order_by(FrequencyResponseRow.row_number)
    responses = session.scalars(query).all()

    def stacked(what: str) -> NDArray[Any] | None:
        columns = [getattr(response, what) for response in responses]
        if any(column is None for column in columns):
            return None
        return np.stack([decode_array(column, f"{name}: {what}") for column in columns])

    accelerance = stacked("accelerance")
    if accelerance is None:
        raise NotFoundError(f"{name} has no accelerances")
    return FrequencyResponseSet(
        number=row.set_number,
        response=StoredDof(row.response_node, row.response_direction),
        inputs=tuple(StoredDof(response.input_node, response.input_direction) for response in responses),
        frequency=decode_array(row.frequency, f"{name}: frequency"),
        accelerance=accelerance,
        coherence=stacked("coherence"),
        variance=stacked("variance"),
        averages=row.averages,
        peak_force=row.peak_force,
        temperature_c=row.temperature_c,
        window=row.window,
        sample_rate=row.sample_rate,
        block_seconds=row.block_seconds,
        estimator=row.estimator,
        source=row.source,
        excitation=cast("Excitation", row.excitation),
    )
