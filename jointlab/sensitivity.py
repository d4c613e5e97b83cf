"""Sensitivities as certificates give them: `100 mV/g`, `2.25 mV/N`, `10.2 mV/(m/s^2)`, `2 V/mm`."""

import re

from daq.task import STANDARD_GRAVITY

VOLTS = {"V": 1.0, "mV": 1e-3}
QUANTITIES = {
    "N": ("N", 1.0),
    "kN": ("N", 1e3),
    "g": ("m/s^2", STANDARD_GRAVITY),
    "m/s^2": ("m/s^2", 1.0),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
}
"""By the name of a unit its SI unit, and how much of that it is."""
_FORM = re.compile(r"([0-9]*\.?[0-9]+(?:[eE][+-]?[0-9]+)?)\s*(m?V)/\(?([A-Za-z]+(?:/s(?:\^?2|²))?)\)?")


def sensitivity_in_si(text: str, unit: str) -> float:
    """V for each `unit` of a sensitivity with its unit; ValueError where it has none, or is of another quantity."""
    match = _FORM.fullmatch(text.strip())
    name = "" if match is None else re.sub(r"s(2|²)$", "s^2", match[3])
    if match is None or name not in QUANTITIES:
        raise ValueError(f"{text!r} is no sensitivity; write 100 mV/g, 2.25 mV/N, 10.2 mV/(m/s^2) or 2 V/mm")
    quantity, size = QUANTITIES[name]
    if quantity != unit:
        raise ValueError(f"{text!r} is of a sensor for {quantity}, but the unit of the channel is {unit}")
    return float(match[1]) * VOLTS[match[2]] / size


def sensitivity_text(sensitivity: float, unit: str) -> str:
    """A sensitivity in V for each SI `unit` as its certificate would give it."""
    match unit:
        case "m/s^2":
            return f"{1e3 * sensitivity * STANDARD_GRAVITY:.4g} mV/g"
        case "m":
            return f"{1e-3 * sensitivity:.4g} V/mm"
        case _:
            return f"{1e3 * sensitivity:.4g} mV/{unit}"
