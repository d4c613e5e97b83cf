"""Tables of measurements, instruments and specimens."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Create the tables."""
    _recorded(
        "instruments",
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("model", sa.String(), nullable=False),
        sa.Column("serial", sa.String(), nullable=False),
        sa.Column("details", sa.JSON(), nullable=False),
        sa.UniqueConstraint("kind", "model", "serial", name="uq_instruments_kind_model_serial"),
    )
    _recorded(
        "runs",
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("title", sa.String(), nullable=False),
        sa.Column("article", sa.String(), nullable=False),
        sa.Column("started_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("finished_at", sa.DateTime(timezone=True)),
        sa.Column("reason", sa.String()),
        sa.Column("setup", sa.JSON(), nullable=False),
        sa.Column("sequence", sa.JSON(), nullable=False),
        sa.Column("configuration_hash", sa.String(), nullable=False),
        sa.Column("waveform_file", sa.String(), nullable=False),
        sa.UniqueConstraint("waveform_file", name="uq_runs_waveform_file"),
    )
    op.create_index("ix_runs_kind_started_at", "runs", ["kind", "started_at"])
    op.create_index("ix_runs_state_started_at", "runs", ["state", "started_at"])
    _recorded(
        "specimens",
        sa.Column("article", sa.String(), nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("description", sa.String()),
        sa.UniqueConstraint("article", "name", name="uq_specimens_article_name"),
    )
    _recorded(
        "calibrations",
        sa.Column(
            "instrument_id",
            sa.Integer(),
            sa.ForeignKey("instruments.id", name="fk_calibrations_instrument_id"),
            nullable=False,
        ),
        sa.Column("calibrated_on", sa.Date()),
        sa.Column("sensitivity", sa.Double()),
        sa.Column("sensitivity_unit", sa.String()),
        sa.UniqueConstraint(
            "instrument_id",
            "calibrated_on",
            "sensitivity",
            name="uq_calibrations_instrument_id_calibrated_on_sensitivity",
        ),
    )
    _recorded(
        "points",
        sa.Column("run_id", sa.Integer(), sa.ForeignKey("runs.id", name="fk_points_run_id"), nullable=False),
        sa.Column("set_number", sa.Integer(), nullable=False),
        sa.Column("node", sa.Integer(), nullable=False),
        sa.Column("direction", sa.String(), nullable=False),
        sa.UniqueConstraint(
            "run_id", "set_number", "node", "direction", name="uq_points_run_id_set_number_node_direction"
        ),
    )
    _recorded(
        "sine_records",
        sa.Column("run_id", sa.Integer(), sa.ForeignKey("runs.id", name="fk_sine_records_run_id"), nullable=False),
        sa.Column(
            "specimen_id",
            sa.Integer(),
            sa.ForeignKey("specimens.id", name="fk_sine_records_specimen_id"),
            nullable=False,
        ),
        sa.Column("order_number", sa.Integer(), nullable=False),
        sa.Column("configuration", sa.String(), nullable=False),
        sa.Column("commanded_pp_mm", sa.Double(), nullable=False),
        sa.Column("reached_pp_mm", sa.Double()),
        sa.Column("frequency", sa.Double(), nullable=False),
        sa.Column("elapsed", sa.Double(), nullable=False),
        sa.Column("recorded_at", sa.DateTime(timezone=True)),
        sa.Column("temperature_c", sa.Double()),
        sa.Column("waveform_record", sa.Integer()),
        sa.UniqueConstraint("run_id", "order_number", name="uq_sine_records_run_id_order_number"),
    )
    op.create_index("ix_sine_records_specimen_id", "sine_records", ["specimen_id"])
    _recorded(
        "blows",
        sa.Column("point_id", sa.Integer(), sa.ForeignKey("points.id", name="fk_blows_point_id"), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("accepted", sa.Boolean(), nullable=False),
        sa.Column("reason", sa.String()),
        sa.Column("peak_force", sa.Double()),
        sa.Column("temperature_c", sa.Double()),
        sa.Column("struck_at", sa.DateTime(timezone=True)),
        sa.Column("waveform_record", sa.Integer()),
        sa.Column("source", sa.String()),
        sa.UniqueConstraint("point_id", "number", name="uq_blows_point_id_number"),
    )
    _recorded(
        "channels",
        sa.Column("run_id", sa.Integer(), sa.ForeignKey("runs.id", name="fk_channels_run_id"), nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("physical", sa.String(), nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("unit", sa.String(), nullable=False),
        sa.Column("sensitivity", sa.Double(), nullable=False),
        sa.Column("minimum", sa.Double(), nullable=False),
        sa.Column("maximum", sa.Double(), nullable=False),
        sa.Column("excitation_current", sa.Double()),
        sa.Column(
            "calibration_id",
            sa.Integer(),
            sa.ForeignKey("calibrations.id", name="fk_channels_calibration_id"),
            nullable=False,
        ),
        sa.UniqueConstraint("run_id", "name", name="uq_channels_run_id_name"),
    )
    op.create_table(
        "run_instruments",
        sa.Column("run_id", sa.Integer(), sa.ForeignKey("runs.id", name="fk_run_instruments_run_id"), primary_key=True),
        sa.Column(
            "calibration_id",
            sa.Integer(),
            sa.ForeignKey("calibrations.id", name="fk_run_instruments_calibration_id"),
            primary_key=True,
        ),
    )


def downgrade() -> None:
    """Drop the tables, with all that is in them."""
    for table in (
        "run_instruments",
        "channels",
        "blows",
        "sine_records",
        "points",
        "calibrations",
        "specimens",
        "runs",
        "instruments",
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
