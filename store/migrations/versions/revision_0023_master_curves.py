"""Master curves of specimens over frequency and temperature, and a view of them."""

import sqlalchemy as sa
from alembic import op

from store.migrations.columns import recorded, reference, required

revision = "0023"
down_revision = "0022"
branch_labels = None
depends_on = None

TABLE = "master_curves"
V_MASTER_CURVES = """
CREATE VIEW v_master_curves AS
SELECT done.run_id, done.analysis_id, done.method, done.article, specimens.name AS specimen, found.configuration,
    found.amplitude_pp_mm, found.shift, found.reference_c, found.lowest_reduced_frequency,
    found.highest_reduced_frequency, done.measured_at, done.analysed_at, done.software_version
FROM v_analyses AS done CROSS JOIN master_curves AS found
JOIN specimens ON specimens.id = found.specimen_id
WHERE found.analysis_id = done.analysis_id
"""


def upgrade() -> None:
    """Create table and view."""
    recorded(
        TABLE,
        reference("analysis_id", "analyses"),
        reference("specimen_id", "specimens"),
        *required(sa.String, "configuration"),
        *required(sa.Double, "amplitude_pp_mm"),
        *required(sa.String, "shift"),
        *required(sa.Double, "reference_c", "lowest_reduced_frequency", "highest_reduced_frequency"),
        *required(sa.JSON, "document"),
        sa.UniqueConstraint("analysis_id"),
    )
    op.create_index("ix_master_curves_specimen_id", TABLE, ["specimen_id"])
    op.execute(V_MASTER_CURVES)


def downgrade() -> None:
    """Drop both, with the master curves."""
    op.execute("DROP VIEW v_master_curves")
    op.drop_table(TABLE)
