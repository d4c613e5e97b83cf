"""Channels: the table that the next run is measured with, and the one that a run was measured with."""

from __future__ import annotations

from datetime import date
from typing import Annotated

from fastapi import APIRouter
from pydantic import BaseModel, Field

from api.service.access import Reader
from api.service.context import Context, Rig
from api.service.documents import RunNumber
from api.service.etags import TaggedRoute
from api.service.pages import Cursor, Limit, Page, page_of_whole
from api.service.problems import problems
from rig.instruments import stored_channel
from store.instruments import StoredChannel, list_channels
from store.quantity import quantity
from store.runs import get_run

router = APIRouter(tags=["channels"], route_class=TaggedRoute)


class ChannelDocument(BaseModel):
    """One input, what hangs on it, and when that was calibrated."""

    name: str
    physical: str = Field(description="NI-DAQmx physical channel, such as cDAQ1Mod1/ai0")
    kind: str
    unit: str = Field(description="of minimum and maximum")
    sensitivity: float = Field(description="V for each `unit`")
    minimum: float = Field(description="lowest value expected, in `unit`")
    maximum: float = Field(description="highest value expected, in `unit`")
    excitation_current: Annotated[float | None, quantity("A", "IEPE supply")]
    serial: str
    calibrated_on: date | None

    @classmethod
    def of(cls, channel: StoredChannel) -> ChannelDocument:
        """What is shown of a channel."""
        same = set(cls.model_fields) - {"serial", "calibrated_on"}
        return cls(
            **{name: getattr(channel, name) for name in same},
            serial=channel.instrument.serial,
            calibrated_on=channel.instrument.calibrated_on,
        )


@router.get("/channels", responses=problems(401, 403, 409))
def configured(_who: Reader, rig: Rig, limit: Limit = 100, cursor: Cursor = None) -> Page[ChannelDocument]:
    """The channel table that the next run is measured with; it comes from the configuration."""
    table = [ChannelDocument.of(stored_channel(channel)) for channel in rig.instruments.channels]
    return page_of_whole(table, limit, cursor)


@router.get("/runs/{run_id}/channels", responses=problems(401, 403, 404))
def of_run(
    _who: Reader, context: Context, run_id: RunNumber, limit: Limit = 100, cursor: Cursor = None
) -> Page[ChannelDocument]:
    """The channels of a run as they were set, by name."""
    with context.catalogue.reading() as session:
        get_run(session, run_id)
        found = list_channels(session, run_id)
    return page_of_whole([ChannelDocument.of(channel) for channel in found], limit, cursor)
