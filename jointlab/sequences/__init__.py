"""The sequences that are always there: the paper's, and that of the suspended beam."""

from __future__ import annotations

from importlib import resources

from rig.sequence import Sequence, load_sequence

BUILT_IN = "paper"
SUSPENDED = "suspended"
NAMES = (BUILT_IN, SUSPENDED)


def built_in(name: str) -> Sequence:
    """One of `NAMES`.

    Raises:
        SequenceError: the document cannot be run as it stands.
    """
    with resources.as_file(resources.files(__name__) / f"{name}.yaml") as path:
        return load_sequence(path)
