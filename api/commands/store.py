"""`jointlab store`: check, back up and restore the catalogue and its waveforms."""

from collections.abc import Sequence
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from api.commands.terminal import LARGEST_RUN, open_catalogue, out, progress_bar
from jointlab.alarms.new import damaged_audit_log
from jointlab.errors import BAD_INPUT
from jointlab.settings import load_settings
from store.backup.backup import back_up
from store.backup.backup import restore as restore_backup
from store.backup.check import Finding
from store.backup.check import check as check_catalogue
from store.backup.checked_part import WHOLE, Part
from store.errors import RESTORE
from store.measurements.runs import count_runs, day_limits
from store.service.alarms import add_alarm
from store.service.audit import check_head, read_chain

store = typer.Typer(help="Check, back up and restore what is stored.", no_args_is_help=True)


@store.command()
def check(
    run: Annotated[
        list[int] | None, typer.Option(min=1, max=LARGEST_RUN, help="Only this run; may be given more than once.")
    ] = None,
    since: Annotated[datetime | None, typer.Option(formats=["%Y-%m-%d"], help="Only from this day on, UTC.")] = None,
    part: Annotated[
        tuple[int, int], typer.Option(metavar="K N", help="Only every Nth run: the Kth of N parts that make up all.")
    ] = (1, 1),
) -> None:
    """Verify every waveform, row, array and reference, and the audit log; exit code 3 where something is damaged.

    Of some runs alone, what belongs to them is verified; the first part has all that belongs to no run, too.
    """
    chosen = Part(tuple(run or ()), day_limits(since and since.date(), None)[0], part)
    with open_catalogue() as catalogue:
        total, checked = catalogue.read(count_runs), chosen.count(catalogue)
        if chosen == WHOLE:
            out.print(f"{catalogue.address}: {total} runs")
        else:
            rest = "" if chosen.is_first else ", and what belongs to no run, such as instruments and the audit log"
            out.print(f"{catalogue.address}: {checked} of {total} runs")
            out.print(f"not checked: {total - checked} other runs{rest}")
        _report(check_catalogue(catalogue, progress_bar, chosen), "" if chosen == WHOLE else " in what was checked")


@store.command()
def audit(
    head: Annotated[str | None, typer.Option(help="The hash that this command printed earlier.")] = None,
    alarm: Annotated[
        bool, typer.Option("--alarm", help="Raise an alarm where it is damaged, as of a command that runs by itself.")
    ] = False,
) -> None:
    """Verify the chain of the audit log, and print the hash of its last entry, to be kept elsewhere."""
    settings = load_settings()
    with open_catalogue(settings) as catalogue:
        with catalogue.reading(long=True) as session:
            log = read_chain(session, head)
        faults = list(log.faults)
        if head is not None and not log.has_noted:
            faults.append(f"no entry has the hash {head}")
        if alarm and faults:
            catalogue.write(partial(add_alarm, new=damaged_audit_log(settings.rig, faults)))
    later = f" ({log.later} from before the log had a chain)" if log.later else ""
    out.print(f"{log.entries} entries{later}, hash of the last one: {log.head or 'none'}")
    findings = [Finding("audit log", fault, RESTORE) for fault in log.faults]
    if head is not None and not log.has_noted:
        _show(findings)
        check_head(log, head)
    _report(findings)


@store.command()
def backup(path: Annotated[Path, typer.Argument(help="A new folder, or a new file that ends in .zip.")]) -> None:
    """Copy the catalogue and its waveforms, also while a run is on; exit code 3 where what is copied is damaged."""
    with open_catalogue() as catalogue:
        made = back_up(catalogue, path, progress_bar)
    out.print(f"{path} written: {made.runs} runs, {made.waveform_files} waveform files, {made.size / 1e6:.1f} MB")
    _report(made.findings)


@store.command()
def restore(path: Annotated[Path, typer.Argument(help="What `jointlab store backup` made.")]) -> None:
    """Restore a backup into the configured database, which is empty, and check it; exit code 3 where it is damaged."""
    settings = load_settings()
    restored = restore_backup(path, settings.database_url, settings.waveform_folder, progress_bar, settings.rig)
    manifest = restored.manifest
    out.print(f"{path} restored, made {manifest.made_at} by jointlab {manifest.software_version}")
    _report(restored.findings)


def _show(findings: Sequence[Finding]) -> None:
    for finding in findings:
        out.print(str(finding), style="red" if finding.damage else "yellow")


def _report(findings: Sequence[Finding], where: str = "") -> None:
    _show(findings)
    damage = sum(finding.damage for finding in findings)
    if damage:
        out.print(f"{damage} damaged or missing", style="red")
        raise typer.Exit(BAD_INPUT)
    out.print(f"no damage found{where}")
