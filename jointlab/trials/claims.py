"""What a diagnosis document claims, in one form for documents with and without `effects`, `mechanisms`, `remainder`."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from jointlab.diagnosis.document import UNKNOWN, probability

MECHANISMS: dict[str, tuple[str, ...]] = {
    "joint_amplitude": ("amplitude_dependence", "cubic_stiffness", "coulomb_friction"),
    "joint_frequency": ("frequency_dependence", "loss_law"),
    "joint_state": ("temperature_shift", "preload_stiffening", "conditioning_drift"),
    "joint_geometry": ("support_position", "cylinder_angle", "vertical_offset", "contact_patch"),
    "attachment": ("joint_mass", "foundation_compliance"),
    "beam": ("youngs_modulus", "density", "beam_damping", "out_of_plane_bending", "accelerometer_mass", "mesh_error"),
    "blow": ("impact_angle", "impact_position", "double_hit"),
    "measuring_chain": (
        "sensor_gain",
        "channel_delay",
        "highpass_corner",
        "exponential_window",
        "cross_axis_sensitivity",
        "mains_hum",
    ),
    "tester": ("frame_compliance", "fixture_inertia", "frame_resonance", "transducer_lag"),
}
MECHANISM_OF = {effect: mechanism for mechanism, effects in MECHANISMS.items() for effect in effects}
CLAIMED = 0.5
"""Probability above which something counts as said."""


@dataclass(frozen=True)
class Interval:
    """A parameter's value with its 90 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Claims:
    """What one diagnosis says.

    Attributes:
        status, named, probability: of the verdict.
        included: probability of each effect that it is part of the explanation.
        mechanisms: probability of each mechanism.
        intervals: by effect and parameter.
        before, after, floor: held-out gap, percent; None where it was not found.
        rigs: the same before and after by rig.
        remainder: what the verdict leaves, percent; None where the document has none.
        faults: of the record.
    """

    status: str
    named: tuple[str, ...]
    probability: float
    included: dict[str, float]
    mechanisms: dict[str, float]
    intervals: dict[str, dict[str, Interval]]
    before: float | None
    after: float | None
    floor: float | None
    rigs: dict[str, tuple[float | None, float | None]]
    remainder: float | None
    faults: int

    @classmethod
    def of(cls, document: Mapping[str, Any]) -> "Claims":
        """The claims of a document."""
        verdict, gap = document["verdict"], document["gap"]
        named = tuple(sorted(verdict["effects"]))
        return cls(
            status=verdict["status"],
            named=named,
            probability=probability(document),
            included=_included(document),
            mechanisms=_mechanisms(document),
            intervals=_intervals(document, named),
            before=gap["before"]["percent"],
            after=gap["after"]["percent"],
            floor=gap["floor_percent"],
            rigs={rig: (each["before"], each["after"]) for rig, each in gap["by_rig"].items()},
            remainder=document["remainder"]["percent"] if document.get("remainder") else None,
            faults=len(document["faults"]),
        )

    @property
    def said(self) -> set[str]:
        """Effects that are named, or included with more than even odds."""
        return {*self.named, *(effect for effect, sure in self.included.items() if sure > CLAIMED)}

    @property
    def said_mechanisms(self) -> set[str]:
        """Mechanisms that are claimed with more than even odds, and those of the named effects."""
        claimed = {each for each, sure in self.mechanisms.items() if sure > CLAIMED}
        return claimed | {MECHANISM_OF[effect] for effect in self.named if effect in MECHANISM_OF}


def _included(document: Mapping[str, Any]) -> dict[str, float]:
    if "effects" in document:
        return {each["id"]: float(each["probability"]) for each in document["effects"] if each["id"] in MECHANISM_OF}
    found = dict[str, float]()
    for entry in document["ranking"]:
        for effect in set(entry["effects"]) - {UNKNOWN}:
            found[effect] = found.get(effect, 0.0) + entry["probability"]
    return found


def _mechanisms(document: Mapping[str, Any]) -> dict[str, float]:
    if "mechanisms" in document:
        return {each["mechanism"]: float(each["probability"]) for each in document["mechanisms"]}
    found = dict[str, float]()
    for entry in document["ranking"]:
        for mechanism in {MECHANISM_OF[effect] for effect in entry["effects"] if effect in MECHANISM_OF}:
            found[mechanism] = found.get(mechanism, 0.0) + entry["probability"]
    return found


def _intervals(document: Mapping[str, Any], named: tuple[str, ...]) -> dict[str, dict[str, Interval]]:
    """Of the named effects, from the explanation of the same effects; otherwise from the list of effects."""
    entries = [each["parameters"] for each in document["ranking"] if sorted(each["effects"]) == sorted(named)]
    listed = {each["id"]: each["parameters"] for each in document.get("effects", ())}
    source: Mapping[str, Any] = entries[0] if entries else listed
    return {
        effect: {
            name: Interval(each["value"], *each["ci90"])
            for name, each in source[effect].items()
            if None not in (each["value"], *each["ci90"])
        }
        for effect in named
        if effect in source
    }
