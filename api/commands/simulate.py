"""`jointlab simulate`: the three simulated instruments, for a person or a program to connect to."""

import json
import time
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from api.commands.terminal import out
from jointlab.errors import JointlabError
from jointlab.trials.simulated_laboratory import as_toml
from simlab.laboratory import Laboratory
from simlab.ordinary import BenchConditions
from simlab.tester_frame import TesterFrame


def simulate(
    seed: Annotated[int, typer.Option(min=0, help="Which bench is drawn.")] = 1,
    speed: Annotated[float, typer.Option(min=0.01, max=1000, help="Bench time over wall time.")] = 1.0,
    config: Annotated[Path | None, typer.Option(help="Write a configuration file that points at them.")] = None,
    external: Annotated[
        bool, typer.Option("--external", help="Configure a tester that its own software drives, and nothing from here.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the addresses as one line of JSON.")] = False,
    frame_compliance: Annotated[float, typer.Option(min=0.0, max=1e-6, help="Of the tester, m/N.")] = 0.0,
    fixture_mass: Annotated[float, typer.Option(min=0.0, max=10.0, help="Of the tester, kg.")] = 0.0,
    channel_delay: Annotated[float, typer.Option(min=0.0, max=1e-2, help="Of its displacement, s.")] = 0.0,
    tester_map: Annotated[
        Path | None,
        typer.Option(
            exists=True,
            dir_okay=False,
            resolve_path=True,
            help="Start a tester with other registers, of which this map tells: docs/examples/tester_map.toml.",
        ),
    ] = None,
) -> None:
    """Start the simulated instruments, print their addresses and run until interrupted (Ctrl-C)."""
    frame = TesterFrame(frame_compliance, fixture_mass, channel_delay)
    conditions = BenchConditions(frame=frame)
    with Laboratory(seed, speed, conditions, other_tester=tester_map is not None) as laboratory:
        addresses = asdict(laboratory.addresses)
        if config is not None:
            write_new(config, as_toml(laboratory.addresses, strikes=True, tester_map=tester_map, external=external))
        if as_json:
            out.print(json.dumps(addresses))
        else:
            for name, address in (addresses | ({} if tester_map is None else {"tester_map": tester_map})).items():
                out.print(f"{name:<12} {address}")
            if external:
                out.print("The tester is external: only its displacement and force are seen, and it takes no commands.")
            out.print("Ctrl-C stops them.")
        try:
            while True:
                time.sleep(3600)
        except KeyboardInterrupt:
            out.print("stopped")


def write_new(path: Path, text: str) -> None:
    """Write a file that is not there yet.

    Raises:
        JointlabError: it is, or cannot be written.
    """
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError as error:
        raise JointlabError(f"{path} exists already; name a new file") from error
    except OSError as error:
        raise JointlabError(f"{path} cannot be written: {error.strerror or error}") from error
