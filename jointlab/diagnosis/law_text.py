"""The law of the joints as a diagnosis found it, in words: how far stiffness and loss factor change, and over what."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jointlab.report.section import number

AXES = ("compression", "shear")
"""Of the cylinders, in the order in which they are said and drawn."""
NOTHING = 0.005
"""Per cent, below which a change is none."""
TURN = 0.1
"""Share of the whole change by which a law must go beyond both ends for that to be said."""


@dataclass(frozen=True)
class Coordinate:
    """How what a law depends on is said and drawn.

    Attributes:
        axis: label with unit.
        unit: of a place in words.
        scale: of that unit, from SI.
        log: whether places are spaced by their ratio.
    """

    axis: str
    unit: str
    scale: float = 1.0
    log: bool = False

    def words(self, place: float) -> str:
        """A place with its unit."""
        return f"{number(self.scale * place, 2)} {self.unit}"


COORDINATES = {
    "amplitude": Coordinate("amplitude (µm)", "µm", 1e6, log=True),
    "frequency": Coordinate("frequency (Hz)", "Hz", log=True),
    "order": Coordinate("share of the test that is done (%)", "% of the test", 100.0),
    "preload": Coordinate("preload (mm)", "mm", 1e3),
    "temperature": Coordinate("temperature above the tester's (K)", "K"),
}
"""By the name of what a law depends on."""


def laws_found(document: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Effects that have a law of the joints as it was found; none in diagnoses of earlier versions."""
    return [each for each in document.get("effects", ()) if each.get("law_found")]


def effect_name(effect: Mapping[str, Any], titles: Mapping[str, str]) -> str:
    """An effect in words, its id where it has none."""
    return titles.get(effect["id"], effect["id"])


def law_sentences(document: Mapping[str, Any]) -> list[str]:
    """A sentence for each law: "joint stiffness falls by 18 % (90 %: 15 to 21) from 1 to 10 µm"."""
    titles = document["titles"]
    return [f"{effect_name(each, titles)}: {law_sentence(each)}" for each in laws_found(document)]


def law_sentence(effect: Mapping[str, Any]) -> str:
    """How the joints follow the law of one effect, and the law by its name."""
    law = effect["law_found"]
    closest = law["closest_law"]
    name = f"closest known law: {closest}" if closest else f"law: {effect['law']}"
    stiffness, loss = (_by_axis(law, quantity) for quantity in ("stiffness", "loss_ratio"))
    return f"joint stiffness {stiffness} {_range(law)}; loss factor {loss}; {name}"


def _range(law: Mapping[str, Any]) -> str:
    first, last = law["at"][0], law["at"][-1]
    coordinate = COORDINATES[law["over"]]
    match law["over"]:
        case "order":
            return "from the first to the last point of the test"
        case "preload":
            return f"from no preload to {coordinate.words(last)}"
        case "temperature" if last > 0.0:
            return f"from the tester's temperature to {coordinate.words(last)} above it"
        case "temperature":
            return f"from {coordinate.words(-first)} below the tester's temperature to it"
        case _:
            return f"from {number(coordinate.scale * first, 2)} to {coordinate.words(last)}"


def _by_axis(law: Mapping[str, Any], quantity: str) -> str:
    """The change of a quantity over its range along both axes, once where the same words say it."""
    (verb, one), (other_verb, other) = (_change(law, law[axis][quantity]) for axis in AXES)
    if (verb, one) == (other_verb, other):
        return f"{verb} {one}"
    second = other if verb == other_verb else f"{other_verb} {other}"
    return f"{verb} {one} in {AXES[0]} and {second} in {AXES[1]}"


def _change(law: Mapping[str, Any], band: Mapping[str, Any]) -> tuple[str, str]:
    """Verb and object: the change from the first place, where a quantity is one, to the last, and where it turns."""
    change, low, high = (100 * (end[-1] - 1) for end in (band["value"], *band["ci90"]))
    turns = _turns(law, band)
    if max(-low, high) < NOTHING:
        return "stays", f"the same{turns}"
    if low <= 0.0 <= high:
        return "changes", f"by {_with_interval(change, low, high)}{turns}"
    if change < 0.0:
        return "falls", f"by {_with_interval(-change, -high, -low)}{turns}"
    return "rises", f"by {_with_interval(change, low, high)}{turns}"


def _with_interval(value: float, low: float, high: float) -> str:
    """Per cent with an interval, to as many decimals as its width needs."""
    decimals = 0 if high - low >= 2.0 else 1 if high - low >= 0.2 else 2
    middle, *ends = (f"{round(each, decimals) + 0.0:.{decimals}f}" for each in (value, low, high))
    return f"{middle} % (90 %: {' to '.join(ends)})"


def _turns(law: Mapping[str, Any], band: Mapping[str, Any]) -> str:
    """Where a law goes beyond both ends of its range for certain, its highest and lowest place; else empty."""
    coordinate = COORDINATES[law["over"]]
    value, (low, high) = np.array(band["value"]), np.array(band["ci90"])
    least = TURN * float(np.ptp(value))
    found = list[str]()
    for word, signed, nearest in (("highest", value, low), ("lowest", -value, -high)):
        place = int(np.argmax(signed))
        ends = max(signed[0], signed[-1])
        if signed[place] > ends + least and nearest[place] > ends:
            found.append(f"{word} at {coordinate.words(law['at'][place])}: {100 * (value[place] - 1):+.2g} %")
    return f" ({', '.join(found)})" if found else ""


def places(law: Mapping[str, Any]) -> Sequence[float]:
    """Places of a law in the unit of its axis."""
    scale = COORDINATES[law["over"]].scale
    return [scale * each for each in law["at"]]
