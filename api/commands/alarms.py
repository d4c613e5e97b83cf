"""`jointlab alarms`: list the standing alarms, acknowledge one, and send a test alarm."""

from typing import Annotated

import typer

from api.commands.terminal import open_catalogue, out, show_table
from jointlab.alarms.new import new_test
from jointlab.report.section import Table
from jointlab.settings import load_settings
from store.provenance import who_is_here
from store.service.alarms import Alarm, Delivery, acknowledge_alarm, add_alarm, list_alarms, list_deliveries
from store.service.audit import add_audit_entry

alarms = typer.Typer(help="List, acknowledge and test alarms.", no_args_is_help=True)
LATEST = 100


@alarms.command("list")
def list_(
    every: Annotated[bool, typer.Option("--all", help="Also those that somebody has acknowledged.")] = False,
) -> None:
    """List the alarms that nobody has acknowledged, newest first, and who was notified."""
    with open_catalogue() as catalogue, catalogue.reading() as session:
        found = list_alarms(session, standing=None if every else True, limit=LATEST)
        deliveries = list_deliveries(session, [alarm.id for alarm in found])
    if not found:
        out.print("no alarm is active" if not every else "no alarm was ever raised")
        return
    rows = tuple(_row(alarm, deliveries.get(alarm.id, [])) for alarm in found)
    show_table(Table("Alarms", ("alarm", "at (UTC)", "what", "notified by", "acknowledged by"), rows))


@alarms.command()
def acknowledge(
    number: Annotated[int, typer.Argument(metavar="ALARM", min=1, max=999_999_999, help="Its number.")],
    note: Annotated[str, typer.Option(help="What was seen, or what was done about it.")] = "",
) -> None:
    """Say that somebody has seen an alarm: nobody else is notified."""
    who = who_is_here()
    with open_catalogue() as catalogue, catalogue.writing() as session:
        alarm = acknowledge_alarm(session, number, who, note)
        add_audit_entry(
            session, who=who, action="acknowledge alarm", target=f"alarm {number}", outcome="done",
            details={"note": note or None},
        )  # fmt: skip
    out.print(f"alarm {number} acknowledged by {alarm.acknowledged_by}")


@alarms.command()
def test() -> None:
    """Raise an alarm that is a test; the service of this rig tells it, now or when it is started."""
    who, settings = who_is_here(), load_settings()
    with open_catalogue(settings) as catalogue, catalogue.writing() as session:
        alarm = add_alarm(session, new_test(settings.rig, who))
        assert alarm is not None, "each test has a cause of its own"
        add_audit_entry(session, who=who, action="test alarms", target="alarms", outcome="done")
    out.print(f"alarm {alarm.id} raised; jointlab alarms list says who was notified")


def _row(alarm: Alarm, deliveries: list[Delivery]) -> tuple[str, ...]:
    by = ", ".join(
        each.channel if each.delivered_at is not None else f"{each.channel} (not yet: {each.result or 'under way'})"
        for each in deliveries
    )
    at = f"{alarm.happened_at:%Y-%m-%d %H:%M:%S}"
    return str(alarm.id), at, alarm.text, by, alarm.acknowledged_by or ""
