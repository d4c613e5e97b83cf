"""`jointlab doctor`: examine instruments and channels, and sign the result."""

from contextlib import closing
from typing import Annotated

import typer

from api.commands.terminal import open_catalogue, out, progress_console
from api.commands.terminal_operator import TerminalOperator
from jointlab.commissioning.examination import calibrator_of, examine_rig, sign, verdict_of
from jointlab.commissioning.wording import COLOURS, check_text, verdict_text
from jointlab.errors import INSTRUMENT
from jointlab.instruments import instruments_of
from jointlab.settings import Settings, load_settings
from jointlab.supervision.drive_link import DriveLink
from jointlab.trials.simulated_operator import operator_at
from rig.checks.check import Place, failed
from rig.checks.examination import Examination, Examined
from rig.operator import BEAM, SENSOR, Operator
from store.errors import StoreError
from store.provenance import who_is_here
from store.states import Verdict


def doctor(
    trip: Annotated[
        bool,
        typer.Option(
            "--trip", help="Trip watchdog and emergency stop, too, with hydraulics on. The machine must be clear."
        ),
    ] = False,
    calibrator: Annotated[
        bool, typer.Option("--calibrator", help="Put the accelerometer on a hand-held calibrator, too.")
    ] = False,
    mass: Annotated[
        float | None,
        typer.Option(min=0.1, max=1000.0, metavar="KG", help="Strike a hanging mass with the accelerometer, too."),
    ] = None,
    who: Annotated[str | None, typer.Option(metavar="NAME", help="Who signs; by default who is logged in.")] = None,
) -> None:
    """Examine instruments and channels while nothing moves, and sign what was found in the database.

    Keep everything at rest: specimens out of the tester, nobody at the beam.
    """
    settings = load_settings()
    instruments_of(settings)  # says what is wrong with the channel table, before anything is started
    asked = [Examination(trip=trip)]
    asked += [Examination(Place.CALIBRATOR, calibrator=calibrator_of(settings.commissioning))] if calibrator else []
    asked += [] if mass is None else [Examination(Place.MASS, mass=mass)]
    who = who or who_is_here()
    with (
        operator_at(settings.simulated_operator) as simulated,
        closing(DriveLink(settings, "jointlab doctor", lambda _: None, lambda _: None, lambda _: None)) as link,
    ):
        lease, operator = link.take_lease(who), simulated or TerminalOperator(progress_console)
        verdicts = [_signed(settings, each, _found(link, each, lease, operator), who) for each in asked]
    if Verdict.FAILED in verdicts:
        raise typer.Exit(INSTRUMENT)


def _found(link: DriveLink, asked: Examination, lease: int, operator: Operator) -> Examined:
    """Examine the rig with its sensors at the place that is asked for, and let the operator put them back."""
    if asked.place is Place.BENCH:
        return examine_rig(link.ask, asked, lease)
    operator.mount(SENSOR, asked.place.value)
    if asked.place is Place.MASS:
        progress_console.print("strike the mass now, two or three times within 5 s")
    try:
        return examine_rig(link.ask, asked, lease)
    finally:
        operator.mount(SENSOR, BEAM)


def _signed(settings: Settings, asked: Examination, found: Examined, who: str) -> Verdict:
    """Show what was found, and sign it; its verdict."""
    for check in found.checks:
        out.print(check_text(check), style=COLOURS[check.state])
    try:
        with open_catalogue(settings) as catalogue:
            record = sign(catalogue, settings.rig, asked, found, instruments_of(settings).channels, who)
    except StoreError as error:
        out.print(check_text(failed("writable", "database", error)), style="red")
        return Verdict.FAILED
    out.print(f"{verdict_text(verdict_of(found.checks))}; record {record.id} signed by {who}")
    return record.verdict
