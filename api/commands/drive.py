"""`jointlab drive` and `jointlab stop`: the process that moves the machine, and STOP for it."""

import json
from contextlib import closing
from typing import Annotated

import typer
from pydantic import ValidationError

from api.commands.console import visible
from jointlab.drive.process import STOP_ADDRESS
from jointlab.drive.process import run as run_drive
from jointlab.drive.protocol import SNAPSHOT, Ask, ResetStop
from jointlab.errors import JointlabError
from jointlab.hall import STOP_TIMEOUT, ReportedOutcome, ask
from jointlab.settings import Settings, drive_folder, load_settings
from jointlab.supervision.drive_link import DriveLink
from rig.errors import RigError
from store.provenance import who_is_here


def drive() -> None:
    """Drive the rig until Ctrl-C or SIGTERM, which end a run, with an actuator that it drives at rest.

    The service and jointlab run start such a process where none runs, and steer it. As a unit of its own it needs
    neither of them: it goes on when they end, and listens for STOP.
    """
    settings = load_settings()
    run_drive(settings, alarms=settings.alarms.are_told)


def stop(
    state: Annotated[bool, typer.Option("--state", help="Say what the machine does, and stop nothing.")] = False,
    reset: Annotated[bool, typer.Option("--reset", help="Reset STOP; nothing moves by this.")] = False,
) -> None:
    """STOP: end the run, and bring an actuator that is driven from here to rest. No run begins until it is reset.

    A machine that its own software drives moves on; press its own stop. The command asks the drive process itself
    and needs neither service, key nor database.
    """
    if reset:
        reset_stop(load_settings())
        return
    answer = ask_listener(load_settings(), b"STATE\n" if state else b"STOP\n")
    typer.echo(visible(answer))
    if not state:
        try:
            outcome = ReportedOutcome.model_validate_json(answer)
        except ValidationError as error:
            raise RigError(
                "what answers there is no drive process: STOP is not confirmed; press the red button on the machine"
            ) from error
        if outcome.at_rest is False:
            raise RigError("the actuator was not confirmed at rest; press the red button on the machine")


def reset_stop(settings: Settings) -> None:
    """Reset STOP after a confirmation. Raises ConflictError where another program drives, RigError where none can."""

    def ignore(_told: object) -> None:
        pass

    with closing(DriveLink(settings, "jointlab stop", ignore, ignore, ignore)) as link:
        lease = link.take_lease(who_is_here())
        stop = SNAPSHOT.validate_python(link.ask(Ask()).value).stop
        if stop is None:
            typer.echo("no STOP is in force")
            return
        said = visible(f"STOP by {stop.who}: {stop.why}. Have you looked at the machine?")
        typer.confirm(said, abort=True)
        link.ask(ResetStop(epoch=stop.epoch, lease=lease))
        typer.echo("STOP is reset")


def ask_listener(settings: Settings, line: bytes) -> str:
    """The answer of the STOP listener to a line. Raises JointlabError where it does not answer."""
    given = settings.drive.stop_address, settings.drive.stop_port
    try:
        address, port = json.loads((drive_folder(settings) / STOP_ADDRESS).read_text(encoding="ascii"))
    except (OSError, ValueError):
        address, port = given
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(address, address)
    try:
        return ask(host, port, line, STOP_TIMEOUT).decode(errors="replace")
    except OSError as error:
        raise JointlabError(
            f"no drive process listens for STOP on port {port} of {host} ({error}); press the red button on the machine"
        ) from error
