"""Views for people with a database client, and the rule that raw rows are never changed or deleted.

The text is the same on SQLite and PostgreSQL. `docs/queries.md` documents the views.
"""

from alembic import op

from store.migrations.columns import may_change, never_change

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

RAW_TABLES = ("points", "blows", "sine_records", "channels", "calibrations")

V_RUNS = """
CREATE VIEW v_runs AS
SELECT runs.id AS run_id, runs.kind, runs.state, runs.title, runs.article, runs.started_at, runs.finished_at,
    runs.reason,
    (SELECT count(*) FROM blows JOIN points ON points.id = blows.point_id
        WHERE points.run_id = runs.id AND blows.accepted) AS blows_accepted,
    (SELECT count(*) FROM blows JOIN points ON points.id = blows.point_id
        WHERE points.run_id = runs.id AND NOT blows.accepted) AS blows_refused,
    (SELECT count(*) FROM sine_records WHERE sine_records.run_id = runs.id) AS sine_records,
    runs.software_version, runs.configuration_hash, runs.waveform_file
FROM runs
"""

V_BLOWS = """
CREATE VIEW v_blows AS
SELECT points.run_id, blows.id AS blow_id, points.set_number, CAST(points.node AS VARCHAR(10)) || points.direction
        AS point,
    points.node, points.direction, blows.number, blows.accepted, blows.reason, blows.peak_force,
    blows.temperature_c, blows.struck_at, runs.article, runs.title, runs.waveform_file, blows.waveform_record,
    blows.source
FROM blows
JOIN points ON points.id = blows.point_id
JOIN runs ON runs.id = points.run_id
"""

V_ANALYSES = """
CREATE VIEW v_analyses AS
SELECT analyses.id AS analysis_id, analysis_runs.run_id, analyses.kind, analyses.method,
    NOT EXISTS (
        SELECT 1 FROM analyses AS newer JOIN analysis_runs AS newer_runs ON newer_runs.analysis_id = newer.id
        WHERE newer_runs.run_id = analysis_runs.run_id AND newer.kind = analyses.kind
            AND newer.method = analyses.method AND newer.id > analyses.id
    ) AS latest,
    runs.article, runs.title, runs.started_at AS measured_at, analyses.created_at AS analysed_at,
    analyses.software_version, analyses.configuration_hash
FROM analyses
JOIN analysis_runs ON analysis_runs.analysis_id = analyses.id
JOIN runs ON runs.id = analysis_runs.run_id
"""

V_MODES = """
CREATE VIEW v_modes AS
SELECT done.run_id, done.analysis_id, done.method, done.latest, done.article, done.measured_at, modes.number,
    modes.frequency, modes.frequency_low, modes.frequency_high,
    modes.loss_factor, modes.loss_factor_low, modes.loss_factor_high, modes.predicted_frequency
FROM modes
JOIN mode_sets ON mode_sets.id = modes.mode_set_id
JOIN v_analyses AS done ON done.analysis_id = mode_sets.analysis_id
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
    joint_elements.observable
FROM joint_elements
JOIN joint_matrices ON joint_matrices.id = joint_elements.joint_matrix_id
JOIN v_analyses AS done ON done.analysis_id = joint_matrices.analysis_id
"""

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
    points.temperature_c, points.order_number, points.elapsed, points.flags, points.sine_record_id
FROM dynamic_stiffness AS points
JOIN specimens ON specimens.id = points.specimen_id
JOIN v_analyses AS done ON done.analysis_id = points.analysis_id
"""

V_COMPARISON = """
CREATE VIEW v_comparison AS
SELECT analyses.id AS analysis_id, analyses.method,
    NOT EXISTS (
        SELECT 1 FROM analysis_runs AS mine
        JOIN analysis_runs AS others ON others.run_id = mine.run_id
        JOIN analyses AS newer ON newer.id = others.analysis_id
        WHERE mine.analysis_id = analyses.id AND newer.id > analyses.id
            AND newer.kind = analyses.kind AND newer.method = analyses.method
    ) AS latest,
    comparisons.article, comparisons.joint, comparisons.element, comparisons.frequency, comparisons.amplitude_pp_mm,
    comparisons.inverse_low, comparisons.inverse_high, comparisons.direct_low, comparisons.direct_high,
    comparisons.verdict, comparisons.reason, analyses.created_at AS analysed_at, analyses.software_version
FROM comparisons
JOIN analyses ON analyses.id = comparisons.analysis_id
"""

# In the order of creation: later views stand on earlier ones.
VIEWS = {
    "v_runs": V_RUNS,
    "v_blows": V_BLOWS,
    "v_analyses": V_ANALYSES,
    "v_modes": V_MODES,
    "v_joint_stiffness": V_JOINT_STIFFNESS,
    "v_dynamic_stiffness": V_DYNAMIC_STIFFNESS,
    "v_comparison": V_COMPARISON,
}


def upgrade() -> None:
    """Create the views and the triggers."""
    for statement in VIEWS.values():
        op.execute(statement)
    if op.get_bind().dialect.name == "postgresql":
        op.execute(
            "CREATE FUNCTION raw_data_are_final() RETURNS trigger LANGUAGE plpgsql AS "
            "$$ BEGIN RAISE EXCEPTION 'raw data are never changed or deleted'; END $$"
        )
    for table in RAW_TABLES:
        never_change(table)


def downgrade() -> None:
    """Drop the triggers and the views."""
    for table in RAW_TABLES:
        may_change(table)
    if op.get_bind().dialect.name == "postgresql":
        op.execute("DROP FUNCTION raw_data_are_final()")
    for view in reversed(VIEWS):
        op.execute(f"DROP VIEW {view}")
