"""To do a point of a hammer session anew: within its run as long as that is not finished, else as a run of its own."""

from __future__ import annotations

from nicegui import ui

from api.page.controls import button, choice
from api.page.frame import Frame
from api.page.hammer_session import HammerSession
from store.runs import get_run
from store.states import RunState


class Redo:
    """A list of the points that have blows, and a button; two presses, so that a glove on its own does nothing."""

    def __init__(self, frame: Frame) -> None:
        self._frame = frame
        self._place = ui.element("div").classes("row-of")
        self._offered: tuple[object, ...] = ()
        self._chosen = ""

    def offer(self, found: HammerSession) -> None:
        """Offer the points that have blows which count; anew only where they are others than before."""
        points = [point for point, (done, _) in found.counts.items() if done]
        now = (found.run.id, found.set_number, *points)
        if now == self._offered:
            return
        self._offered = now
        self._place.clear()
        if not points:
            return
        if self._chosen not in points:
            self._chosen = points[-1]
        with self._place:
            offered = {point: point for point in points}
            choice("A point to do again", "redo", offered, self._choose, self._chosen)
            button("Do this point again", lambda: self._again(found.run.id, found.set_number))

    def _choose(self, point: str) -> None:
        self._chosen = point

    async def _again(self, run_id: int, set_number: int) -> None:
        point = self._chosen
        if await self._frame.read(lambda: self._is_finished(run_id)):
            ui.navigate.to(f"/measure?like={run_id}&points={point}&parts=hammer")  # NiceGUI puts /page before it
            return
        await self._frame.deeds.drive(
            "redo point",
            f"run {run_id}, {point}",
            lambda runs, caller: runs.repeat_point(run_id, set_number, point, caller.name),
        )

    def _is_finished(self, run_id: int) -> bool:
        with self._frame.services.catalogue.reading() as session:
            return get_run(session, run_id).state is RunState.FINISHED
