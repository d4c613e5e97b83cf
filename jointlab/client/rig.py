"""Requests for the rig and its alarms."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from urllib.parse import quote

from jointlab.client.connection import Connection, RigEvent
from jointlab.client.driving import Driver
from jointlab.documents.alarms import AlarmDocument
from jointlab.documents.rig import HallRigDocument, Limits, RigDocument, RigStopped, Stopped


class RigRequests:
    """The rig, its limits, STOP and alarms."""

    _connection: Connection

    def rig(self) -> RigDocument:
        """The state of the rig."""
        return self._connection.get(RigDocument, "/rig")

    def stop(self) -> int | None:
        """STOP: end the present run; its number, None where there is none. It needs neither key nor lease.

        On return the actuator is at rest, where the rig drives a tester.
        """
        return self._connection.post(Stopped, "/rig/stop").run_id

    def rigs(self) -> list[HallRigDocument]:
        """The rigs that the service shows, as their own drive processes say it."""
        return list(self._connection.pages(HallRigDocument, "/rigs"))

    def stop_rig(self, name: str) -> None:
        """STOP for one of `rigs`; on return an actuator that it drives is at rest. It needs neither key nor lease."""
        self._connection.post(RigStopped, f"/rigs/{quote(name)}/stop")

    @contextmanager
    def driving(self, holder: str, *, by_force: bool = False) -> Iterator[Driver]:
        """Hold the control lease while the context lasts.

        Args:
            holder: name that others are shown.
            by_force: take it over, from another client of the same key or, with the scope engineer, from any client.
        """
        driver = Driver(self._connection, holder, by_force=by_force)
        try:
            yield driver
        finally:
            driver.give_back()

    def limits(self) -> Limits:
        """The rig's limits in force."""
        return self._connection.get(Limits, "/rig/limits")

    def set_limits(self, limits: Limits) -> Limits:
        """Set the rig's limits for runs that begin from now on; needs the scope engineer."""
        return self._connection.put(Limits, "/rig/limits", limits.model_dump())

    def events(self, last_event_id: str | None = None) -> AbstractContextManager[Iterator[RigEvent]]:
        """Events of the rig from now on, or after the event with this id."""
        return self._connection.events("/rig/events", last_event_id)

    def alarms(self, standing: bool | None = None) -> Iterator[AlarmDocument]:
        """Alarms, newest first: all, or those that nobody has acknowledged (`standing`), or the others."""
        return self._connection.pages(AlarmDocument, "/alarms", standing=standing)

    def acknowledge_alarm(self, alarm: int, note: str | None = None) -> AlarmDocument:
        """Say that somebody has seen an alarm; needs the scope control:rig."""
        return self._connection.post(AlarmDocument, f"/alarms/{alarm}/acknowledge", {"note": note})

    def test_alarms(self) -> AlarmDocument:
        """Raise an alarm that is a test; needs the scope admin."""
        return self._connection.post(AlarmDocument, "/alarms/test")
