"""Instruments: examinations of the rig, and its channels with one of them live."""

from collections.abc import Mapping

from api.page.frame import Frame
from api.page.instruments import channels, examinations
from api.page.markup import show, tabs

EXAMINATIONS, CHANNELS = "Examinations", "Channels"


async def build(frame: Frame, query: Mapping[str, str]) -> None:
    """Build the part that the address names."""
    part = CHANNELS if query.get("part") == CHANNELS else EXAMINATIONS
    show(tabs("parts", {name: f"/page/instruments?part={name}" for name in (EXAMINATIONS, CHANNELS)}, part))
    await (channels if part == CHANNELS else examinations).build(frame, query)
