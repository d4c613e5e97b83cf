"""What the service keeps: keys, audit log, requests that act, sequences, jobs, diagnoses, and blows taken back."""

import sqlalchemy as sa
from alembic import op

from store.migrations.columns import (
    drop,
    never_change,
    optional,
    recorded,
    reference,
    replace_indices,
    replace_views,
    required,
)
from store.migrations.versions import revision_0003_views as before

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

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
        reference("blow_id", "blows"),
        *required(sa.String, "reason", "who"),
        sa.UniqueConstraint("blow_id"),
    )
    recorded(
        "api_keys",
        *required(sa.String, "name", "digest"),
        *required(sa.JSON, "scopes"),
        *optional(sa.DateTime(timezone=True), "expires_at", "revoked_at"),
        sa.UniqueConstraint("digest"),
    )
    recorded(AUDIT, *required(sa.String, "who", "action", "target", "outcome"), *required(sa.JSON, "details"))
    op.create_index("ix_audit_entries_action_id", AUDIT, ["action", "id"])
    recorded(
        "requests",
        *required(sa.String, "who", "idempotency_key", "fingerprint"),
        *optional(sa.Integer, "status"),
        *optional(sa.String, "body"),
        sa.UniqueConstraint("who", "idempotency_key"),
    )
    recorded(
        "sequence_documents",
        *required(sa.String, "name"),
        *required(sa.JSON, "document"),
        *required(sa.DateTime(timezone=True), "changed_at"),
        sa.UniqueConstraint("name"),
    )
    _jobs()
    recorded(
        "diagnoses",
        reference("analysis_id", "analyses"),
        *required(sa.String, "status"),
        *required(sa.JSON, "effects"),
        *optional(sa.Double, "gap_before_percent", "gap_after_percent"),
        *required(sa.JSON, "document"),
        sa.UniqueConstraint("analysis_id"),
    )
    op.execute(V_GAP)
    replace_views(VIEWS)
    replace_indices(OLD_INDICES, INDICES)
    for table in (AUDIT, WITHDRAWALS):
        never_change(table)


def downgrade() -> None:
    """Drop the tables."""
    op.execute("DROP VIEW v_gap")
    replace_views({name: before.VIEWS[name] for name in VIEWS})
    replace_indices(INDICES, OLD_INDICES)
    drop(*reversed(TABLES))


def _jobs() -> None:
    recorded(
        "jobs",
        *required(sa.String, "kind", "state"),
        *required(sa.JSON, "parameters"),
        *required(sa.String, "asked_by"),
        *required(sa.Integer, "attempts"),
        *required(sa.Boolean, "cancelled"),
        *optional(sa.String, "lease_token"),
        *optional(sa.DateTime(timezone=True), "leased_until", "heartbeat_at"),
        *optional(sa.String, "stage"),
        *required(sa.Integer, "done", "total"),
        *optional(sa.JSON(none_as_null=True), "result"),
        *optional(sa.String, "error"),
        *optional(sa.DateTime(timezone=True), "started_at", "finished_at"),
    )
    op.create_index("ix_jobs_state_id", "jobs", ["state", "id"])
    op.create_index("ix_jobs_kind_id", "jobs", ["kind", "id"])
