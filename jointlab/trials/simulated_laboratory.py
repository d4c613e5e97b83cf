"""A simulated laboratory: its configuration, and an operator in place of a technician."""

import json
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from datetime import date
from pathlib import Path
from typing import Any

from analysis.dof import Dof
from jointlab.errors import JointlabError
from jointlab.settings import ChannelSettings, Settings
from rig.errors import RequestError
from rig.events import Event, HammerStarted
from rig.instruments import EXTERNAL
from rig.operator import Operator
from simlab.laboratory import Addresses, LaboratoryProcess
from simlab.operator_server import OperatorClient

CHANNELS = tuple(
    ChannelSettings.model_validate(
        {
            "name": name,
            "physical": f"cDAQ1{physical}",
            "kind": kind,
            "sensitivity": sensitivity,
            "unit": unit,
            "minimum": -limit,
            "maximum": limit,
            "excitation_current": current,
            "serial": serial,
            "calibrated_on": date(2026, 3, day),
            "noise": noise,
        }
    )
    for name, physical, kind, sensitivity, unit, limit, current, serial, day, noise in (
        ("hammer", "Mod1/ai0", "force_iepe", 2.25e-3, "N", 2000, 0.002, "SIM-H-01", 2, 0.02),
        ("accelerometer", "Mod1/ai1", "acceleration_iepe", 10.2e-3, "m/s^2", 480, 0.002, "SIM-A-01", 2, 0.008),
        ("displacement", "Mod2/ai0", "voltage", 2e3, "m", 5e-3, 0.0, "SIM-D-01", 5, 3e-8),
        ("force", "Mod2/ai1", "voltage", 2e-3, "N", 5000, 0.0, "SIM-F-01", 5, 0.05),
    )
)
"""The channel table of the simulated laboratory, with values as of calibration certificates."""


def simulated_settings(addresses: Addresses, **others: Any) -> Settings:
    """Settings whose instruments are the simulated ones; `others` are further fields of `Settings`.

    Neither the environment nor jointlab.toml is read: the simulated laboratory stays apart from the real one.
    """
    return Settings.model_construct(
        daq_address=addresses.daq,
        tester_url=addresses.tester,
        thermometer_url=addresses.thermometer,
        channels=CHANNELS,
        **others,
    )


def simulated_laboratory(seed: int, speed: float, kind: str | None = None) -> LaboratoryProcess:
    """A simulated laboratory in a process of its own; `kind` is that of a sealed case to stand in it, such as single.

    Raises:
        JointlabError: it did not start.
    """
    try:
        return LaboratoryProcess(seed, speed, kind=kind)
    except RuntimeError as error:
        raise JointlabError(str(error)) from error


class SimulatedOperator(Operator):
    """An operator who strikes and mounts on the simulated bench the moment a sequence asks for it."""

    def __init__(self, operator: OperatorClient) -> None:
        self._client = operator
        self._peak_force: float | None = None

    def observe(self, event: Event) -> None:
        """Strike as hard as the hammer step asks for."""
        if isinstance(event, HammerStarted):
            self._peak_force = event.peak_force

    def strike(self, point: Dof, blow: int) -> None:  # noqa: ARG002 - an operator is told the count and may not care
        """Strike `point`.

        Raises:
            RequestError: no hammer reaches that point of the bench.
        """
        self._do("strike", node=point.node, direction=point.direction.value, peak_force=self._peak_force)

    def mount(self, specimen: str, configuration: str) -> None:
        """Put the cylinders of joint `specimen` into the tester.

        Raises:
            RequestError: the bench has no such specimen or configuration.
        """
        self._do("mount", specimen=specimen, configuration=configuration)

    def run_points(self, preset: float, points: Sequence[tuple[float, float]]) -> None:
        """Let the simulated machine's own software run `points`; RequestError where it does not answer."""
        self._do("run_points", preset=preset, points=list(points))

    def do_task(self, text: str) -> None:  # noqa: ARG002 - whatever it is, nothing moves meanwhile
        """Bring a machine that runs by its own software to rest."""
        self._do("rest")

    def _do(self, action: str, **arguments: Any) -> None:
        try:
            self._client.do(action, **arguments)
        except ValueError as error:
            raise RequestError(f"the simulated bench refuses: {error}") from error
        except OSError as error:
            raise RequestError(f"the simulated laboratory does not answer: {error}") from error


@contextmanager
def operator_at(address: str | None) -> Iterator[SimulatedOperator | None]:
    """The operator of a simulated bench at "host:port", while the context lasts; None where there is no address.

    Raises:
        JointlabError: nobody answers there.
    """
    if address is None:
        yield None
        return
    try:
        client = OperatorClient(address)
    except (OSError, ValueError) as error:
        raise JointlabError(
            f"simulated_operator {address}: nobody answers ({error}); start jointlab simulate, or take the line out of "
            "jointlab.toml"
        ) from error
    with closing(client):
        yield SimulatedOperator(client)


def as_toml(
    addresses: Addresses, *, strikes: bool = False, tester_map: Path | None = None, external: bool = False
) -> str:
    """A configuration file that points at the simulated instruments, and shows how to point at real ones.

    `strikes`: whether the simulated bench strikes and mounts by itself; `tester_map`: of a tester with other registers;
    `external`: whether its tester is not driven.
    """
    lines = [
        '# Instruments of a simulated laboratory. For real ones: daq_address = "local", the tester\'s and the',
        "# thermometer's own addresses, and the channel table from your calibration certificates.",
        f'daq_address = "{addresses.daq}"',
        f'tester_url = "{EXTERNAL if external else addresses.tester}"',
        f'thermometer_url = "{addresses.thermometer}"',
    ]
    if tester_map is not None:
        lines.append(f"tester_map = {json.dumps(str(tester_map))}")
    if strikes:
        lines.append(f'simulated_operator = "{addresses.operator}"  # strikes and mounts; a real bench has none')
    for channel in CHANNELS:
        lines += ["", "[[channels]]"]
        for name, value in channel.model_dump(mode="json", exclude_none=True).items():
            lines.append(f"{name} = {value}" if isinstance(value, int | float) else f'{name} = "{value}"')
    return "\n".join(lines) + "\n"
