"""A simulated bench measures further on the same article, and its instruments read what is there."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.gap.experiments.catalogue import Experiment
from analysis.gap.experiments.joined_measurements import together
from analysis.gap.experiments.next_experiment import NextExperiment
from analysis.gap.measurement import Measurement
from jointlab.diagnosis.investigation import Asked, Data, Readings, Refused
from jointlab.diagnosis.load import subject_of_bundle
from simlab.case.bundle import write_case
from simlab.case.draw import Case, CaseKind
from simlab.case.random_case import draw_random_case
from store.exchange.bundle import read_bundle
from tests.bench.sealed_bench import SealedBench


@pytest.fixture(scope="module")
def case() -> Case:
    """A bench with masses at its joints."""
    return draw_random_case(3, CaseKind.SINGLE, ["joint_mass"])


@pytest.fixture(scope="module")
def first(case: Case, tmp_path_factory: pytest.TempPathFactory) -> Measurement:
    folder = tmp_path_factory.mktemp("bench")
    write_case(case, folder)
    return read(folder)


def read(path: Path | str) -> Measurement:
    return subject_of_bundle(read_bundle(Path(path))).measurement


def asked(experiment: Experiment, **readings: str) -> Asked:
    return Asked(NextExperiment(experiment), "", {name.replace("__", "."): unit for name, unit in readings.items()})


def test_half_the_force_is_one_set_more_of_the_same_bench(case: Case, first: Measurement, tmp_path: Path) -> None:
    answer = SealedBench(case, tmp_path).carry_out(asked(Experiment.HALF_FORCE))
    assert isinstance(answer, Data)
    further = read(answer.source)
    assert further.points is None
    both = together(first, further)
    assert both.sets[-1].peak_force == min(each.peak_force for each in first.sets) / 2
    again, before = both.sets[-1], min(first.sets, key=lambda each: each.peak_force)
    change = np.linalg.norm(again.accelerance - before.accelerance) / np.linalg.norm(before.accelerance)
    assert 0 < change < 0.2  # a set-up and more noise, and no other article


def test_half_the_amplitude_is_measured_after_all_points_and_no_blow(
    case: Case, first: Measurement, tmp_path: Path
) -> None:
    answer = SealedBench(case, tmp_path).carry_out(asked(Experiment.HALF_AMPLITUDE))
    assert isinstance(answer, Data)
    further = read(answer.source)
    assert further.sets == ()
    assert further.points is not None
    assert first.points is not None
    assert further.points.amplitude == pytest.approx(np.min(first.points.amplitude) / 2)
    assert together(first, further).points is not None


def test_scales_read_a_mass_that_is_there_and_none_that_is_not(case: Case, tmp_path: Path) -> None:
    bench = SealedBench(case, tmp_path)
    answer = bench.carry_out(asked(Experiment.WEIGH_PARTS, joint_mass__m="kg", accelerometer_mass__m="kg"))
    assert isinstance(answer, Readings)
    (effect,) = case.effects
    assert answer.values["joint_mass.m"] == pytest.approx(effect.number("m"), abs=8e-3)
    assert answer.values["accelerometer_mass.m"] == pytest.approx(0.0, abs=2e-3)


def test_what_a_bench_cannot_do_is_refused(case: Case, tmp_path: Path) -> None:
    bench = SealedBench(case, tmp_path)
    assert isinstance(bench.carry_out(asked(Experiment.NEW_SET_UP)), Refused)
    nameless = SealedBench(replace(case, effects=(replace(case.effects[0], values={}),)), tmp_path)
    assert isinstance(nameless.carry_out(asked(Experiment.WEIGH_PARTS, joint_mass__m="kg")), Refused)
