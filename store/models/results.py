"""Tables of results: every row belongs to one analysis; a new computation is a new analysis."""

from __future__ import annotations

from typing import Any

from sqlalchemy import ForeignKey, Index, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from store.models.base import WIDE, Base, Recorded
from store.models.measurements import RunRow, SpecimenRow


class AnalysisRow(Recorded, Base):
    """One computation, with its method and settings."""

    __tablename__ = "analyses"
    __table_args__ = (Index(None, "kind", "method"),)

    kind: Mapped[str]
    method: Mapped[str]
    settings: Mapped[dict[str, Any]]
    configuration_hash: Mapped[str]


class AnalysisRunRow(Base):
    """The runs whose data an analysis used."""

    __tablename__ = "analysis_runs"
    __table_args__ = (Index(None, "run_id", "analysis_id"),)

    analysis_id: Mapped[int] = mapped_column(ForeignKey("analyses.id"), primary_key=True)
    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), primary_key=True)


class AnalysisParentRow(Base):
    """The earlier analyses whose results an analysis used."""

    __tablename__ = "analysis_parents"

    analysis_id: Mapped[int] = mapped_column(ForeignKey("analyses.id"), primary_key=True)
    parent_id: Mapped[int] = mapped_column(ForeignKey("analyses.id"), primary_key=True, index=True)


class FrequencyResponseSetRow(Recorded, Base):
    """The accelerances of one set, of hammer or sine, on one frequency axis, Hz (array column)."""

    __tablename__ = "frequency_response_sets"
    __table_args__ = (UniqueConstraint("analysis_id", "run_id", "set_number"), Index(None, "run_id"))

    analysis_id: Mapped[int] = mapped_column(ForeignKey("analyses.id"))
    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"))
    set_number: Mapped[int]
    response_node: Mapped[int]
    response_direction: Mapped[str]
    frequency: Mapped[bytes]
    lines: Mapped[int]
    highest_frequency: Mapped[float]
    averages: Mapped[int]
    peak_force: Mapped[float]
    temperature_c: Mapped[float]
    window: Mapped[str]
    sample_rate: Mapped[float]
    block_seconds: Mapped[float]
    estimator: Mapped[str]
    source: Mapped[str | None]
    excitation: Mapped[str] = mapped_column(server_default="hammer")
    run: Mapped[RunRow] = relationship()


class FrequencyResponseRow(Recorded, Base):
    """One accelerance, (m/s^2)/N, with coherence and variance where known (array columns)."""

    __tablename__ = "frequency_responses"
    __table_args__ = (
        UniqueConstraint("set_id", "row_number"),
        UniqueConstraint("set_id", "input_node", "input_direction"),
    )

    set_id: Mapped[int] = mapped_column(ForeignKey("frequency_response_sets.id"))
    row_number: Mapped[int]
    input_node: Mapped[int]
    input_direction: Mapped[str]
    accelerance: Mapped[bytes]
    coherence: Mapped[bytes | None]
    variance: Mapped[bytes | None]


class ModeSetRow(Recorded, Base):
    """The modes of one analysis: the degrees of freedom of their shapes and the covariance of their poles."""

    __tablename__ = "mode_sets"

    analysis_id: Mapped[int] = mapped_column(ForeignKey("analyses.id"), unique=True)
    dofs: Mapped[list[str]]
    pole_covariance: Mapped[bytes | None]


class ModeRow(Recorded, Base):
    """One mode: frequency in Hz, loss factor, 95 % intervals, complex shape (array column)."""

    __tablename__ = "modes"
    __table_args__ = (UniqueConstraint("mode_set_id", "number"),)

    mode_set_id: Mapped[int] = mapped_column(ForeignKey("mode_sets.id"))
    number: Mapped[int]
    frequency: Mapped[float]
    frequency_low: Mapped[float | None]
    frequency_high: Mapped[float | None]
    loss_factor: Mapped[float]
    loss_factor_low: Mapped[float | None]
    loss_factor_high: Mapped[float | None]
    predicted_frequency: Mapped[float | None]
    shape: Mapped[bytes]
    shape_covariance: Mapped[bytes | None]


class JointMatrixRow(Recorded, Base):
    """A joint's identified matrices; covariance of [k11,k12,k13,k22,k23,k33,h11,...] as an array column."""

    __tablename__ = "joint_matrices"
    __table_args__ = (UniqueConstraint("analysis_id", "joint"), Index(None, "specimen_id", "analysis_id"))

    analysis_id: Mapped[int] = mapped_column(ForeignKey("analyses.id"))
    specimen_id: Mapped[int] = mapped_column(ForeignKey("specimens.id"))
    joint: Mapped[str]
    node: Mapped[int]
    covariance: Mapped[bytes | None]
    specimen: Mapped[SpecimenRow] = relationship()
    elements: Mapped[list[JointElementRow]] = relationship(
        order_by="(JointElementRow.matrix_row, JointElementRow.matrix_column)", cascade="all"
    )


