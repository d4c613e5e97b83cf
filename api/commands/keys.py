"""`jointlab key`: make, list and revoke the keys by which the service knows people and programs."""

from datetime import UTC, datetime, timedelta
from typing import Annotated

import typer
from sqlalchemy.orm import Session

from api.commands.terminal import open_catalogue, out, show_table
from jointlab.report.section import Table
from store.provenance import who_is_here
from store.service.audit import add_audit_entry
from store.service.keys import ApiKey, add_key, list_keys, revoke_key
from store.states import Scope

key = typer.Typer(help="Make, list and revoke keys of the service.", no_args_is_help=True)


@key.command()
def create(
    name: Annotated[str, typer.Argument(help="Its owner, such as a person, a page or a test sequence.")],
    scopes: Annotated[list[Scope], typer.Option("--scope", help="What it opens; may be given several times.")],
    days: Annotated[int | None, typer.Option(min=1, max=36500, help="Days after which it ends.")] = None,
) -> None:
    """Make a key and show it: this once, because only a hash of it is kept."""
    ends = None if days is None else datetime.now(UTC) + timedelta(days=days)
    with open_catalogue() as catalogue, catalogue.writing() as session:
        key, secret = add_key(session, name, scopes, ends)
        _note(session, "create key", key)
    out.print(secret)


@key.command("list")
def list_() -> None:
    """List the keys, newest first, without their secrets."""
    with open_catalogue() as catalogue, catalogue.reading() as session:
        keys = list_keys(session, limit=10_000)
    rows = tuple(
        (
            str(key.id),
            key.name,
            " ".join(sorted(key.scopes)),
            _minute(key.created_at),
            _minute(key.expires_at),
            _standing(key),
        )
        for key in keys
    )
    show_table(Table("Keys", ("key", "name", "scopes", "made (UTC)", "ends (UTC)", ""), rows))


@key.command()
def revoke(number: Annotated[int, typer.Argument(metavar="KEY", min=1, max=999_999_999, help="Its number.")]) -> None:
    """Let a key open nothing from now on."""
    with open_catalogue() as catalogue, catalogue.writing() as session:
        key = revoke_key(session, number)
        _note(session, "revoke key", key)
    out.print(f"key {key.id} ({key.name}) revoked")


def _note(session: Session, action: str, key: ApiKey) -> None:
    add_audit_entry(session, who=who_is_here(), action=action, target=f"key {key.id} ({key.name})", outcome="done")


def _minute(at: datetime | None) -> str:
    return "" if at is None else f"{at:%Y-%m-%d %H:%M}"


def _standing(key: ApiKey) -> str:
    if key.revoked_at is not None:
        return "revoked"
    return "valid" if key.is_valid(datetime.now(UTC)) else "ended"
