"""Intervals of sine points are Student's, as everywhere else: few cycles do not tell their own scatter well.

A database has no quantile of Student's distribution. So the view has its expansion in 1 / nu by R. A. Fisher and
E. A. Cornish (Technometrics 2, 1960, 209-225), with two more terms that were fitted: within 0.1 % from nu = 1 on.
"""

from functools import reduce

from alembic import op

from store.migrations.versions.revision_0015_commanded_frequency import V_DYNAMIC_STIFFNESS as BEFORE

revision = "0025"
down_revision = "0024"
branch_labels = None
depends_on = None

NORMAL = 1.96
EXPANSION = (NORMAL, 2.3723, 2.8225, 2.5556, 1.5896, 0.615, 0.781)
"""Coefficients of powers of 1 / nu, the lowest first; errors that are known beforehand have no nu."""
QUANTILE = reduce(
    lambda inner, each: f"{each} + each.per_freedom * ({inner})", reversed(EXPANSION[:-1]), f"{EXPANSION[-1]}"
)
POINTS = f"""(
    SELECT each.*, {QUANTILE} AS errors
    FROM (
        SELECT dynamic_stiffness.*, coalesce(1.0 / nullif(degrees_of_freedom, 0), 0) AS per_freedom
        FROM dynamic_stiffness
    ) AS each
) AS points"""
V_DYNAMIC_STIFFNESS = BEFORE.replace(f"{NORMAL} *", "points.errors *").replace("dynamic_stiffness AS points", POINTS)


def upgrade() -> None:
    """Create the view again."""
    _replace(V_DYNAMIC_STIFFNESS)


def downgrade() -> None:
    """Create the former view again."""
    _replace(BEFORE)


def _replace(view: str) -> None:
    op.execute("DROP VIEW v_dynamic_stiffness")
    op.execute(view)
