"""Indices and views for ten thousand runs and a million sine points.

Runs are listed in the order of storing, which a clock that is set back does not change. Views begin at the analyses:
SQLite keeps the order of a CROSS JOIN, and without statistics it would choose to read every point, or every analysis
of a kind for each row; PostgreSQL chooses for itself.
"""

from store.migrations.columns import replace_indices, replace_views
from store.migrations.versions import revision_0003_views as before

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

V_ANALYSES = """
CREATE VIEW v_analyses AS
SELECT analysis_runs.analysis_id, analysis_runs.run_id, analyses.kind, analyses.method,
    NOT EXISTS (
        SELECT 1 FROM analysis_runs AS newer_runs CROSS JOIN analyses AS newer
        WHERE newer_runs.run_id = analysis_runs.run_id AND newer_runs.analysis_id > analyses.id
            AND newer.id = newer_runs.analysis_id AND newer.kind = analyses.kind AND newer.method = analyses.method
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
FROM v_analyses AS done CROSS JOIN mode_sets CROSS JOIN modes
WHERE mode_sets.analysis_id = done.analysis_id AND modes.mode_set_id = mode_sets.id
"""

V_JOINT_STIFFNESS = (
    before.V_JOINT_STIFFNESS.partition("FROM")[0]
    + """FROM v_analyses AS done CROSS JOIN joint_matrices CROSS JOIN joint_elements
WHERE joint_matrices.analysis_id = done.analysis_id AND joint_elements.joint_matrix_id = joint_matrices.id
"""
)

V_DYNAMIC_STIFFNESS = (
    before.V_DYNAMIC_STIFFNESS.partition("FROM")[0]
    + """FROM v_analyses AS done CROSS JOIN dynamic_stiffness AS points CROSS JOIN specimens
WHERE points.analysis_id = done.analysis_id AND specimens.id = points.specimen_id
"""
)

V_COMPARISON = """
CREATE VIEW v_comparison AS
SELECT analyses.id AS analysis_id, analyses.method,
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

VIEWS = {
    "v_analyses": V_ANALYSES,
    "v_modes": V_MODES,
    "v_joint_stiffness": V_JOINT_STIFFNESS,
    "v_dynamic_stiffness": V_DYNAMIC_STIFFNESS,
    "v_comparison": V_COMPARISON,
}

OLD_INDICES = (
    ("ix_runs_state_started_at", "runs", ["state", "started_at"]),
    ("ix_runs_kind_started_at", "runs", ["kind", "started_at"]),
    ("ix_analysis_runs_run_id", "analysis_runs", ["run_id"]),
    (
        "ix_dynamic_stiffness_series",
        "dynamic_stiffness",
        ["specimen_id", "configuration", "amplitude_pp_mm", "frequency"],
    ),
)
INDICES = (
    ("ix_runs_state_id", "runs", ["state", "id"]),
    ("ix_runs_kind_id", "runs", ["kind", "id"]),
    ("ix_runs_article_id", "runs", ["article", "id"]),
    ("ix_analysis_runs_run_id_analysis_id", "analysis_runs", ["run_id", "analysis_id"]),
    (
        "ix_dynamic_stiffness_series",
        "dynamic_stiffness",
        ["analysis_id", "configuration", "amplitude_pp_mm", "frequency"],
    ),
)


def upgrade() -> None:
    """Create the indices and views again."""
    replace_indices(OLD_INDICES, INDICES)
    replace_views(VIEWS)


def downgrade() -> None:
    """Create the former indices and views again."""
    replace_indices(INDICES, OLD_INDICES)
    replace_views({name: before.VIEWS[name] for name in VIEWS})
