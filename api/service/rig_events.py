"""The events of the rig in the schema: the data that each kind of server-sent event has."""

from dataclasses import fields
from datetime import datetime
from inspect import getdoc
from typing import Annotated, Any, get_type_hints

from pydantic import BaseModel, Field, create_model

from analysis.dof import Dof
from jointlab.drive.events import EVENTS, PromptKind
from rig.events import Event
from rig.registers import Interlock
from store.states import RunState

PLAIN_TYPES: dict[object, object] = {
    Dof: Annotated[str, Field(description="node and direction, such as 3y")],
    Interlock: tuple[str, ...],
    PromptKind: str,
    RunState: str,
}
"""How a field of an event appears in the data of a server-sent event, where that is another type."""


def model_of(kind: type[Event]) -> type[BaseModel]:
    """The data of an event of this kind: when it happened, UTC, and the fields of the event."""
    hints = get_type_hints(kind, include_extras=True)
    described: dict[str, Any] = {
        field.name: (PLAIN_TYPES.get(hints[field.name], hints[field.name]), ...) for field in fields(kind)
    }
    return create_model(kind.__name__, __doc__=kind.__doc__, at=(datetime, ...), **described)


def described_events() -> dict[str, Any]:
    """For the `responses` of the stream: one alternative for each kind of event."""
    alternatives = [
        {
            "title": kind.__name__,
            "description": getdoc(kind),
            "properties": {
                "event": {"const": kind.__name__},
                "data": {"contentMediaType": "application/json", "contentSchema": model_of(kind).model_json_schema()},
            },
        }
        for kind in EVENTS.values()
    ]
    return {"content": {"text/event-stream": {"itemSchema": {"oneOf": alternatives}}}}
