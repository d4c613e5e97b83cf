"""A channel as texts that a person reads and writes, each with the unit of its field, and back.

A field that nobody changed keeps its form in the file: "100 mV/g" stays as it is, and 2e3 is not rewritten as 2000.
"""

import re
from collections.abc import Callable, Mapping
from datetime import date
from decimal import Decimal
from functools import partial
from typing import Any

from pydantic import ValidationError

from daq.channels import UNITS, ChannelKind
from daq.errors import ChannelError
from jointlab.channel_file import Row
from jointlab.instruments import channel_of
from jointlab.sensitivity import QUANTITIES, plain_unit, unit_measured
from jointlab.settings import ChannelSettings
from store.validation import fault_of, place_of

Texts = Mapping[str, str]
"""By the name of a field of the form: what is in it."""
WHOLE = ""
"""In place of the name of a field: the fault is of several fields together."""
BRIDGE = ("excitation", "configuration", "resistance")
NEW: Texts = dict.fromkeys((*ChannelSettings.model_fields, *BRIDGE), "") | {
    "kind": ChannelKind.ACCELERATION_IEPE.value, "polarity": "1", "configuration": "full", "resistance": "350",
}  # fmt: skip
"""The fields of a channel that is not written yet."""
NEEDED = ("name", "physical", "sensitivity", "minimum", "maximum", "excitation")
QUANTITY_FIELDS = ("minimum", "maximum", "noise")
"""The fields in the unit of what the sensor measures."""
SHOWN_IN = {"m": ("mm", 3)}
"""By SI unit: the unit in which a quantity is shown, and how many powers of ten it is smaller."""
FIELD_UNITS = {"excitation_current": ("mA", 3), "uncertainty": ("%", 2), "excitation": ("V", 0), "resistance": ("Ω", 0)}
"""The same for fields whose unit does not depend on the sensor."""
EXAMPLES = {"N": "-2000 N or -2 kN", "m/s^2": "-450 m/s^2 or -50 g", "m": "-5 mm"}
_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
_QUANTITY = re.compile(rf"({_NUMBER})\s*([A-Za-z]+(?:/s(?:\^?2|²))?)")


def texts_of(row: Row) -> Texts:
    """The fields of a channel of the file. Raises ValidationError where it is not valid."""
    given = ChannelSettings.model_validate(row)
    written, quantity = row["sensitivity"], partial(_quantity_text, unit=given.unit)
    texts = {
        "name": given.name,
        "physical": given.physical,
        "kind": given.kind,
        "sensitivity": written if isinstance(written, str) else exact_sensitivity(given),
        "minimum": quantity(given.minimum),
        "maximum": quantity(given.maximum),
        "excitation_current": _shifted(given.excitation_current, 3) if given.excitation_current else "",
        "polarity": str(given.polarity),
        "serial": given.serial,
        "certificate": given.certificate,
        "calibrated_on": str(given.calibrated_on or ""),
        "due_on": str(given.due_on or ""),
        "uncertainty": "" if given.uncertainty is None else _shifted(given.uncertainty, 2),
        "noise": "" if given.noise is None else quantity(given.noise),
    }
    if given.bridge is not None:
        texts["excitation"] = _shifted(given.bridge.excitation, 0)
        texts["configuration"] = given.bridge.configuration
        texts["resistance"] = _shifted(given.bridge.resistance, 0)
    return {**NEW, **texts}


def exact_sensitivity(given: ChannelSettings) -> str:
    """The sensitivity of a channel with all its digits, in the unit of its input for each SI unit."""
    per = f"({given.unit})" if "/" in given.unit else given.unit
    match ChannelKind(given.kind).input_unit:
        case "V/V":
            return f"{_shifted(given.sensitivity, 3)} mV/V/{per}"
        case "C":
            return f"{_shifted(given.sensitivity, 12)} pC/{per}"
        case _:
            return f"{_shifted(given.sensitivity, 0)} V/{per}"


def row_of(texts: Texts, before: Row | None) -> tuple[Row, dict[str, str]]:
    """The row that the fields say, and what is wrong with it, by field or `WHOLE`; it is valid where nothing is.

    `before`: the row that they were filled with; None for a new channel.
    """
    known, stored = (NEW, {}) if before is None else (texts_of(before), {**before, **before.get("bridge", {})})
    kind = ChannelKind(texts["kind"])
    unit = UNITS.get(kind) or unit_measured(texts["sensitivity"]) or stored.get("unit", "m")
    made, faults = dict[str, Any](kind=texts["kind"], unit=unit), dict[str, str]()
    for name, read in _readers(unit).items():
        needed = name in NEEDED
        if not has_field(kind, name):
            if stored.get(name) == 0:  # a current that is written to be none
                made[name] = stored[name]
        elif (
            texts[name] == known[name]
            and (unit == stored.get("unit") or name not in QUANTITY_FIELDS)
            and (name in stored or not needed)
        ):
            made |= {name: stored[name]} if name in stored else {}
        elif text := texts[name].strip():
            try:
                made[name] = read(text)
            except ValueError as error:
                faults[name] = str(error)
        elif needed:
            faults[name] = "is missing"
    row = _in_order(made)
    return row, faults or _faults_of(row, unit)


