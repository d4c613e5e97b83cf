"""One process at a time drives a rig: whoever stops it stops whatever it does.

The lock is beside the waveforms, which every program of one store can write to.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from store.catalogue import Catalogue
from store.errors import StoreError
from store.process_lock import HeldElsewhereError, held_alone
from store.provenance import who_is_here


class RigBusyError(StoreError):
    """Another living process drives the rig."""


@contextmanager
def driving_alone(catalogue: Catalogue, rig: str) -> Iterator[None]:
    """Be the one process of this store that drives `rig` while the context lasts.

    Raises:
        RigBusyError: another living process does; it is named.
        StoreError: the folder beside the waveforms cannot be written.
    """
    folder = catalogue.waveforms.folder
    path = folder.with_name(f"{folder.name}-{rig}.lock")
    holder = path.with_suffix(".holder")
    try:
        with held_alone(path):
            try:
                holder.write_text(who_is_here(), encoding="utf-8")
            except OSError as error:
                raise StoreError(f"{holder} cannot be written: {error.strerror or error}") from error
            yield
    except HeldElsewhereError as error:
        named = holder.read_text(encoding="utf-8") if holder.is_file() else "another process"
        raise RigBusyError(
            f"{rig!r} is driven by {named}; work there, or end it first (a second rig on this store needs a name of "
            "its own: rig in the configuration)"
        ) from error
