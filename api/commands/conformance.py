"""`jointlab conformance`: check whether an instrument, or its plug-in, behaves as this program needs."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated

import typer

from api.commands.terminal import check_writable, out, write_json
from daq.device import connect as connect_daq
from daq.instrument import DaqInstrument
from daq.streamed import StreamedInstrument
from jointlab.commissioning.examination import verdict_of
from jointlab.commissioning.wording import COLOURS, check_text
from jointlab.drive.process import tester_held
from jointlab.errors import INSTRUMENT
from jointlab.instruments import channels_of, codec_of, open_source_of
from jointlab.settings import load_settings
from rig.checks.check import Check, CheckState
from rig.checks.daq_conformance import check_daq
from rig.checks.tester_conformance import check_tester
from rig.tester.driver import Tester
from rig.tester.driver import connect as connect_tester
from rig.tester.limits import TesterLimits
from rig.tester.missing_functions import Lack
from rig.tester.register_map import OURS
from rig.tester.register_map_file import read_tester_map
from store.states import Verdict
from store.version import software_version

conformance = typer.Typer(no_args_is_help=True, rich_markup_mode=None)
PlugIn = Annotated[str, typer.Option(metavar="NAME", help="A plug-in: installed, MODULE:FUNCTION or FILE.py:FUNCTION.")]
JsonFile = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write the checks to a JSON file, too.")]


@conformance.callback()
def _group() -> None:
    """Check whether an instrument does what this program relies on."""


@conformance.command("daq")
def of_daq(
    address: Annotated[str, typer.Argument(help="As daq_address in jointlab.toml.")],
    plugin: PlugIn = "",
    volts: Annotated[float | None, typer.Option(metavar="V", help="A known voltage at the first channel.")] = None,
    tone: Annotated[float | None, typer.Option(min=1.0, metavar="HZ", help="A known sine at it.")] = None,
    largest: Annotated[float, typer.Option(min=1e-3, metavar="V", help="What inputs are asked to take.")] = 1.0,
    json: JsonFile = None,
) -> None:
    """Check an acquisition instrument.

    The channels are those of jointlab.toml where that has this address, else the first two inputs.
    """
    settings, open_source = load_settings(), open_source_of(address, plugin)
    table = channels_of(settings) if settings.daq_address == address else ()

    def open_instrument() -> DaqInstrument:
        return connect_daq(address) if open_source is None else StreamedInstrument(address, open_source)

    check_writable(json)
    _show(check_daq(open_instrument, table, volts=volts, tone=tone, largest=largest), address, json)


@conformance.command("tester")
def of_tester(
    address: Annotated[str, typer.Argument(help="As tester_url in jointlab.toml.")],
    plugin: PlugIn = "",
    map_file: Annotated[Path | None, typer.Option("--map", metavar="FILE", help="As tester_map.")] = None,
    without: Annotated[list[Lack] | None, typer.Option(metavar="LACK", help="As tester_without.")] = None,
    move: Annotated[bool, typer.Option("--move", help="Move the actuator, and trip watchdog and stop.")] = False,
    json: JsonFile = None,
) -> None:
    """Check a tester; nothing moves and hydraulics stay off unless --move allows it."""
    settings = load_settings().model_copy(update={"tester_url": address})
    tester_map = replace(OURS if map_file is None else read_tester_map(map_file), codec=codec_of(address, plugin))
    check_writable(json)
    if move:
        typer.confirm(
            "The actuator will move by 0.3 mm. The STOP button of the page does not work during this check. Is the "
            "machine clear, and is somebody at its red button?",
            abort=True,
        )

    def connect(limits: TesterLimits) -> AbstractContextManager[Tester]:
        return connect_tester(address, limits, tester_map=tester_map, without=without or ())

    with tester_held(settings, address):
        checks = check_tester(connect, move=move)
    _show(checks, address, json)


def _show(checks: Sequence[Check], address: str, json: Path | None) -> None:
    for check in checks:
        out.print(check_text(check), style=COLOURS[check.state])
    counts = {state: sum(check.state is state for check in checks) for state in CheckState}
    out.print(", ".join(f"{count} {state}" for state, count in counts.items()))
    if json is not None:
        document = {
            "format": "jointlab-conformance/1",
            "address": address,
            "software": software_version(),
            "checks": [asdict(check) for check in checks],
        }
        write_json(document, json)
    if verdict_of(tuple(checks)) is Verdict.FAILED:
        raise typer.Exit(INSTRUMENT)
