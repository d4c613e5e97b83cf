"""Identified joint matrices k and h with their intervals and covariance."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import Session

from store.database.columns import decode_optional, encode_covariance, finite, or_nan, or_null, with_shape
from store.measurements.specimens import specimen_id
from store.models.results import JointElementRow, JointMatrixRow
from store.models.rows import add_row
from store.results.analyses import article_of, without_result
from store.states import AnalysisKind

Real = NDArray[np.float64]
NOT_OBSERVABLE = "not_observable"
"""Key of an analysis' settings: by joint and term, such as k11, why the term is not observable."""


@dataclass(frozen=True, eq=False)
class JointMatrix:
    """One joint at its node; rows and columns are x, y, rotation; N/m, N and N m; NaN for unknown values.

    Attributes:
        stiffness, damping: (3, 3) k and h.
        stiffness_ci95, damping_ci95, loss_factor_ci95: (3, 3, 2) low and high.
        loss_factor: (3, 3), NaN where k is not distinguishable from zero.
        observable: (3, 3) False where only a prior or a sum determines the term.
        covariance: (12, 12) of [k11, k12, k13, k22, k23, k33, h11, ...], or None.
    """

    joint: str
    node: int
    stiffness: Real
    damping: Real
    stiffness_ci95: Real
    damping_ci95: Real
    loss_factor: Real
    loss_factor_ci95: Real
    observable: NDArray[np.bool_]
    covariance: Real | None = None


def add_joint_matrix(session: Session, analysis_id: int, matrix: JointMatrix) -> None:
    """Store a joint's matrices; StoreError if an array has another shape, or k or h are not finite."""
    where = f"analysis {analysis_id}: joint {matrix.joint}"
    for name in ("stiffness", "damping", "loss_factor", "observable"):
        with_shape(getattr(matrix, name), (3, 3), f"{where}: {name}")
    for name in ("stiffness_ci95", "damping_ci95", "loss_factor_ci95"):
        with_shape(getattr(matrix, name), (3, 3, 2), f"{where}: {name}")
    row = JointMatrixRow(
        analysis_id=analysis_id,
        specimen_id=specimen_id(session, article_of(session, analysis_id), matrix.joint),
        joint=matrix.joint,
        node=matrix.node,
        covariance=encode_covariance(matrix.covariance, f"{where}: covariance"),
        elements=[_element(matrix, row, column, where) for row in range(3) for column in range(3)],
    )
    add_row(session, row)


def list_joint_matrices(session: Session, analysis_id: int) -> list[JointMatrix]:
    """The joints of an analysis, by name, or NotFoundError (LeftOutError); DamagedError for a damaged array."""
    query = select(JointMatrixRow).filter_by(analysis_id=analysis_id).order_by(JointMatrixRow.joint)
    rows = session.scalars(query).all()
    if not rows:
        raise without_result(session, analysis_id, AnalysisKind.JOINT_MATRICES)
    return [_matrix(row) for row in rows]


def _element(matrix: JointMatrix, row: int, column: int, where: str) -> JointElementRow:
    at, name = (row, column), f"{row + 1}{column + 1}"
    values = {
        "stiffness": finite(matrix.stiffness[at], f"{where}: k{name}"),
        "damping": finite(matrix.damping[at], f"{where}: h{name}"),
        "loss_factor": or_null(matrix.loss_factor[at]),
    }
    for what in tuple(values):
        low, high = getattr(matrix, f"{what}_ci95")[at]
        values |= {f"{what}_low": or_null(low), f"{what}_high": or_null(high)}
    observable = bool(matrix.observable[at])
    return JointElementRow(matrix_row=row + 1, matrix_column=column + 1, observable=observable, **values)


def _matrix(row: JointMatrixRow) -> JointMatrix:
    def grid(column: str) -> Real:
        return np.array([or_nan(getattr(element, column)) for element in row.elements]).reshape(3, 3)

    def interval(column: str) -> Real:
        return np.stack([grid(f"{column}_low"), grid(f"{column}_high")], axis=-1)

    where = f"analysis {row.analysis_id}: joint {row.joint}: covariance"
    return JointMatrix(
        joint=row.joint,
        node=row.node,
        stiffness=grid("stiffness"),
        damping=grid("damping"),
        stiffness_ci95=interval("stiffness"),
        damping_ci95=interval("damping"),
        loss_factor=grid("loss_factor"),
        loss_factor_ci95=interval("loss_factor"),
        observable=np.array([element.observable for element in row.elements]).reshape(3, 3),
        covariance=decode_optional(row.covariance, where),
    )
