"""What the service keeps: keys, audit log, requests that act, sequences, jobs, diagnoses, and blows taken back."""

from typing import Any

import sqlalchemy as sa
from alembic import op

from store.migrations.versions import revision_0003_views as before

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

Index = tuple[str, str, list[str]]
AUDIT, WITHDRAWALS = "audit_entries", "blow_withdrawals"
TABLES = (WITHDRAWALS, "api_keys", AUDIT, "requests", "sequence_documents", "jobs", "diagnoses")

V_GAP = """
CREATE VIEW v_gap AS
SELECT done.run_id, done.analysis_id, done.method, done.latest, done.article, done.measured_at,
    diagnoses.status, diagnoses.effects, diagnoses.gap_before_percent, diagnoses.gap_after_percent, done.analysed_at,
    done.software_version
FROM v_analyses AS done CROSS JOIN diagnoses
WHERE diagnoses.analysis_id = done.analysis_id
"""

V_RUNS = """
CREATE VIEW v_runs AS
SELECT runs.id AS run_id, runs.kind, runs.state, runs.title, runs.article, runs.started_at, runs.finished_at,
    runs.reason,
    (SELECT count(*) FROM blows JOIN points ON points.id = blows.point_id
        LEFT JOIN blow_withdrawals AS taken_back ON taken_back.blow_id = blows.id
        WHERE points.run_id = runs.id AND blows.accepted AND taken_back.id IS NULL) AS blows_accepted,
    (SELECT count(*) FROM blows JOIN points ON points.id = blows.point_id
        LEFT JOIN blow_withdrawals AS taken_back ON taken_back.blow_id = blows.id
        WHERE points.run_id = runs.id AND NOT (blows.accepted AND taken_back.id IS NULL)) AS blows_refused,
    (SELECT count(*) FROM sine_records WHERE sine_records.run_id = runs.id) AS sine_records,
    runs.software_version, runs.configuration_hash, runs.waveform_file
FROM runs
"""

V_BLOWS = """
CREATE VIEW v_blows AS
SELECT points.run_id, blows.id AS blow_id, points.set_number, CAST(points.node AS VARCHAR(10)) || points.direction
        AS point,
    points.node, points.direction, blows.number, blows.accepted AND taken_back.id IS NULL AS accepted,
    coalesce(blows.reason, 'withdrawn: ' || taken_back.reason) AS reason, blows.peak_force,
    blows.temperature_c, blows.struck_at, runs.article, runs.title, runs.waveform_file, blows.waveform_record,
    blows.source
FROM blows
JOIN points ON points.id = blows.point_id
JOIN runs ON runs.id = points.run_id
LEFT JOIN blow_withdrawals AS taken_back ON taken_back.blow_id = blows.id
"""

VIEWS = {"v_runs": V_RUNS, "v_blows": V_BLOWS}

# Name, table, columns: lists that are filtered by specimen or walked through in the order of storing.
OLD_INDICES = (("ix_joint_matrices_specimen_id", "joint_matrices", ["specimen_id"]),)
INDICES = (
    ("ix_joint_matrices_specimen_id_analysis_id", "joint_matrices", ["specimen_id", "analysis_id"]),
    ("ix_dynamic_stiffness_specimen_id_id", "dynamic_stiffness", ["specimen_id", "id"]),
    ("ix_comparisons_article_id", "comparisons", ["article", "id"]),
)


