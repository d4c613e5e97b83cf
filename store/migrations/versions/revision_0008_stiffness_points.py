"""What else is known of a sine point: reached amplitude, distortion, loop energy, and all of its errors.

Points that were computed before have none of it; identify the run again, and new ones stand beside them.
"""

import sqlalchemy as sa
from alembic import op

from store.migrations.versions import revision_0005_scale as before

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None

TABLE, VIEW = "dynamic_stiffness", "v_dynamic_stiffness"
NUMBERS = (
    "degrees_of_freedom",
    "stiffness_damping_covariance",
    "reached_pp_mm",
    "reached_pp_se_mm",
    "thd_se_percent",
    "thd_displacement_se_percent",
    "loop_energy",
    "loop_energy_se",
    "loop_energy_excess",
    "loop_energy_excess_se",
)
SHARED = "shared_errors"

V_DYNAMIC_STIFFNESS = """
CREATE VIEW v_dynamic_stiffness AS
SELECT done.run_id, done.analysis_id, done.method, done.latest, done.article, done.measured_at,
    specimens.name AS specimen, points.configuration, points.amplitude_pp_mm, points.frequency,
    points.stiffness, points.stiffness - 1.96 * points.stiffness_se AS stiffness_low,
    points.stiffness + 1.96 * points.stiffness_se AS stiffness_high,
    points.damping, points.damping - 1.96 * points.damping_se AS damping_low,
    points.damping + 1.96 * points.damping_se AS damping_high,
    points.loss_factor, points.loss_factor - 1.96 * points.loss_factor_se AS loss_factor_low,
    points.loss_factor + 1.96 * points.loss_factor_se AS loss_factor_high,
    points.magnitude, points.loss_angle_deg, points.thd_percent, points.thd_displacement_percent,
    points.temperature_c, points.order_number, points.elapsed, points.flags, points.sine_record_id,
    points.reached_pp_mm, points.reached_pp_se_mm, points.thd_se_percent, points.thd_displacement_se_percent,
    points.loop_energy, points.loop_energy - 1.96 * points.loop_energy_se AS loop_energy_low,
    points.loop_energy + 1.96 * points.loop_energy_se AS loop_energy_high,
    points.loop_energy_excess,
    points.loop_energy_excess - 1.96 * points.loop_energy_excess_se AS loop_energy_excess_low,
    points.loop_energy_excess + 1.96 * points.loop_energy_excess_se AS loop_energy_excess_high
FROM v_analyses AS done CROSS JOIN dynamic_stiffness AS points CROSS JOIN specimens
WHERE points.analysis_id = done.analysis_id AND specimens.id = points.specimen_id
"""


def upgrade() -> None:
    """Add the columns, and show them in the view."""
    op.execute(f"DROP VIEW {VIEW}")
    for name in NUMBERS:
        op.add_column(TABLE, sa.Column(name, sa.Double()))
    op.add_column(TABLE, sa.Column(SHARED, sa.JSON()))
    op.execute(V_DYNAMIC_STIFFNESS)


def downgrade() -> None:
    """Drop the columns with their values."""
    op.execute(f"DROP VIEW {VIEW}")
    for name in (SHARED, *reversed(NUMBERS)):
        op.drop_column(TABLE, name)
    op.execute(before.VIEWS[VIEW])
