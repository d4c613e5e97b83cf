"""Tables of measurements, instruments and specimens."""

import sqlalchemy as sa
from alembic import op

from store.migrations.columns import drop, key, optional, recorded, reference, required

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Create the tables."""
    recorded(
        "instruments",
        *required(sa.String, "kind", "model", "serial"),
        *required(sa.JSON, "details"),
        sa.UniqueConstraint("kind", "model", "serial"),
    )
    recorded(
        "runs",
        *required(sa.String, "kind", "state", "title", "article"),
        *required(sa.DateTime(timezone=True), "started_at"),
        *optional(sa.DateTime(timezone=True), "finished_at"),
        *optional(sa.String, "reason"),
        *required(sa.JSON, "setup", "sequence"),
        *required(sa.String, "configuration_hash", "waveform_file"),
        sa.UniqueConstraint("waveform_file"),
    )
    op.create_index("ix_runs_kind_started_at", "runs", ["kind", "started_at"])
    op.create_index("ix_runs_state_started_at", "runs", ["state", "started_at"])
    recorded(
        "specimens",
        *required(sa.String, "article", "name"),
        *optional(sa.String, "description"),
        sa.UniqueConstraint("article", "name"),
    )
    recorded(
        "calibrations",
        reference("instrument_id", "instruments"),
        *optional(sa.Date, "calibrated_on"),
        *optional(sa.Double, "sensitivity"),
        *optional(sa.String, "sensitivity_unit"),
        sa.UniqueConstraint("instrument_id", "calibrated_on", "sensitivity"),
    )
    recorded(
        "points",
        reference("run_id", "runs"),
        *required(sa.Integer, "set_number", "node"),
        *required(sa.String, "direction"),
        sa.UniqueConstraint("run_id", "set_number", "node", "direction"),
    )
    recorded(
        "sine_records",
        reference("run_id", "runs"),
        reference("specimen_id", "specimens"),
        *required(sa.Integer, "order_number"),
        *required(sa.String, "configuration"),
        *required(sa.Double, "commanded_pp_mm"),
        *optional(sa.Double, "reached_pp_mm"),
        *required(sa.Double, "frequency", "elapsed"),
        *optional(sa.DateTime(timezone=True), "recorded_at"),
        *optional(sa.Double, "temperature_c"),
        *optional(sa.Integer, "waveform_record"),
        sa.UniqueConstraint("run_id", "order_number"),
    )
    op.create_index("ix_sine_records_specimen_id", "sine_records", ["specimen_id"])
    recorded(
        "blows",
        reference("point_id", "points"),
        *required(sa.Integer, "number"),
        *required(sa.Boolean, "accepted"),
        *optional(sa.String, "reason"),
        *optional(sa.Double, "peak_force", "temperature_c"),
        *optional(sa.DateTime(timezone=True), "struck_at"),
        *optional(sa.Integer, "waveform_record"),
        *optional(sa.String, "source"),
        sa.UniqueConstraint("point_id", "number"),
    )
    recorded(
        "channels",
        reference("run_id", "runs"),
        *required(sa.String, "name", "physical", "kind", "unit"),
        *required(sa.Double, "sensitivity", "minimum", "maximum"),
        *optional(sa.Double, "excitation_current"),
        reference("calibration_id", "calibrations"),
        sa.UniqueConstraint("run_id", "name"),
    )
    op.create_table("run_instruments", key("run_id", "runs"), key("calibration_id", "calibrations"))


def downgrade() -> None:
    """Drop the tables, with all that is in them."""
    drop(
        "run_instruments",
        "channels",
        "blows",
        "sine_records",
        "points",
        "calibrations",
        "specimens",
        "runs",
        "instruments",
    )