def upgrade() -> None:
    """Create the tables, the views and the indices."""
    recorded(
        WITHDRAWALS,
        sa.Column("blow_id", sa.Integer(), sa.ForeignKey("blows.id", name="fk_blow_withdrawals_blow_id"),
                  nullable=False),
        sa.Column("reason", sa.String(), nullable=False),
        sa.Column("who", sa.String(), nullable=False),
        sa.UniqueConstraint("blow_id", name="uq_blow_withdrawals_blow_id"),
    )  # fmt: skip
    recorded(
        "api_keys",
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("digest", sa.String(), nullable=False),
        sa.Column("scopes", sa.JSON(), nullable=False),
        sa.Column("expires_at", sa.DateTime(timezone=True)),
        sa.Column("revoked_at", sa.DateTime(timezone=True)),
        sa.UniqueConstraint("digest", name="uq_api_keys_digest"),
    )
    recorded(
        AUDIT,
        sa.Column("who", sa.String(), nullable=False),
        sa.Column("action", sa.String(), nullable=False),
        sa.Column("target", sa.String(), nullable=False),
        sa.Column("outcome", sa.String(), nullable=False),
        sa.Column("details", sa.JSON(), nullable=False),
    )
    op.create_index("ix_audit_entries_action_id", AUDIT, ["action", "id"])
    recorded(
        "requests",
        sa.Column("who", sa.String(), nullable=False),
        sa.Column("idempotency_key", sa.String(), nullable=False),
        sa.Column("fingerprint", sa.String(), nullable=False),
        sa.Column("status", sa.Integer()),
        sa.Column("body", sa.String()),
        sa.UniqueConstraint("who", "idempotency_key", name="uq_requests_who_idempotency_key"),
    )
    recorded(
        "sequence_documents",
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("document", sa.JSON(), nullable=False),
        sa.Column("changed_at", sa.DateTime(timezone=True), nullable=False),
        sa.UniqueConstraint("name", name="uq_sequence_documents_name"),
    )
    _jobs()
    recorded(
        "diagnoses",
        sa.Column("analysis_id", sa.Integer(), sa.ForeignKey("analyses.id", name="fk_diagnoses_analysis_id"),
                  nullable=False),
        sa.Column("status", sa.String(), nullable=False),
        sa.Column("effects", sa.JSON(), nullable=False),
        sa.Column("gap_before_percent", sa.Double()),
        sa.Column("gap_after_percent", sa.Double()),
        sa.Column("document", sa.JSON(), nullable=False),
        sa.UniqueConstraint("analysis_id", name="uq_diagnoses_analysis_id"),
    )  # fmt: skip
    op.execute(V_GAP)
    _replace_views(VIEWS)
    _replace(OLD_INDICES, INDICES)
    for table in (AUDIT, WITHDRAWALS):
        never_change(table)


def downgrade() -> None:
    """Drop the tables."""
    op.execute("DROP VIEW v_gap")
    _replace_views({name: before.VIEWS[name] for name in VIEWS})
    _replace(INDICES, OLD_INDICES)
    for table in reversed(TABLES):
        op.drop_table(table)


def _replace_views(views: dict[str, str]) -> None:
    for name, statement in views.items():
        op.execute(f"DROP VIEW {name}")
        op.execute(statement)


def _replace(old: tuple[Index, ...], new: tuple[Index, ...]) -> None:
    for name, table, _ in old:
        op.drop_index(name, table)
    for name, table, columns in new:
        op.create_index(name, table, columns)


def _jobs() -> None:
    recorded(
        "jobs",
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("parameters", sa.JSON(), nullable=False),
        sa.Column("asked_by", sa.String(), nullable=False),
        sa.Column("attempts", sa.Integer(), nullable=False),
        sa.Column("cancelled", sa.Boolean(), nullable=False),
        sa.Column("lease_token", sa.String()),
        sa.Column("leased_until", sa.DateTime(timezone=True)),
        sa.Column("heartbeat_at", sa.DateTime(timezone=True)),
        sa.Column("stage", sa.String()),
        sa.Column("done", sa.Integer(), nullable=False),
        sa.Column("total", sa.Integer(), nullable=False),
        sa.Column("result", sa.JSON(none_as_null=True)),
        sa.Column("error", sa.String()),
        sa.Column("started_at", sa.DateTime(timezone=True)),
        sa.Column("finished_at", sa.DateTime(timezone=True)),
    )
    op.create_index("ix_jobs_state_id", "jobs", ["state", "id"])
    op.create_index("ix_jobs_kind_id", "jobs", ["kind", "id"])


def recorded(table: str, *columns: Any) -> None:
    """Create a table with the columns that every one has."""
    op.create_table(
        table,
        sa.Column("id", sa.Integer(), primary_key=True),
        *columns,
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("software_version", sa.String(), nullable=False),
    )


def never_change(table: str) -> None:
    """Refuse to change or delete rows."""
    if op.get_bind().dialect.name == "postgresql":
        op.execute(
            f"CREATE TRIGGER {table}_are_final BEFORE UPDATE OR DELETE ON {table} "
            "FOR EACH ROW EXECUTE FUNCTION raw_data_are_final()"
        )
        return
    for action in ("UPDATE", "DELETE"):
        op.execute(
            f"CREATE TRIGGER {table}_are_final_{action.lower()} BEFORE {action} ON {table} "
            "BEGIN SELECT RAISE(ABORT, 'raw data are never changed or deleted'); END"
        )
