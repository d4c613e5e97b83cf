"""The frequency of a sine point is the commanded one, as its amplitude is; the one of the record stands beside it.

Views of stiffness tell the temperature, and that of comparisons the run.
"""

import sqlalchemy as sa
from alembic import op

from store.migrations.versions import revision_0005_scale as scale
from store.migrations.versions import revision_0008_stiffness_points as points

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None

TABLE, COLUMN = "dynamic_stiffness", "reached_frequency"
OLD = {
    "v_dynamic_stiffness": points.V_DYNAMIC_STIFFNESS,
    "v_joint_stiffness": scale.V_JOINT_STIFFNESS,
    "v_comparison": scale.V_COMPARISON,
}
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
    points.loop_energy_excess + 1.96 * points.loop_energy_excess_se AS loop_energy_excess_high,
    points.reached_frequency
FROM v_analyses AS done CROSS JOIN dynamic_stiffness AS points CROSS JOIN specimens
WHERE points.analysis_id = done.analysis_id AND specimens.id = points.specimen_id
"""
V_JOINT_STIFFNESS = """
CREATE VIEW v_joint_stiffness AS
SELECT done.run_id, done.analysis_id, done.method, done.latest, done.article, done.measured_at,
    joint_matrices.joint, joint_matrices.node,
    'k' || CAST(joint_elements.matrix_row AS VARCHAR(1)) || CAST(joint_elements.matrix_column AS VARCHAR(1))
        AS element,
    joint_elements.matrix_row, joint_elements.matrix_column,
    joint_elements.stiffness, joint_elements.stiffness_low, joint_elements.stiffness_high,
    joint_elements.damping, joint_elements.damping_low, joint_elements.damping_high,
    joint_elements.loss_factor, joint_elements.loss_factor_low, joint_elements.loss_factor_high,
    joint_elements.observable,
    (SELECT sets.temperature_c FROM frequency_response_sets AS sets
        WHERE sets.run_id = done.run_id AND sets.analysis_id <= done.analysis_id
        ORDER BY sets.analysis_id DESC, sets.set_number LIMIT 1) AS temperature_c
FROM v_analyses AS done CROSS JOIN joint_matrices CROSS JOIN joint_elements
WHERE joint_matrices.analysis_id = done.analysis_id AND joint_elements.joint_matrix_id = joint_matrices.id
"""
V_COMPARISON = """
CREATE VIEW v_comparison AS
SELECT (SELECT min(used.run_id) FROM analysis_runs AS used WHERE used.analysis_id = analyses.id) AS run_id,
    analyses.id AS analysis_id, analyses.method,
    NOT EXISTS (
        SELECT 1 FROM analysis_runs AS mine CROSS JOIN analysis_runs AS others CROSS JOIN analyses AS newer
        WHERE mine.analysis_id = analyses.id AND others.run_id = mine.run_id AND others.analysis_id > analyses.id
            AND newer.id = others.analysis_id AND newer.kind = analyses.kind AND newer.method = analyses.method
    ) AS latest,
    comparisons.article, comparisons.joint, comparisons.element, comparisons.frequency, comparisons.amplitude_pp_mm,
    comparisons.inverse_low, comparisons.inverse_high, comparisons.direct_low, comparisons.direct_high,
    comparisons.verdict, comparisons.reason, analyses.created_at AS analysed_at, analyses.software_version
FROM comparisons
JOIN analyses ON analyses.id = comparisons.analysis_id
"""


def upgrade() -> None:
    """Take the commanded frequency from the record that a point was computed from; imported points have one only."""
    _drop()
    op.add_column(TABLE, sa.Column(COLUMN, sa.Double()))
    op.execute(
        f"UPDATE {TABLE} SET {COLUMN} = frequency, frequency = (SELECT sine_records.frequency FROM sine_records "
        f"WHERE sine_records.id = {TABLE}.sine_record_id) WHERE sine_record_id IS NOT NULL"
    )
    for statement in (V_DYNAMIC_STIFFNESS, V_JOINT_STIFFNESS, V_COMPARISON):
        op.execute(statement)


def downgrade() -> None:
    """Put the frequency of the record where the commanded one was."""
    _drop()
    op.execute(f"UPDATE {TABLE} SET frequency = {COLUMN} WHERE {COLUMN} IS NOT NULL")
    op.drop_column(TABLE, COLUMN)
    for statement in OLD.values():
        op.execute(statement)


def _drop() -> None:
    for view in OLD:
        op.execute(f"DROP VIEW {view}")
