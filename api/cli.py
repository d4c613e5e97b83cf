"""The command `jointlab`: its subcommands, and how it reports errors.

All modules of commands together take seconds to import, so each is imported when it is asked for.
"""

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from keyword import iskeyword
from typing import Annotated, Any

import typer
from threadpoolctl import threadpool_limits
from typer.core import TyperGroup

from api.commands.console import PlainConsole
from store.extras import explained_imports
from store.version import software_version

INTERRUPTED = 130

# name: the module below api.commands that has the function or group of this name, and what it does, in one line
COMMANDS = {
    "demo": ("demo", "Both experiments of the paper on simulated instruments."),
    "simulate": ("simulate", "Start the simulated instruments and print their addresses."),
    "doctor": ("doctor", "Examine instruments and channels, and sign what was found."),
    "conformance": ("conformance", "Check whether an instrument does what this program relies on."),
    "run": ("sequences", "Run a sequence on the instruments and store it."),
    "resume": ("sequences", "Go on with a run that was stopped or failed."),
    "drive": ("drive", "Be the process that drives the rig, and listens for STOP."),
    "stop": ("drive", "End the run, and bring an actuator that is driven from here to rest."),
    "runs": ("runs", "List the runs of the catalogue."),
    "show": ("runs", "Show one run: how it was measured, and what came of it."),
    "history": ("history", "Show k and gamma of a specimen over its runs."),
    "plan": ("plan", "Say before a hammer test which intervals it will leave."),
    "import": ("exchange", "Store a bundle as a run."),
    "export": ("exchange", "Write a run as a bundle, or for other programs."),
    "amend": ("amend", "Correct the article of a run after the measurement."),
    "identify": ("identification", "Identify k, h and gamma by both methods and compare them."),
    "modes": ("identification", "Estimate natural frequencies, loss factors and shapes."),
    "stiffness": ("stiffness", "Say k, h and gamma at any amplitude and frequency."),
    "master": ("master", "Say k, h and gamma at any frequency and temperature."),
    "gap": ("gap", "Say where simulation and measurement differ, and why."),
    "report": ("identification", "Identify and write a report with figures."),
    "serve": ("service", "Serve runs, results and the rig over REST, with the page."),
    "worker": ("worker", "Do jobs of the service for a dask scheduler."),
    "mqtt": ("mqtt", "Publish what the rig does to a broker of MQTT."),
    "opcua": ("opcua", "Serve what the rig does as variables of OPC UA."),
    "key": ("keys", "Make, list and revoke keys of the service."),
    "alarms": ("alarms", "List, acknowledge and test alarms."),
    "store": ("store", "Check, back up and restore what is stored."),
    "config": ("configuration", "Show the configuration in force."),
}


@contextmanager
def _without_collections() -> Iterator[None]:
    """Switch garbage collection off: imports make many objects and hardly any garbage; collecting takes a quarter."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


def load(name: str) -> Any:
    """The command of this name, imported."""
    loaded = typer.Typer(rich_markup_mode=None)
    with explained_imports(), _without_collections():
        module = import_module(f"api.commands.{COMMANDS[name][0]}")
    found = getattr(module, f"{name}_" if iskeyword(name) else name)
    if isinstance(found, typer.Typer):
        loaded.add_typer(found, name=name)
    else:
        loaded.command(name)(found)
    return typer.main.get_group(loaded).commands[name]


class Commands(TyperGroup):
    """Lists the commands from a table; only the one that is asked for is imported."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:  # typer keeps their types to itself
        """The name of the command, the command, and its arguments."""
        name, _, rest = super().resolve_command(ctx, args)
        assert name is not None  # one that is not there has been refused
        command = load(name)
        # two BLAS threads on a busy machine cost more than they give; now that BLAS is loaded, it can be told so
        ctx.with_resource(threadpool_limits(limits=1))
        return name, command, rest


app = typer.Typer(
    name="jointlab",
    cls=Commands,
    help="Acquisition, rig control and identification for elastomeric joints.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    add_completion=False,
)
for command, (_, what_it_does) in COMMANDS.items():
    app.command(command, help=what_it_does)(lambda: None)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"jointlab {software_version()}")
        raise typer.Exit


@app.callback()
def _options(
    _version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Options of the command itself."""


def main() -> None:
    """Run a command; expected errors become one line on standard error and an exit code.

    0 done, 2 wrong usage, 3 bad input, 4 an instrument, 130 interrupted.
    """
    try:
        app()
    except SystemExit as ended:
        if ended.code == INTERRUPTED:  # typer's code for Ctrl-C, of which it says nothing
            PlainConsole(stderr=True).print("jointlab: interrupted", style="red")
        raise
    except Exception as error:
        from jointlab.errors import EXPECTED, exit_code  # imports the instruments' packages
        from rig.errors import with_notes

        if not isinstance(error, EXPECTED):
            raise
        PlainConsole(stderr=True, soft_wrap=True).print(f"jointlab: {with_notes(str(error), error)}", style="red")
        sys.exit(exit_code(error))


if __name__ == "__main__":
    main()
