"""A simulated laboratory as configuration and as operator: in place of cables and a technician."""

from __future__ import annotations

from datetime import date
from typing import Any

from analysis.dof import Dof
from jointlab.errors import JointlabError
from jointlab.settings import ChannelSettings, Settings
from rig.errors import RequestError
from rig.events import Event, HammerStarted
from rig.operator import Operator
from simlab.laboratory import Addresses, LaboratoryProcess
from simlab.operator_server import OperatorClient

# The channel table of the simulated laboratory, as its calibration certificates would read.
CHANNELS = (
    ChannelSettings(
        name="hammer",
        physical="cDAQ1Mod1/ai0",
        kind="force_iepe",
        sensitivity=2.25e-3,
        unit="N",
        minimum=-2000,
        maximum=2000,
        excitation_current=0.002,
        serial="SIM-H-01",
        calibrated_on=date(2026, 3, 2),
    ),
    ChannelSettings(
        name="accelerometer",
        physical="cDAQ1Mod1/ai1",
        kind="acceleration_iepe",
        sensitivity=10.2e-3,
        unit="m/s^2",
        minimum=-480,
        maximum=480,
        excitation_current=0.002,
        serial="SIM-A-01",
        calibrated_on=date(2026, 3, 2),
    ),
    ChannelSettings(
        name="displacement",
        physical="cDAQ1Mod2/ai0",
        kind="voltage",
        sensitivity=2e3,
        unit="m",
        minimum=-5e-3,
        maximum=5e-3,
        serial="SIM-D-01",
        calibrated_on=date(2026, 3, 5),
    ),
    ChannelSettings(
        name="force",
        physical="cDAQ1Mod2/ai1",
        kind="voltage",
        sensitivity=2e-3,
        unit="N",
        minimum=-5000,
        maximum=5000,
        serial="SIM-F-01",
        calibrated_on=date(2026, 3, 5),
    ),
)


def simulated_settings(addresses: Addresses, **others: Any) -> Settings:
    """Settings whose instruments are the simulated ones; `others` are further fields of `Settings`.

    Neither the environment nor jointlab.toml is asked: what is simulated stays apart from the laboratory's own.
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

    def _do(self, action: str, **arguments: Any) -> None:
        try:
            self._client.do(action, **arguments)
        except ValueError as error:
            raise RequestError(f"the simulated bench refuses: {error}") from error
        except OSError as error:
            raise RequestError(f"the simulated laboratory does not answer: {error}") from error


def as_toml(addresses: Addresses) -> str:
    """A configuration file that points at the simulated instruments, and shows how to point at real ones."""
    lines = [
        '# Instruments of a simulated laboratory. For real ones: daq_address = "local", the tester\'s and the',
        "# thermometer's own addresses, and the channel table from your calibration certificates.",
        f'daq_address = "{addresses.daq}"',
        f'tester_url = "{addresses.tester}"',
        f'thermometer_url = "{addresses.thermometer}"',
    ]
    for channel in CHANNELS:
        lines += ["", "[[channels]]"]
        for name, value in channel.model_dump(mode="json").items():
            lines.append(f"{name} = {value}" if isinstance(value, float) else f'{name} = "{value}"')
    return "\n".join(lines) + "\n"
