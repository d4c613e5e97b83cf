"""Tables of results."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Create the tables."""
    _recorded(
        "analyses",
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("method", sa.String(), nullable=False),
        sa.Column("settings", sa.JSON(), nullable=False),
        sa.Column("configuration_hash", sa.String(), nullable=False),
    )
    op.create_index("ix_analyses_kind_method", "analyses", ["kind", "method"])
    op.create_table(
        "analysis_parents",
        sa.Column(
            "analysis_id",
            sa.Integer(),
            sa.ForeignKey("analyses.id", name="fk_analysis_parents_analysis_id"),
            primary_key=True,
        ),
        sa.Column(
            "parent_id",
            sa.Integer(),
            sa.ForeignKey("analyses.id", name="fk_analysis_parents_parent_id"),
            primary_key=True,
        ),
    )
    op.create_index("ix_analysis_parents_parent_id", "analysis_parents", ["parent_id"])
    op.create_table(
        "analysis_runs",
        sa.Column(
            "analysis_id",
            sa.Integer(),
            sa.ForeignKey("analyses.id", name="fk_analysis_runs_analysis_id"),
            primary_key=True,
        ),
        sa.Column("run_id", sa.Integer(), sa.ForeignKey("runs.id", name="fk_analysis_runs_run_id"), primary_key=True),
    )
    op.create_index("ix_analysis_runs_run_id", "analysis_runs", ["run_id"])
    _recorded(
        "comparisons",
        sa.Column(
            "analysis_id", sa.Integer(), sa.ForeignKey("analyses.id", name="fk_comparisons_analysis_id"), nullable=False
        ),
        sa.Column("article", sa.String(), nullable=False),
        sa.Column("joint", sa.String(), nullable=False),
        sa.Column("element", sa.String(), nullable=False),
        sa.Column("frequency", sa.Double()),
        sa.Column("amplitude_pp_mm", sa.Double()),
        sa.Column("inverse_low", sa.Double()),
        sa.Column("inverse_high", sa.Double()),
        sa.Column("direct_low", sa.Double(), nullable=False),
        sa.Column("direct_high", sa.Double(), nullable=False),
        sa.Column("verdict", sa.String(), nullable=False),
        sa.Column("reason", sa.String()),
    )
    op.create_index("ix_comparisons_analysis_id", "comparisons", ["analysis_id"])
    _recorded(
        "frequency_response_sets",
        sa.Column(
            "analysis_id",
            sa.Integer(),
            sa.ForeignKey("analyses.id", name="fk_frequency_response_sets_analysis_id"),
            nullable=False,
        ),
        sa.Column(
            "run_id", sa.Integer(), sa.ForeignKey("runs.id", name="fk_frequency_response_sets_run_id"), nullable=False
        ),
        sa.Column("set_number", sa.Integer(), nullable=False),
        sa.Column("response_node", sa.Integer(), nullable=False),
        sa.Column("response_direction", sa.String(), nullable=False),
        sa.Column("frequency", sa.LargeBinary(), nullable=False),
        sa.Column("lines", sa.Integer(), nullable=False),
        sa.Column("highest_frequency", sa.Double(), nullable=False),
        sa.Column("averages", sa.Integer(), nullable=False),
        sa.Column("peak_force", sa.Double(), nullable=False),
        sa.Column("temperature_c", sa.Double(), nullable=False),
        sa.Column("window", sa.String(), nullable=False),
        sa.Column("sample_rate", sa.Double(), nullable=False),
        sa.Column("block_seconds", sa.Double(), nullable=False),
        sa.Column("estimator", sa.String(), nullable=False),
        sa.Column("source", sa.String()),
        sa.UniqueConstraint(
            "analysis_id", "run_id", "set_number", name="uq_frequency_response_sets_analysis_id_run_id_set_number"
        ),
    )
    op.create_index("ix_frequency_response_sets_run_id", "frequency_response_sets", ["run_id"])
    _recorded(
        "joint_matrices",
        sa.Column(
            "analysis_id",
            sa.Integer(),
            sa.ForeignKey("analyses.id", name="fk_joint_matrices_analysis_id"),
            nullable=False,
        ),
        sa.Column(
            "specimen_id",
            sa.Integer(),
            sa.ForeignKey("specimens.id", name="fk_joint_matrices_specimen_id"),
            nullable=False,
        ),
        sa.Column("joint", sa.String(), nullable=False),
        sa.Column("node", sa.Integer(), nullable=False),
        sa.Column("covariance", sa.LargeBinary()),
        sa.UniqueConstraint("analysis_id", "joint", name="uq_joint_matrices_analysis_id_joint"),
    )
    op.create_index("ix_joint_matrices_specimen_id", "joint_matrices", ["specimen_id"])
    _recorded(
        "mode_sets",
        sa.Column(
            "analysis_id", sa.Integer(), sa.ForeignKey("analyses.id", name="fk_mode_sets_analysis_id"), nullable=False
        ),
        sa.Column("dofs", sa.JSON(), nullable=False),
        sa.Column("pole_covariance", sa.LargeBinary()),
        sa.UniqueConstraint("analysis_id", name="uq_mode_sets_analysis_id"),
    )
    _recorded(
        "dynamic_stiffness",
        sa.Column(
            "analysis_id",
            sa.Integer(),
            sa.ForeignKey("analyses.id", name="fk_dynamic_stiffness_analysis_id"),
            nullable=False,
        ),
        sa.Column(
            "specimen_id",
            sa.Integer(),
            sa.ForeignKey("specimens.id", name="fk_dynamic_stiffness_specimen_id"),
            nullable=False,
        ),
        sa.Column(
            "sine_record_id", sa.Integer(), sa.ForeignKey("sine_records.id", name="fk_dynamic_stiffness_sine_record_id")
        ),
        sa.Column("order_number", sa.Integer(), nullable=False),
        sa.Column("elapsed", sa.Double(), nullable=False),
        sa.Column("configuration", sa.String(), nullable=False),
        sa.Column("amplitude_pp_mm", sa.Double(), nullable=False),
        sa.Column("frequency", sa.Double(), nullable=False),
        sa.Column("stiffness", sa.Double(), nullable=False),
        sa.Column("stiffness_se", sa.Double()),
        sa.Column("damping", sa.Double(), nullable=False),
        sa.Column("damping_se", sa.Double()),
        sa.Column("loss_factor", sa.Double(), nullable=False),
        sa.Column("loss_factor_se", sa.Double()),
        sa.Column("magnitude", sa.Double(), nullable=False),
        sa.Column("magnitude_se", sa.Double()),
        sa.Column("loss_angle_deg", sa.Double(), nullable=False),
        sa.Column("loss_angle_se_deg", sa.Double()),
        sa.Column("sd_rel", sa.Double()),
        sa.Column("thd_percent", sa.Double()),
        sa.Column("thd_displacement_percent", sa.Double()),
        sa.Column("temperature_c", sa.Double()),
        sa.Column("flags", sa.JSON(), nullable=False),
        sa.UniqueConstraint("analysis_id", "order_number", name="uq_dynamic_stiffness_analysis_id_order_number"),
    )
    op.create_index(
        "ix_dynamic_stiffness_series",
        "dynamic_stiffness",
        ["specimen_id", "configuration", "amplitude_pp_mm", "frequency"],
    )
    op.create_index("ix_dynamic_stiffness_sine_record_id", "dynamic_stiffness", ["sine_record_id"])
    _recorded(
        "frequency_responses",
        sa.Column(
            "set_id",
            sa.Integer(),
            sa.ForeignKey("frequency_response_sets.id", name="fk_frequency_responses_set_id"),
            nullable=False,
        ),
        sa.Column("row_number", sa.Integer(), nullable=False),
        sa.Column("input_node", sa.Integer(), nullable=False),
        sa.Column("input_direction", sa.String(), nullable=False),
        sa.Column("accelerance", sa.LargeBinary(), nullable=False),
        sa.Column("coherence", sa.LargeBinary()),
        sa.Column("variance", sa.LargeBinary()),
        sa.UniqueConstraint(
            "set_id", "input_node", "input_direction", name="uq_frequency_responses_set_id_input_node_input_direction"
        ),
        sa.UniqueConstraint("set_id", "row_number", name="uq_frequency_responses_set_id_row_number"),
    )
    _recorded(
        "joint_elements",
        sa.Column(
            "joint_matrix_id",
            sa.Integer(),
            sa.ForeignKey("joint_matrices.id", name="fk_joint_elements_joint_matrix_id"),
            nullable=False,
        ),
        sa.Column("matrix_row", sa.Integer(), nullable=False),
        sa.Column("matrix_column", sa.Integer(), nullable=False),
        sa.Column("stiffness", sa.Double(), nullable=False),
        sa.Column("stiffness_low", sa.Double()),
        sa.Column("stiffness_high", sa.Double()),
        sa.Column("damping", sa.Double(), nullable=False),
        sa.Column("damping_low", sa.Double()),
        sa.Column("damping_high", sa.Double()),
        sa.Column("loss_factor", sa.Double()),
        sa.Column("loss_factor_low", sa.Double()),
        sa.Column("loss_factor_high", sa.Double()),
        sa.Column("observable", sa.Boolean(), nullable=False),
        sa.UniqueConstraint(
            "joint_matrix_id",
            "matrix_row",
            "matrix_column",
            name="uq_joint_elements_joint_matrix_id_matrix_row_matrix_column",
        ),
    )
    _recorded(
        "modes",
        sa.Column(
            "mode_set_id", sa.Integer(), sa.ForeignKey("mode_sets.id", name="fk_modes_mode_set_id"), nullable=False
        ),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("frequency", sa.Double(), nullable=False),
        sa.Column("frequency_low", sa.Double()),
        sa.Column("frequency_high", sa.Double()),
        sa.Column("loss_factor", sa.Double(), nullable=False),
        sa.Column("loss_factor_low", sa.Double()),
        sa.Column("loss_factor_high", sa.Double()),
        sa.Column("predicted_frequency", sa.Double()),
        sa.Column("shape", sa.LargeBinary(), nullable=False),
        sa.Column("shape_covariance", sa.LargeBinary()),
        sa.UniqueConstraint("mode_set_id", "number", name="uq_modes_mode_set_id_number"),
    )


def downgrade() -> None:
    """Drop the tables, with all that is in them."""
    for table in (
        "modes",
        "joint_elements",
        "frequency_responses",
        "dynamic_stiffness",
        "mode_sets",
        "joint_matrices",
        "frequency_response_sets",
        "comparisons",
        "analysis_runs",
        "analysis_parents",
        "analyses",
    ):
        op.drop_table(table)


def _recorded(table: str, *columns: sa.schema.SchemaItem) -> None:
    op.create_table(
        table,
        sa.Column("id", sa.Integer(), nullable=False),
        *columns,
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("software_version", sa.String(), nullable=False),
        sa.PrimaryKeyConstraint("id", name=f"pk_{table}"),
    )
