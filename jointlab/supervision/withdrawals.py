"""Withdrawals of blows: in the catalogue, and in the session that is still running."""

import logging
from collections.abc import Callable

from jointlab.drive.endpoint import NoDriveError
from jointlab.drive.protocol import Withdraw
from jointlab.errors import ConflictError
from store.catalogue import Catalogue
from store.measurements.blows import Blow, get_blow, list_blows, withdraw_blow
from store.measurements.runs import get_run
from store.states import RunState

REPEATED = "the point is measured again"
"""Why the blows of a point that is repeated do not count; stored with each of them."""
log = logging.getLogger(__name__)


class Withdrawals:
    """Withdraws blows that a catalogue has; `ask` tells the drive process."""

    def __init__(self, catalogue: Catalogue, ask: Callable[[Withdraw], object]) -> None:
        self._catalogue = catalogue
        self._ask = ask

    def withdraw(self, blow_id: int, reason: str, who: str) -> Blow:
        """Withdraw an accepted blow; a session that is still running asks for one more blow at its point.

        Raises ConflictError where the blow does not count already, NotFoundError where there is no such blow.
        """
        with self._catalogue.writing() as session:
            blow = get_blow(session, blow_id)
            if not blow.accepted:
                raise ConflictError(f"blow {blow_id} does not count already: {blow.reason}")
            withdrawn = withdraw_blow(session, blow_id, reason, who)
        self._tell(withdrawn, reason)
        return withdrawn

    def repeat_point(self, run_id: int, set_number: int, point: str, who: str) -> int:
        """Withdraw all accepted blows at a point; the session repeats it, now or when the run is resumed.

        Returns:
            The number of blows withdrawn.

        Raises:
            ConflictError: the run is finished, or no blow counts there.
            NotFoundError: there is no such run.
        """
        with self._catalogue.writing() as session:
            if get_run(session, run_id).state is RunState.FINISHED:
                raise ConflictError(f"run {run_id} is finished; measure {point} again as a run of its own")
            struck = [blow for blow in list_blows(session, run_id) if blow.accepted and str(blow.point) == point]
            own = [blow for blow in struck if blow.set_number == set_number]
            if not own:
                raise ConflictError(f"no blow counts at {point} in set {set_number} of run {run_id}; strike it")
            for blow in own:
                assert blow.id is not None, "a stored blow has a number"
                withdraw_blow(session, blow.id, REPEATED, who)
        for blow in own:
            self._tell(blow, REPEATED)
        return len(own)

    def _tell(self, blow: Blow, reason: str) -> None:
        assert blow.run_id is not None, "a stored blow belongs to a run"
        request = Withdraw(
            run_id=blow.run_id, set_number=blow.set_number, point=str(blow.point), blow=blow.number, reason=reason
        )
        try:
            self._ask(request)
        except NoDriveError as error:
            log.warning("no session was told of a withdrawn blow: %s", error)
