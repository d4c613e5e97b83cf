"""What was not measured is said."""

from dataclasses import replace

import numpy as np

from analysis.gap.findings.missing_evidence import missing_evidence
from analysis.gap.measurement import Measurement


def complete(empty: Measurement) -> Measurement:
    return replace(
        empty, sets=tuple(replace(each, coherence=np.full(each.accelerance.shape, 0.9)) for each in empty.sets)
    )


def test_no_evidence_is_missing_where_everything_was_measured(empty: Measurement) -> None:
    assert missing_evidence(complete(empty)) == ()


def test_a_missing_rig_is_named_with_the_effects_that_only_it_shows(empty: Measurement) -> None:
    (beam_alone,) = missing_evidence(replace(complete(empty), points=None))
    assert beam_alone.startswith("no tester:")
    assert "frame_compliance" in beam_alone
    assert "sensor_gain" not in beam_alone
    (tester_alone,) = missing_evidence(replace(complete(empty), sets=()))
    assert tester_alone.startswith("no beam:")
    assert "sensor_gain" in tester_alone
    assert "frame_compliance" not in tester_alone


def test_one_row_one_level_and_no_coherence_are_named(empty: Measurement) -> None:
    first = empty.sets[0]
    row = first.rows(np.arange(len(first.inputs)) == 0)
    assert [sentence.partition(":")[0] for sentence in missing_evidence(replace(empty, sets=(row,)))] == [
        "one row, 1y",
        "no coherence in hammer set 1",
        "one hammer level, 100 N",
    ]


def test_one_amplitude_and_one_configuration_are_named(empty: Measurement) -> None:
    points = empty.points
    assert points is not None
    few = points.only((points.configuration == 1) & (points.amplitude == points.amplitude[0]))
    assert [sentence.partition(":")[0] for sentence in missing_evidence(replace(complete(empty), points=few))] == [
        "one amplitude in the tester, 0.01 mm",
        "no points of the tester in compression or angled",
    ]


def test_missing_temperatures_are_named(empty: Measurement) -> None:
    cold = tuple(replace(each, temperature=float("nan")) for each in complete(empty).sets)
    (sentence,) = missing_evidence(replace(empty, sets=cold))
    assert sentence.startswith("no temperatures:")
