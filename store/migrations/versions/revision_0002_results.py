"""Tables of results."""

import sqlalchemy as sa
from alembic import op

from store.migrations.columns import drop, key, optional, recorded, reference, required

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Create the tables."""
    recorded(
        "analyses",
        *required(sa.String, "kind", "method"),
        *required(sa.JSON, "settings"),
        *required(sa.String, "configuration_hash"),
    )
    op.create_index("ix_analyses_kind_method", "analyses", ["kind", "method"])
    op.create_table("analysis_parents", key("analysis_id", "analyses"), key("parent_id", "analyses"))
    op.create_index("ix_analysis_parents_parent_id", "analysis_parents", ["parent_id"])
    op.create_table("analysis_runs", key("analysis_id", "analyses"), key("run_id", "runs"))
    op.create_index("ix_analysis_runs_run_id", "analysis_runs", ["run_id"])
    recorded(
        "comparisons",
        reference("analysis_id", "analyses"),
        *required(sa.String, "article", "joint", "element"),
        *optional(sa.Double, "frequency", "amplitude_pp_mm", "inverse_low", "inverse_high"),
        *required(sa.Double, "direct_low", "direct_high"),
        *required(sa.String, "verdict"),
        *optional(sa.String, "reason"),
    )
    op.create_index("ix_comparisons_analysis_id", "comparisons", ["analysis_id"])
    recorded(
        "frequency_response_sets",
        reference("analysis_id", "analyses"),
        reference("run_id", "runs"),
        *required(sa.Integer, "set_number", "response_node"),
        *required(sa.String, "response_direction"),
        *required(sa.LargeBinary, "frequency"),
        *required(sa.Integer, "lines"),
        *required(sa.Double, "highest_frequency"),
        *required(sa.Integer, "averages"),
        *required(sa.Double, "peak_force", "temperature_c"),
        *required(sa.String, "window"),
        *required(sa.Double, "sample_rate", "block_seconds"),
        *required(sa.String, "estimator"),
        *optional(sa.String, "source"),
        sa.UniqueConstraint("analysis_id", "run_id", "set_number"),
    )
    op.create_index("ix_frequency_response_sets_run_id", "frequency_response_sets", ["run_id"])
    recorded(
        "joint_matrices",
        reference("analysis_id", "analyses"),
        reference("specimen_id", "specimens"),
        *required(sa.String, "joint"),
        *required(sa.Integer, "node"),
        *optional(sa.LargeBinary, "covariance"),
        sa.UniqueConstraint("analysis_id", "joint"),
    )
    op.create_index("ix_joint_matrices_specimen_id", "joint_matrices", ["specimen_id"])
    recorded(
        "mode_sets",
        reference("analysis_id", "analyses"),
        *required(sa.JSON, "dofs"),
        *optional(sa.LargeBinary, "pole_covariance"),
        sa.UniqueConstraint("analysis_id"),
    )
    recorded(
        "dynamic_stiffness",
        reference("analysis_id", "analyses"),
        reference("specimen_id", "specimens"),
        reference("sine_record_id", "sine_records", nullable=True),
        *required(sa.Integer, "order_number"),
        *required(sa.Double, "elapsed"),
        *required(sa.String, "configuration"),
        *required(sa.Double, "amplitude_pp_mm", "frequency", "stiffness"),
        *optional(sa.Double, "stiffness_se"),
        *required(sa.Double, "damping"),
        *optional(sa.Double, "damping_se"),
        *required(sa.Double, "loss_factor"),
        *optional(sa.Double, "loss_factor_se"),
        *required(sa.Double, "magnitude"),
        *optional(sa.Double, "magnitude_se"),
        *required(sa.Double, "loss_angle_deg"),
        *optional(sa.Double, "loss_angle_se_deg", "sd_rel", "thd_percent", "thd_displacement_percent", "temperature_c"),
        *required(sa.JSON, "flags"),
        sa.UniqueConstraint("analysis_id", "order_number"),
    )
    op.create_index(
        "ix_dynamic_stiffness_series",
        "dynamic_stiffness",
        ["specimen_id", "configuration", "amplitude_pp_mm", "frequency"],
    )
    op.create_index("ix_dynamic_stiffness_sine_record_id", "dynamic_stiffness", ["sine_record_id"])
    recorded(
        "frequency_responses",
        reference("set_id", "frequency_response_sets"),
        *required(sa.Integer, "row_number", "input_node"),
        *required(sa.String, "input_direction"),
        *required(sa.LargeBinary, "accelerance"),
        *optional(sa.LargeBinary, "coherence", "variance"),
        sa.UniqueConstraint("set_id", "input_node", "input_direction"),
        sa.UniqueConstraint("set_id", "row_number"),
    )
    recorded(
        "joint_elements",
        reference("joint_matrix_id", "joint_matrices"),
        *required(sa.Integer, "matrix_row", "matrix_column"),
        *required(sa.Double, "stiffness"),
        *optional(sa.Double, "stiffness_low", "stiffness_high"),
        *required(sa.Double, "damping"),
        *optional(sa.Double, "damping_low", "damping_high", "loss_factor", "loss_factor_low", "loss_factor_high"),
        *required(sa.Boolean, "observable"),
        sa.UniqueConstraint("joint_matrix_id", "matrix_row", "matrix_column"),
    )
    recorded(
        "modes",
        reference("mode_set_id", "mode_sets"),
        *required(sa.Integer, "number"),
        *required(sa.Double, "frequency"),
        *optional(sa.Double, "frequency_low", "frequency_high"),
        *required(sa.Double, "loss_factor"),
        *optional(sa.Double, "loss_factor_low", "loss_factor_high", "predicted_frequency"),
        *required(sa.LargeBinary, "shape"),
        *optional(sa.LargeBinary, "shape_covariance"),
        sa.UniqueConstraint("mode_set_id", "number"),
    )


def downgrade() -> None:
    """Drop the tables, with all that is in them."""
    drop(
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
    )
