"""Accelerances of a set, by a roving hammer or a shaker, measured or imported, with coherence and variance."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from store.database.columns import decode_array, encode_array
from store.dof import StoredDof
from store.errors import NotFoundError, StoreError
from store.measurements.runs import get_run
from store.models.results import FrequencyResponseRow, FrequencyResponseSetRow
from store.models.rows import add_row, from_row, to_columns
from store.states import HAMMER, Excitation

Real = NDArray[np.float64]
ARRAYS = ("accelerance", "coherence", "variance")


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
        averages: blows averaged at the point that has fewest.
        peak_force: typical peak of the blows, or amplitude of the sine, N.
        window: of the records, as `blow_window` reads it; none for plain ones.
        sample_rate: Hz; block_seconds: length of a record, s.
        estimator: H1, ... or that an imported file does not state it.
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
        for name in ARRAYS:
            array = getattr(self, name)
            if array is not None and array.shape != shape:
                raise StoreError(f"set {self.number}: {name} has shape {array.shape}, expected (rows, lines) = {shape}")


def add_frequency_responses(session: Session, analysis_id: int, run_id: int, measured: FrequencyResponseSet) -> None:
    """Store a set of `run_id` that `analysis_id` computed or imported.

    Raises NotFoundError if there is no such run, StoreError if an array holds values that are not finite.
    """
    get_run(session, run_id)
    name = f"run {run_id}, set {measured.number}"
    columns = to_columns(measured, FrequencyResponseSetRow) | {
        "frequency": encode_array(measured.frequency, f"{name}: frequency"),
        "set_number": measured.number,
        "response_node": measured.response.node,
        "response_direction": measured.response.direction,
        "lines": int(measured.frequency.size),
        "highest_frequency": float(measured.frequency[-1]),
    }
    row = add_row(session, FrequencyResponseSetRow(analysis_id=analysis_id, run_id=run_id, **columns))
    for index, dof in enumerate(measured.inputs):
        arrays = {
            what: encode_array(array[index], f"{name}: {what} of {dof}")
            for what in ARRAYS
            if (array := getattr(measured, what)) is not None
        }
        response = FrequencyResponseRow(
            set_id=row.id, row_number=index + 1, input_node=dof.node, input_direction=dof.direction, **arrays
        )
        session.add(response)
    session.flush()


def list_frequency_responses(
    session: Session, run_id: int, analysis_id: int | None = None
) -> list[FrequencyResponseSet]:
    """The sets of a run from one analysis, by default from the newest, in the order of their numbers.

    Raises NotFoundError if the run has no frequency responses from that analysis, DamagedError if a stored array is
    damaged.
    """
    if analysis_id is None:
        newest = select(func.max(FrequencyResponseSetRow.analysis_id)).filter_by(run_id=run_id)
        analysis_id = session.scalar(newest)
    query = select(FrequencyResponseSetRow).filter_by(run_id=run_id, analysis_id=analysis_id)
    found = [_set(session, row) for row in session.scalars(query.order_by(FrequencyResponseSetRow.set_number))]
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

    return from_row(
        FrequencyResponseSet,
        row,
        number=row.set_number,
        response=StoredDof(row.response_node, row.response_direction),
        inputs=tuple(StoredDof(response.input_node, response.input_direction) for response in responses),
        frequency=decode_array(row.frequency, f"{name}: frequency"),
        **{what: stacked(what) for what in ARRAYS},
    )
