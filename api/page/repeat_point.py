"""Repeating a point of a hammer session: within its run as long as that is not finished, else in a new run."""

from nicegui import ui

from api.page.controls import button, choice
from api.page.frame import Frame
from jointlab.supervision.hammer_progress import HammerProgress
from store.measurements.runs import get_run
from store.states import RunState


class RepeatPoint:
    """A list of the points with blows, and a button; two steps, so that an accidental touch does nothing."""

    def __init__(self, frame: Frame) -> None:
        self._frame = frame
        self._place = ui.element("div").classes("row-of")
        self._offered: tuple[object, ...] = ()
        self._chosen = ""

    def offer(self, found: HammerProgress) -> None:
        """Offer the points with accepted blows; the list is rebuilt only where they changed."""
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
            choice("Point to repeat", "repeat", offered, self._choose, self._chosen)
            button("Repeat this point", lambda: self._repeat(found.run.id, found.set_number))

    def _choose(self, point: str) -> None:
        self._chosen = point

    async def _repeat(self, run_id: int, set_number: int) -> None:
        point = self._chosen
        if await self._frame.read(lambda: self._is_finished(run_id)):
            ui.navigate.to(f"/measure?like={run_id}&points={point}&parts=hammer")  # NiceGUI puts /page before it
            return
        await self._frame.actions.drive(
            "repeat point",
            f"run {run_id}, {point}",
            lambda runs, caller, _: runs.withdrawals.repeat_point(run_id, set_number, point, caller.name),
        )

    def _is_finished(self, run_id: int) -> bool:
        with self._frame.services.catalogue.reading() as session:
            return get_run(session, run_id).state is RunState.FINISHED
