"""Sensitivities as certificates give them: `100 mV/g`, `2.25 mV/N`, `10.2 mV/(m/s^2)`, `2 V/mm`; of a load cell
`0.4 mV/V/kN`, and of sensors with charge output `4 pC/N`, `10 pC/(m/s^2)`.
"""

import re

from daq.channels import ChannelKind
from daq.task import STANDARD_GRAVITY
from store.instrument import StoredChannel

AT_INPUT = {"V": ("V", 1.0), "mV": ("V", 1e-3), "mV/V": ("V/V", 1e-3), "pC": ("C", 1e-12)}
"""By the name of a unit at the input its unit there (`ChannelKind.input_unit`), and how much of that it is."""
EXAMPLES = {
    "V": "100 mV/g, 2.25 mV/N, 10.2 mV/(m/s^2) or 2 V/mm",
    "V/V": "0.4 mV/V/kN or 0.0004 mV/V/N, which is 2 mV/V at 5 kN",
    "C": "4 pC/N, 100 pC/g or 10.2 pC/(m/s^2)",
}
QUANTITIES = {
    "N": ("N", 1.0),
    "kN": ("N", 1e3),
    "g": ("m/s^2", STANDARD_GRAVITY),
    "m/s^2": ("m/s^2", 1.0),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
}
"""SI unit and factor to it, by the name of a unit."""
_FORM = re.compile(r"([0-9]*\.?[0-9]+(?:[eE][+-]?[0-9]+)?)\s*(mV/V|m?V|pC)/\(?([A-Za-z]+(?:/s(?:\^?2|²))?)\)?")


def sensitivity_in_si(text: str, unit: str, at_input: str = "V") -> float:
    """A sensitivity with its unit as V, V/V or C, as `at_input` says, for each `unit`.

    Raises ValueError where it has no unit, or is of another kind of sensor.
    """
    match = _FORM.fullmatch(text.strip())
    name = "" if match is None else plain_unit(match[3])
    if match is None or name not in QUANTITIES or AT_INPUT[match[2]][0] != at_input:
        raise ValueError(f"{text!r} is no sensitivity of this kind of sensor; write {EXAMPLES[at_input]}")
    quantity, size = QUANTITIES[name]
    if quantity != unit:
        raise ValueError(f"{text!r} is of a sensor for {quantity}, but the unit of the channel is {unit}")
    return float(match[1]) * AT_INPUT[match[2]][1] / size


def plain_unit(name: str) -> str:
    """The name of a unit as `QUANTITIES` has it, also where it was written m/s² or m/s2."""
    return re.sub(r"s(2|²)$", "s^2", name)


def unit_measured(text: str) -> str | None:
    """The SI unit of what a sensor of the sensitivity `text` measures; None where `text` is no sensitivity."""
    match = _FORM.fullmatch(text.strip())
    return None if match is None else QUANTITIES.get(plain_unit(match[3]), (None, 0.0))[0]


def sensitivity_text(sensitivity: float, unit: str, at_input: str = "V") -> str:
    """A sensitivity in V, V/V or C, as `at_input` says, for each SI `unit`, as its certificate would give it."""
    if at_input == "V/V":
        return f"{1e6 * sensitivity:.4g} mV/V/k{unit}"
    scale, name = (1e12, "pC") if at_input == "C" else (1e3, "mV")
    match unit:
        case "m/s^2":
            return f"{scale * sensitivity * STANDARD_GRAVITY:.4g} {name}/g"
        case "m":
            return f"{1e-3 * sensitivity:.4g} V/mm"
        case _:
            return f"{scale * sensitivity:.4g} {name}/{f'({unit})' if '/' in unit else unit}"


def stored_sensitivity_text(channel: StoredChannel) -> str:
    """The sensitivity of a channel of a run as its certificate would give it; in volts where its kind is not known.

    A polarity that turns the sign is told beside it.
    """
    at_input = {kind.value: kind.input_unit for kind in ChannelKind}.get(channel.kind, "V")
    return sensitivity_text(channel.sensitivity, channel.unit, at_input) + ", inverted" * (channel.polarity == -1)
