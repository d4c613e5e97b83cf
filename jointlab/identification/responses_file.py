"""Accelerances of a UFF file for the modal estimation."""

from dataclasses import dataclass
from pathlib import Path

from analysis.frequency_response import FrequencyResponses
from jointlab.errors import JointlabError
from jointlab.identification.measurement import dof
from store.exchange.accelerance_file import Accelerances, read_accelerance_sets


@dataclass(frozen=True, eq=False)
class ResponsesOfFile:
    """One set for each accelerometer, and what has to be known with them, one sentence each."""

    sets: tuple[FrequencyResponses, ...]
    notes: tuple[str, ...]


def read_responses(path: Path, accelerometer: str | None = None) -> ResponsesOfFile:
    """Read the sets of a file, or only that of one accelerometer, such as ``3y``.

    Raises:
        StoreError: the file cannot be read as UFF, or holds no accelerances that belong together.
        JointlabError: there is no such accelerometer.
    """
    sets = read_accelerance_sets(path)
    kept = [each for each in sets if accelerometer in (None, str(each.response))]
    if not kept:
        have = ", ".join(str(each.response) for each in sets)
        raise JointlabError(f"{path.name} has no accelerometer at {accelerometer}; it has {have}")
    notes = dict.fromkeys(note for each in sets for note in each.warnings)
    return ResponsesOfFile(tuple(map(_responses, kept)), tuple(notes))


def _responses(read: Accelerances) -> FrequencyResponses:
    inputs = tuple(dof(point) for point in read.inputs)
    return FrequencyResponses(read.frequency, read.accelerance, dof(read.response), inputs, read.coherence)
