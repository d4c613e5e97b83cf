"""An empty catalogue on both databases, and a whole simulated laboratory with a small sequence."""

from collections.abc import Callable

import pytest

from rig.instruments import Instruments
from rig.sequences.sequence import Sequence
from simlab.laboratory import Laboratory
from store.catalogue import Catalogue
from tests.jointlab.runs.site import Site
from tests.rig.conftest import (
    channel_table,
    document,
    instruments,
    person,
    repair,
    running_laboratory,
    sequence,
    whole_laboratory,
)
from tests.rig.person import Person
from tests.store.conftest import catalogue, distant_url, proxy

__all__ = [
    "catalogue",
    "channel_table",
    "distant_url",
    "document",
    "instruments",
    "person",
    "proxy",
    "repair",
    "running_laboratory",
    "sequence",
    "whole_laboratory",
]


@pytest.fixture
def site(
    sequence: Sequence, instruments: Instruments, catalogue: Catalogue, person: Person, whole_laboratory: Laboratory,
    repair: Callable[[], None],
) -> Site:  # fmt: skip
    return Site(sequence, instruments, catalogue, person, whole_laboratory, repair)
