"""The pool of a diagnosis: same results as without it, and nothing of it is left."""

import multiprocessing
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from analysis.gap.effects.attachment import JointMass
from analysis.gap.fitting.model import Model
from analysis.gap.search.single_effects import ParallelMap, search_of, serial_map
from jointlab.diagnosis.process_pool import processes
from tests.analysis.gap.conftest import blank, drawn

A_WHILE = 0.05  # s


def fitted(parallel_map: ParallelMap) -> Sequence[Model]:
    """The paper's model of a small bench and one effect on top of it."""
    measurement = blank(drawn()).thinned(8)
    search = search_of(measurement, JointMass.variants(measurement), parallel_map=parallel_map)
    none = search.fit_paper_model()
    return [none, *search.fitted(none, search.screened(none, search.candidates, always=1), 1)]


def noted(file: Path) -> None:
    time.sleep(A_WHILE)
    file.touch()


def test_processes_give_what_one_gives_to_the_last_digit() -> None:
    with processes(2) as parallel_map:
        shared = fitted(parallel_map)
    alone = fitted(serial_map)
    assert len(shared) > 1
    assert [each.effects for each in shared] == [each.effects for each in alone]
    for one, other in zip(shared, alone, strict=True):
        assert np.array_equal(one.fit.scores, other.fit.scores)
        assert one.log_evidence == other.log_evidence


def test_an_interrupted_diagnosis_drops_what_waits_and_leaves_no_process(tmp_path: Path) -> None:
    files = [tmp_path / str(number) for number in range(40)]

    def interrupted() -> None:
        with processes(2) as parallel_map:
            next(iter(parallel_map(noted, files)))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert not all(file.exists() for file in files)
    assert not multiprocessing.active_children()
