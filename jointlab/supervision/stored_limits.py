"""The limits of a rig that an engineer has set, kept in the catalogue."""

import logging
from dataclasses import asdict, replace

from rig.errors import RigError
from rig.instruments import Instruments
from rig.tester.limits import HARD_CAPS, TesterLimits
from store.catalogue import Catalogue
from store.service.rig_limits import rig_limits, save_rig_limits

log = logging.getLogger(__name__)


def stored_limits(catalogue: Catalogue, rig: str) -> TesterLimits | None:
    """The limits that were set last for `rig`; None where none were set.

    Raises RigError where another version of this software has set limits that this one does not know, StoreError where
    the catalogue cannot be read.
    """
    kept = catalogue.read(rig_limits, rig)
    if kept is None:
        return None
    try:
        return TesterLimits(**{name: _capped(name, value) for name, value in kept.items()})
    except TypeError as error:
        raise RigError(
            f"the limits that are kept for {rig!r} do not fit this version ({error}); install the version "
            "that set them, or give this rig another name"
        ) from error


def _capped(name: str, value: float) -> float:
    """A limit from before there was a hard cap, at that cap: a rig has to start so that its limits can be set."""
    lowest, highest = HARD_CAPS.get(name, (value, value))
    if not lowest <= value <= highest:
        log.warning("stored limit %s is %g, only %g to %g may be set: the nearest holds", name, value, lowest, highest)
    return min(max(value, lowest), highest)


def with_stored_limits(instruments: Instruments, catalogue: Catalogue) -> Instruments:
    """The instruments with the limits that were set for their rig, or unchanged where none were set.

    Raises:
        RigError, StoreError: as for `stored_limits`.
    """
    kept = stored_limits(catalogue, instruments.rig)
    return instruments if kept is None else replace(instruments, limits=kept)


def save_limits(instruments: Instruments, catalogue: Catalogue, limits: TesterLimits, who: str) -> Instruments:
    """The instruments with `limits`, which are in force from now on, also after the program is restarted.

    Raises StoreError where they cannot be stored; the former ones stay in force.
    """
    with catalogue.writing() as session:
        save_rig_limits(session, instruments.rig, asdict(limits), who)
    return replace(instruments, limits=limits)
