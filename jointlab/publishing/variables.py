"""The variables of a rig for OPC UA: names, units and values. No input or output."""

from dataclasses import dataclass
from typing import Any

from jointlab.client.connection import RigEvent
from jointlab.documents.rig import RigDocument

Values = dict[str, str | int | float | bool | None]
"""Values by the name of their variable; None where there is none."""


@dataclass(frozen=True)
class Variable:
    """A variable.

    Attributes:
        name: in the address space.
        kind: of its values.
        description: for people.
        unit: as it is written; None where it has none.
        unit_code: of the unit, by UNECE Recommendation 20.
    """

    name: str
    kind: type[str | int | float | bool]
    description: str
    unit: str | None = None
    unit_code: str = ""


STATE_VARIABLES = (
    Variable("State", str, "what the rig does, such as idle or running"),
    Variable("Run", int, "the run that is carried out, or was last"),
    Variable("Step", str, "the present step of the run"),
    Variable("Progress", float, "accepted blows and sine points, of those wanted", "%", "P1"),
    Variable("Stop", bool, "whether STOP is in force"),
    Variable("Interlocks", str, "of the tester, that stopped it and were not acknowledged"),
)
EVENT_VARIABLES = (
    Variable("LastBlowPoint", str, "where the last accepted blow fell, such as 3y"),
    Variable("LastBlowForce", float, "peak force of the last accepted blow", "N", "NEW"),
    Variable("LastSineSpecimen", str, "of the last sine point"),
    Variable("LastSineAmplitude", float, "of the last sine point, peak to peak, as recorded", "mm", "MMT"),
    Variable("LastSineFrequency", float, "of the last sine point", "Hz", "HTZ"),
    Variable("LastStiffness", float, "k of the last sine point, before any correction of the tester", "N/m", "4P"),
    Variable("LastLossFactor", float, "gamma of the last sine point, before any correction of the tester", "1", "C62"),
)
VARIABLES = STATE_VARIABLES + EVENT_VARIABLES


def state_values(rig: RigDocument) -> Values:
    """Values of the state of a rig."""
    wanted = rig.blows_wanted + rig.sines_wanted
    return {
        "State": rig.phase.value,
        "Run": rig.run_id,
        "Step": rig.activity,
        "Progress": 100.0 * (rig.blows + rig.sines) / wanted if wanted else None,
        "Stop": rig.stop is not None,
        "Interlocks": ", ".join(rig.interlocks) or ("not named" if rig.tripped else ""),
    }


def event_values(event: RigEvent) -> Values:
    """Values that an event changes; none for most events."""
    values: dict[str, Any] = event.data
    match event.name:
        case "BlowAccepted":
            return {"LastBlowPoint": values["point"], "LastBlowForce": values["peak_force"]}
        case "SinePointMeasured":
            return {
                "LastSineSpecimen": values["specimen"],
                "LastSineAmplitude": values["reached_pp_mm"],
                "LastSineFrequency": values["frequency"],
                "LastStiffness": values["stiffness"],
                "LastLossFactor": values["loss_factor"],
            }
        case _:
            return {}
