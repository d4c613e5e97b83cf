"""Modes of an analysis: frequencies, loss factors and shapes with their intervals."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import Session

from store.database.columns import (
    decode_array,
    decode_optional,
    encode_array,
    encode_covariance,
    finite,
    or_nan,
    or_null,
    with_shape,
)
from store.dof import StoredDof
from store.errors import StoreError
from store.models.results import ModeRow, ModeSetRow
from store.models.rows import add_row
from store.results.analyses import without_result
from store.states import AnalysisKind

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class ModeSet:
    """The modes of one analysis, in the order of their frequencies; NaN stands for an unknown limit.

    Attributes:
        frequency: (modes,) Hz.
        loss_factor: (modes,).
        dofs: (dofs,) the columns of `shapes`.
        shapes: (modes, dofs) complex.
        frequency_ci95, loss_factor_ci95: (modes, 2) low and high, or None.
        predicted_frequency: (modes,) Hz, of the identified model, or None.
        pole_covariance: (2 modes, 2 modes) of [f_1, eta_1, f_2, ...], or None.
        shape_covariance: (modes, 2 dofs, 2 dofs) of [real, imaginary] of each shape, or None.
    """

    frequency: Real
    loss_factor: Real
    dofs: tuple[StoredDof, ...]
    shapes: Complex
    frequency_ci95: Real | None = None
    loss_factor_ci95: Real | None = None
    predicted_frequency: Real | None = None
    pole_covariance: Real | None = None
    shape_covariance: Real | None = None


def add_modes(session: Session, analysis_id: int, modes: ModeSet) -> None:
    """Store the modes of an analysis; StoreError if shapes of arrays differ, or a frequency or shape is not finite."""
    where, count = f"analysis {analysis_id}: modes", modes.frequency.size
    frequency_ci95 = with_shape(modes.frequency_ci95, (count, 2), f"{where}: frequency_ci95")
    loss_factor_ci95 = with_shape(modes.loss_factor_ci95, (count, 2), f"{where}: loss_factor_ci95")
    predicted = with_shape(modes.predicted_frequency, (count,), f"{where}: predicted_frequency")
    with_shape(modes.loss_factor, (count,), f"{where}: loss_factor")
    if modes.shapes.shape != (count, len(modes.dofs)):
        raise StoreError(f"{where}: shapes have shape {modes.shapes.shape}, expected {(count, len(modes.dofs))}")
    row = ModeSetRow(
        analysis_id=analysis_id,
        dofs=[str(dof) for dof in modes.dofs],
        pole_covariance=encode_covariance(modes.pole_covariance, f"{where}: pole_covariance"),
    )
    add_row(session, row)
    session.add_all(
        ModeRow(
            mode_set_id=row.id,
            number=index + 1,
            frequency=finite(modes.frequency[index], f"{where}: frequency {index + 1}"),
            frequency_low=or_null(frequency_ci95[index, 0]),
            frequency_high=or_null(frequency_ci95[index, 1]),
            loss_factor=finite(modes.loss_factor[index], f"{where}: loss factor {index + 1}"),
            loss_factor_low=or_null(loss_factor_ci95[index, 0]),
            loss_factor_high=or_null(loss_factor_ci95[index, 1]),
            predicted_frequency=or_null(predicted[index]),
            shape=encode_array(modes.shapes[index], f"{where}: shape {index + 1}"),
            shape_covariance=encode_covariance(
                None if modes.shape_covariance is None else modes.shape_covariance[index],
                f"{where}: shape_covariance {index + 1}",
            ),
        )
        for index in range(count)
    )
    session.flush()


def get_modes(session: Session, analysis_id: int) -> ModeSet:
    """The modes of an analysis, or NotFoundError (LeftOutError); DamagedError for a damaged array."""
    holder = session.scalars(select(ModeSetRow).filter_by(analysis_id=analysis_id)).one_or_none()
    if holder is None:
        raise without_result(session, analysis_id, AnalysisKind.MODES)
    where = f"analysis {analysis_id}: modes"
    rows = session.scalars(select(ModeRow).filter_by(mode_set_id=holder.id).order_by(ModeRow.number)).all()
    shapes = [decode_array(row.shape, f"{where}: shape {row.number}") for row in rows]
    covariances = [row.shape_covariance for row in rows]
    known = [column for column in covariances if column is not None]
    return ModeSet(
        frequency=np.array([row.frequency for row in rows]),
        loss_factor=np.array([row.loss_factor for row in rows]),
        dofs=tuple(StoredDof.parse(text) for text in holder.dofs),
        shapes=np.array(shapes).reshape(len(rows), len(holder.dofs)),
        frequency_ci95=np.array([[or_nan(row.frequency_low), or_nan(row.frequency_high)] for row in rows]),
        loss_factor_ci95=np.array([[or_nan(row.loss_factor_low), or_nan(row.loss_factor_high)] for row in rows]),
        predicted_frequency=np.array([or_nan(row.predicted_frequency) for row in rows]),
        pole_covariance=decode_optional(holder.pole_covariance, f"{where}: pole_covariance"),
        shape_covariance=(
            np.array([decode_array(column, f"{where}: shape_covariance") for column in known])
            if known and len(known) == len(rows)
            else None
        ),
    )
