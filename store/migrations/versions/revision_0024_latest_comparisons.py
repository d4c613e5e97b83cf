"""A comparison is the latest as long as what it compares is: where joints are left out, none follows it."""

from alembic import op

from store.migrations.versions.revision_0015_commanded_frequency import V_COMPARISON as BEFORE

revision = "0024"
down_revision = "0023"
branch_labels = None
depends_on = None

V_COMPARISON = """
CREATE VIEW v_comparison AS
SELECT (SELECT min(used.run_id) FROM analysis_runs AS used WHERE used.analysis_id = analyses.id) AS run_id,
    analyses.id AS analysis_id, analyses.method,
    NOT EXISTS (
        SELECT 1 FROM analysis_runs AS mine CROSS JOIN analysis_runs AS others CROSS JOIN analyses AS newer
        WHERE mine.analysis_id = analyses.id AND others.run_id = mine.run_id AND others.analysis_id > analyses.id
            AND newer.id = others.analysis_id
            AND ((newer.kind = analyses.kind AND newer.method = analyses.method) OR EXISTS (
                SELECT 1 FROM analysis_parents AS origins CROSS JOIN analyses AS compared
                WHERE origins.analysis_id = analyses.id AND compared.id = origins.parent_id
                    AND compared.kind = newer.kind AND compared.method = newer.method
            ))
    ) AS latest,
    comparisons.article, comparisons.joint, comparisons.element, comparisons.frequency, comparisons.amplitude_pp_mm,
    comparisons.inverse_low, comparisons.inverse_high, comparisons.direct_low, comparisons.direct_high,
    comparisons.verdict, comparisons.reason, analyses.created_at AS analysed_at, analyses.software_version
FROM comparisons
JOIN analyses ON analyses.id = comparisons.analysis_id
"""


def upgrade() -> None:
    """Create the view again."""
    _replace(V_COMPARISON)


def downgrade() -> None:
    """Create the former view again."""
    _replace(BEFORE)


def _replace(view: str) -> None:
    op.execute("DROP VIEW v_comparison")
    op.execute(view)
