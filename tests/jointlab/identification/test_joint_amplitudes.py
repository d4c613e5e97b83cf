"""The amplitude of the comparison is that which the blows caused, and every result says what it is known from."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.interval import quantile
from analysis.inverse.frequency_law import FrequencyLaw
from analysis.joint_amplitude import JointAmplitude
from jointlab.identification.document import identification_document
from jointlab.identification.fault_correction import correct_faults
from jointlab.identification.levels import amplitudes_of_set
from jointlab.identification.load import measurement_of_run
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.options import Options
from jointlab.identification.pipeline import Identification, identify
from store.catalogue import Catalogue

PEAK = "from the mean peak force of "


@pytest.fixture(scope="module")
def measurement(demo: Path) -> MeasuredArticle:
    with Catalogue.open(f"sqlite:///{demo / 'jointlab.db'}") as catalogue:
        return measurement_of_run(catalogue, 1)


def amplitudes(found: Identification, measurement: MeasuredArticle) -> dict[str, JointAmplitude]:
    assert found.inverse is not None
    nodes = {name: joint.node for name, joint in found.inverse.likelihood.joints.items()}
    known = amplitudes_of_set(measurement, 0, found.inverse.likelihood.predicted, nodes)
    assert known is not None
    return known


def test_they_come_from_the_records_of_all_blows_with_an_interval_from_their_scatter(
    identified: Identification, measurement: MeasuredArticle
) -> None:
    by_peak = amplitudes(identified, replace(measurement, forces={}))
    for name, found in amplitudes(identified, measurement).items():
        assert found.source == "from the force records of 110 blows"
        interval = found.ci95
        assert interval is not None
        assert np.all((interval[:, 0] < found.amplitude_pp) & (found.amplitude_pp < interval[:, 1]))
        assert np.all(interval[:, 1] / interval[:, 0] < 1.5)
        # a pulse of the usual width is not far off
        assert found.amplitude_pp == pytest.approx(by_peak[name].amplitude_pp, rel=0.5)
        assert by_peak[name].source.startswith(PEAK)
        assert by_peak[name].ci95 is None


def test_a_hammer_that_struck_twice_as_hard_moved_the_joints_twice_as_far(
    identified: Identification, measurement: MeasuredArticle
) -> None:
    harder = {
        number: tuple(replace(each, force=2 * each.force) for each in forces)
        for number, forces in measurement.forces.items()
    }
    plain = amplitudes(identified, measurement)
    for name, found in amplitudes(identified, replace(measurement, forces=harder)).items():
        np.testing.assert_allclose(found.amplitude_pp, 2 * plain[name].amplitude_pp, rtol=1e-9)


def test_the_comparison_says_what_its_amplitude_is_known_from(identified: Identification) -> None:
    assert identified.comparison
    for each in identified.comparison:
        assert ", from the force records of 110 blows" in each.basis
        assert each.amplitude_ci95 is not None
        assert each.amplitude_ci95[0] < each.amplitude_pp < each.amplitude_ci95[1]
    document = identification_document(identified)["comparison"][0]
    low, high = document["amplitude_pp_mm_ci95"]
    assert low < document["amplitude_pp_mm"] < high


def test_the_sum_of_k11_is_compared_by_students_interval(identified: Identification) -> None:
    assert identified.inverse is not None
    _, covariance, freedom = identified.inverse.fit.sum_of(0, 0)
    (total,) = [each for each in identified.comparison if (each.joint, each.element) == ("I+II", "k11")]
    assert total.inverse is not None
    assert np.isfinite(freedom)
    half = (total.inverse.high - total.inverse.low) / 2
    assert half == pytest.approx(float(quantile(freedom)) * np.sqrt(covariance[0, 0]))


def test_without_records_it_falls_back_and_says_so(measurement: MeasuredArticle) -> None:
    found = identify(replace(measurement, forces={}), Options(elements=2, joint_law=FrequencyLaw.CONSTANT))
    assert found.comparison, found.not_compared
    for each in found.comparison:
        assert f", {PEAK}" in each.basis
        assert "as there are no force records of every point" in each.basis
        assert each.amplitude_ci95 is None


def test_a_set_whose_rows_were_swapped_has_no_forces_by_point(measurement: MeasuredArticle) -> None:
    (struck,) = measurement.sets
    swapped = struck.accelerance.copy()
    swapped[[2, 5]] = swapped[[5, 2]]
    repaired = correct_faults(replace(measurement, sets=(replace(struck, accelerance=swapped),)))
    assert repaired.faults
    assert repaired.forces == {}