def has_field(kind: ChannelKind, name: str) -> bool:
    """Whether a channel of this kind has the field `name`: an IEPE supply, or a bridge."""
    if name == "excitation_current":
        return kind.endswith("iepe")
    return kind is ChannelKind.FORCE_BRIDGE or name not in BRIDGE


def _in_order(made: Mapping[str, Any]) -> Row:
    bridge = {name: made[name] for name in BRIDGE if name in made}
    all_of_it = {**made, "bridge": bridge} if bridge else made
    return {name: all_of_it[name] for name in ChannelSettings.model_fields if name in all_of_it}


def _readers(unit: str) -> Mapping[str, Callable[[str], Any]]:
    """By field, the function that reads its text; it raises ValueError with words for a person."""
    quantity = partial(quantity_in_si, unit=unit)
    return {
        "name": str,
        "physical": str,
        "sensitivity": str,
        "minimum": quantity,
        "maximum": quantity,
        "excitation_current": partial(_number, shift=-3),
        "serial": str,
        "calibrated_on": _day,
        "certificate": str,
        "uncertainty": partial(_number, shift=-2),
        "due_on": _day,
        "polarity": int,
        "noise": quantity,
        "excitation": _number,
        "configuration": str,
        "resistance": _number,
    }


def _faults_of(row: Row, unit: str) -> dict[str, str]:
    """What is wrong with a row, in the units of the fields."""
    try:
        given = ChannelSettings.model_validate(row)
    except ValidationError as error:
        return {str(place_of(item)[-1]): fault_of(_in_field_unit(item, unit)) for item in error.errors()}
    if not given.minimum < given.maximum:
        return {"maximum": f"has to be more than the lowest value, {_quantity_text(given.minimum, unit)}"}
    try:
        channel_of(given)
    except ChannelError as error:
        return {WHOLE: str(error)}
    return {}


def _in_field_unit(item: Mapping[str, Any], unit: str) -> Mapping[str, Any]:
    """One of pydantic's errors with the numbers of its field in the unit that the field shows."""
    name = str(place_of(item)[-1])
    if name not in (*QUANTITY_FIELDS, *FIELD_UNITS):
        return item
    shown, shift = FIELD_UNITS.get(name) or SHOWN_IN.get(unit, (unit, 0))
    numbers = {key: float(_shifted(each, shift)) for key, each in item.get("ctx", {}).items()}
    return {**item, "input": float(_shifted(item["input"], shift)), "ctx": numbers | {"unit": shown}}


def quantity_in_si(text: str, unit: str) -> float:
    """A quantity with its unit, such as -5 mm, in SI. Raises ValueError where it is none in `unit`."""
    match = _QUANTITY.fullmatch(_plain(text))
    name = "" if match is None else plain_unit(match[2])
    if match is None or name not in QUANTITIES:
        raise ValueError(f"is {text!r}; write it with its unit, such as {EXAMPLES[unit]}")
    quantity, size = QUANTITIES[name]
    if quantity != unit:
        raise ValueError(f"is in {name}, but the sensor measures {unit}; write it as {EXAMPLES[unit]}")
    return float(Decimal(match[1]) * Decimal(str(size)))


def _quantity_text(value: float, unit: str) -> str:
    name, shift = SHOWN_IN.get(unit, (unit, 0))
    return f"{_shifted(value, shift)} {name}"


def _shifted(value: float, shift: int) -> str:
    """All digits of `value` times ten to the power `shift`, without an exponent."""
    return f"{Decimal(repr(float(value))).scaleb(shift).normalize():f}"


def _number(text: str, shift: int = 0) -> float:
    plain = _plain(text)
    if not re.fullmatch(_NUMBER, plain):
        raise ValueError(f"is {text!r}, which is no number such as 2 or 0.5")
    return float(Decimal(plain).scaleb(shift))


def _plain(text: str) -> str:
    """A number as Python reads it. Raises ValueError for a comma, which may be one of decimals or of thousands."""
    if "," in text:
        raise ValueError(f"is {text!r}; write decimals with a point, and thousands without a comma")
    return text.replace("−", "-").strip()


def _day(text: str) -> date:
    try:
        return date.fromisoformat(text)
    except ValueError:
        raise ValueError(f"is {text!r}, which is no day such as 2026-03-31") from None
