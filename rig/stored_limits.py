"""The limits in force at a rig: those that were set last, or the ordinary ones."""

from __future__ import annotations

from dataclasses import asdict, replace

from rig.errors import RigError
from rig.instruments import Instruments
from rig.tester_limits import TesterLimits
from store.catalogue import Catalogue
from store.rig_limits import rig_limits, save_rig_limits


def kept_limits(catalogue: Catalogue, rig: str) -> TesterLimits | None:
    """The limits that were set last for `rig`; None where nobody has set any.

    Raises:
        RigError: another version of this software has set limits that this one does not know.
        StoreError: the catalogue cannot be read.
    """
    with catalogue.reading() as session:
        kept = rig_limits(session, rig)
    if kept is None:
        return None
    try:
        return TesterLimits(**kept)
    except TypeError as error:
        raise RigError(
            f"the limits that are kept for {rig!r} do not fit this version ({error}); install the version "
            "that set them, or give this rig another name"
        ) from error


def with_stored_limits(instruments: Instruments, catalogue: Catalogue) -> Instruments:
    """The instruments with the limits that were set for their rig, or as they are where nobody has set any.

    Raises:
        RigError, StoreError: as for `kept_limits`.
    """
    kept = kept_limits(catalogue, instruments.rig)
    return instruments if kept is None else replace(instruments, limits=kept)


def save_limits(instruments: Instruments, catalogue: Catalogue, limits: TesterLimits, who: str) -> Instruments:
    """The instruments with `limits`, which are in force from now on, also when the program is started anew.

    Raises:
        StoreError: they cannot be stored; the former ones stay in force.
    """
    with catalogue.writing() as session:
        save_rig_limits(session, instruments.rig, asdict(limits), who)
    return replace(instruments, limits=limits)
