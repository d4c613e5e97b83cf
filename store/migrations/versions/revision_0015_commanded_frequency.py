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
LAST = "AS loop_energy_excess_high"
TEMPERATURE = """    joint_elements.observable,
    (SELECT sets.temperature_c FROM frequency_response_sets AS sets
        WHERE sets.run_id = done.run_id AND sets.analysis_id <= done.analysis_id
        ORDER BY sets.analysis_id DESC, sets.set_number LIMIT 1) AS temperature_c
FROM"""
RUN = """SELECT (SELECT min(used.run_id) FROM analysis_runs AS used WHERE used.analysis_id = analyses.id) AS run_id,
    analyses.id AS analysis_id"""
NEW = {
    "v_dynamic_stiffness": OLD["v_dynamic_stiffness"].replace(
        "AS loop_energy_excess_high\n", f"AS loop_energy_excess_high,\n    points.{COLUMN}\n"
    ),
    "v_joint_stiffness": OLD["v_joint_stiffness"].replace("    joint_elements.observable\nFROM", TEMPERATURE),
    "v_comparison": OLD["v_comparison"].replace("SELECT analyses.id AS analysis_id", RUN),
}


def upgrade() -> None:
    """Take the commanded frequency from the record that a point was computed from; imported points have one only."""
    _drop()
    op.add_column(TABLE, sa.Column(COLUMN, sa.Double()))
    op.execute(
        f"UPDATE {TABLE} SET {COLUMN} = frequency, frequency = (SELECT sine_records.frequency FROM sine_records "
        f"WHERE sine_records.id = {TABLE}.sine_record_id) WHERE sine_record_id IS NOT NULL"
    )
    for statement in NEW.values():
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