class JointElementRow(Recorded, Base):
    """One element of a joint's matrices, rows and columns 1..3 = x, y, rotation; N/m, N or N m."""

    __tablename__ = "joint_elements"
    __table_args__ = (UniqueConstraint("joint_matrix_id", "matrix_row", "matrix_column"),)

    joint_matrix_id: Mapped[int] = mapped_column(ForeignKey("joint_matrices.id"))
    matrix_row: Mapped[int]
    matrix_column: Mapped[int]
    stiffness: Mapped[float]
    stiffness_low: Mapped[float | None]
    stiffness_high: Mapped[float | None]
    damping: Mapped[float]
    damping_low: Mapped[float | None]
    damping_high: Mapped[float | None]
    loss_factor: Mapped[float | None]
    loss_factor_low: Mapped[float | None]
    loss_factor_high: Mapped[float | None]
    observable: Mapped[bool]


class DynamicStiffnessRow(Recorded, Base):
    """Dynamic stiffness of a specimen at one commanded sine: k, h in N/m, loss factor, energies in J a cycle, flags."""

    __tablename__ = "dynamic_stiffness"
    __table_args__ = (
        UniqueConstraint("analysis_id", "order_number"),
        Index("ix_dynamic_stiffness_series", "analysis_id", "configuration", "amplitude_pp_mm", "frequency"),
        Index(None, "specimen_id", "id"),
    )

    id: Mapped[int] = mapped_column(WIDE, primary_key=True, sort_order=-1)
    analysis_id: Mapped[int] = mapped_column(ForeignKey("analyses.id"))
    specimen_id: Mapped[int] = mapped_column(ForeignKey("specimens.id"))
    sine_record_id: Mapped[int | None] = mapped_column(WIDE, ForeignKey("sine_records.id"), index=True)
    order_number: Mapped[int]
    elapsed: Mapped[float]
    configuration: Mapped[str]
    amplitude_pp_mm: Mapped[float]
    frequency: Mapped[float]
    stiffness: Mapped[float]
    stiffness_se: Mapped[float | None]
    damping: Mapped[float]
    damping_se: Mapped[float | None]
    loss_factor: Mapped[float]
    loss_factor_se: Mapped[float | None]
    magnitude: Mapped[float]
    magnitude_se: Mapped[float | None]
    loss_angle_deg: Mapped[float]
    loss_angle_se_deg: Mapped[float | None]
    degrees_of_freedom: Mapped[float | None]
    stiffness_damping_covariance: Mapped[float | None]
    sd_rel: Mapped[float | None]
    reached_frequency: Mapped[float | None]
    reached_pp_mm: Mapped[float | None]
    reached_pp_se_mm: Mapped[float | None]
    thd_percent: Mapped[float | None]
    thd_se_percent: Mapped[float | None]
    thd_displacement_percent: Mapped[float | None]
    thd_displacement_se_percent: Mapped[float | None]
    loop_energy: Mapped[float | None]
    loop_energy_se: Mapped[float | None]
    loop_energy_excess: Mapped[float | None]
    loop_energy_excess_se: Mapped[float | None]
    temperature_c: Mapped[float | None]
    flags: Mapped[list[str]]
    shared_errors: Mapped[dict[str, Any] | None]
    specimen: Mapped[SpecimenRow] = relationship()


class ComparisonRow(Recorded, Base):
    """One joint element by both experiments: 95 % intervals and the verdict."""

    __tablename__ = "comparisons"
    __table_args__ = (Index(None, "analysis_id"), Index(None, "article", "id"))

    analysis_id: Mapped[int] = mapped_column(ForeignKey("analyses.id"))
    article: Mapped[str]
    joint: Mapped[str]
    element: Mapped[str]
    frequency: Mapped[float | None]
    amplitude_pp_mm: Mapped[float | None]
    inverse_low: Mapped[float | None]
    inverse_high: Mapped[float | None]
    direct_low: Mapped[float]
    direct_high: Mapped[float]
    verdict: Mapped[str]
    reason: Mapped[str | None]


class MasterCurveRow(Recorded, Base):
    """A master curve of a specimen: what it is of, the reduced frequencies that were measured, Hz, and all of it."""

    __tablename__ = "master_curves"

    analysis_id: Mapped[int] = mapped_column(ForeignKey("analyses.id"), unique=True)
    specimen_id: Mapped[int] = mapped_column(ForeignKey("specimens.id"), index=True)
    configuration: Mapped[str]
    amplitude_pp_mm: Mapped[float]
    shift: Mapped[str]
    reference_c: Mapped[float]
    lowest_reduced_frequency: Mapped[float]
    highest_reduced_frequency: Mapped[float]
    document: Mapped[dict[str, Any]]
