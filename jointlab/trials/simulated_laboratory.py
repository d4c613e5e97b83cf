"""A simulated laboratory and its configuration."""

import json
from datetime import date
from pathlib import Path
from typing import Any

from jointlab.errors import JointlabError
from jointlab.settings import ChannelSettings, Settings
from rig.instruments import EXTERNAL
from simlab.laboratory import Addresses, LaboratoryProcess

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
