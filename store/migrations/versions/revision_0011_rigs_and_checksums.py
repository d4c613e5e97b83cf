"""Runs have a rig, rows of measurements a checksum, and the audit log a hash chain.

Rows that are there already get their hashes now, and their hashes say so.
"""

from typing import Any

import sqlalchemy as sa
from alembic import context, op

from store.database.checksums import LATER, chain_hash, checksum, stored_rows
from store.migrations.columns import may_change, never_change
from store.migrations.versions import revision_0006_service as before

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None

FINAL = ("points", "blows", "sine_records", "channels", "calibrations", "run_events", "blow_withdrawals")
CHANGING = ("specimens", "instruments", "runs", "run_instruments")
AUDIT, HEAD = "audit_entries", "audit_head"
ROWS_AT_ONCE = 5_000
V_RUNS = before.V_RUNS.replace("runs.waveform_file\n", "runs.waveform_file, runs.rig\n")


def upgrade() -> None:
    """Add the columns, and compute the hashes of the rows that are there."""
    op.execute("DROP VIEW v_runs")
    op.add_column("runs", sa.Column("rig", sa.String()))
    op.get_bind().execute(
        sa.text("UPDATE runs SET rig = :rig WHERE kind <> 'import'"), {"rig": context.config.attributes["rig"]}
    )
    op.execute(V_RUNS)
    for table in (*CHANGING, *FINAL):
        op.add_column(table, sa.Column("checksum", sa.String(), nullable=False, server_default=""))
    op.add_column(AUDIT, sa.Column("chain_hash", sa.String(), nullable=False, server_default=""))
    op.create_table(
        HEAD,
        sa.Column("id", sa.Integer(), primary_key=True),
        sa.Column("entries", sa.Integer(), nullable=False),
        sa.Column("chain_hash", sa.String(), nullable=False),
    )
    for table in (*FINAL, AUDIT):
        may_change(table)
    for table in (*CHANGING, *FINAL):
        _fill(table)
    _chain()
    for table in (*FINAL, AUDIT):
        never_change(table)


def downgrade() -> None:
    """Drop the columns with the rigs and the hashes."""
    op.execute("DROP VIEW v_runs")
    op.drop_table(HEAD)
    op.drop_column(AUDIT, "chain_hash")
    for table in (*CHANGING, *FINAL):
        op.drop_column(table, "checksum")
    op.drop_column("runs", "rig")
    op.execute(before.V_RUNS)


def _fill(name: str) -> None:
    table = _reflected(name)
    rows = stored_rows(op.get_bind(), table)
    _write(table, "checksum", [(keys, checksum(LATER, values)) for keys, values in rows])


def _chain() -> None:
    table, hashes = _reflected(AUDIT), list[tuple[dict[str, Any], str]]()
    head = ""
    for keys, values in stored_rows(op.get_bind(), table):
        head = chain_hash(LATER, head, values)
        hashes.append((keys, head))
    _write(table, "chain_hash", hashes)
    insert = sa.text(f"INSERT INTO {HEAD} (id, entries, chain_hash) VALUES (1, :entries, :head)")
    op.get_bind().execute(insert, {"entries": len(hashes), "head": head})


def _write(table: sa.Table, column: str, hashes: list[tuple[dict[str, Any], str]]) -> None:
    own = [table.c[key.name] == sa.bindparam(f"the_{key.name}") for key in table.primary_key]
    statement = sa.update(table).where(*own).values({column: sa.bindparam("the_hash")})
    for start in range(0, len(hashes), ROWS_AT_ONCE):
        some = hashes[start : start + ROWS_AT_ONCE]
        op.get_bind().execute(
            statement,
            [{f"the_{key.name}": keys[key.name] for key in table.primary_key} | {"the_hash": it} for keys, it in some],
        )


def _reflected(name: str) -> sa.Table:
    return sa.Table(name, sa.MetaData(), autoload_with=op.get_bind(), resolve_fks=False)
