"""Few lines are identified as far as they go; where they show no mode, the tester's results stay."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.errors import NoModeError
from analysis.inverse.frequency_law import FrequencyLaw
from jointlab.identification.document import identification_document
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.options import Options
from jointlab.identification.pipeline import identify
from jointlab.report.identification import write_report
from jointlab.report.summary import summary_sections
from tests.jointlab.identification.layouts import LAYOUTS, NOISE, joints_of, measured
from tests.jointlab.identification.tester import sine_points

CONSTANT = Options(joint_law=FrequencyLaw.CONSTANT)
NINE = LAYOUTS["nine nodes"]


def every(step: int) -> MeasuredArticle:
    """One line of `step` of the good bench."""
    measurement = measured(NINE)
    (struck,) = measurement.sets
    assert struck.variance is not None
    few = replace(
        struck,
        frequency=struck.frequency[::step],
        accelerance=struck.accelerance[:, ::step],
        variance=struck.variance[:, ::step],
    )
    return replace(measurement, sets=(few,))


def silent() -> MeasuredArticle:
    """A bench of which only noise is heard."""
    measurement = measured(NINE)
    (struck,) = measurement.sets
    parts = np.random.default_rng(1).standard_normal((2, *struck.accelerance.shape))
    return replace(measurement, sets=(replace(struck, accelerance=NOISE * (parts[0] + 1j * parts[1])),))


def test_32_lines_of_9_rows_identify_the_joints() -> None:
    found = identify(every(16), CONSTANT)
    assert found.measurement.sets[0].accelerance.shape == (9, 32)
    assert found.inverse is not None
    assert found.inverse.fit.passed
    for true in joints_of(found.measurement.article):
        low, high = found.inverse.likelihood.joints[true.name].k_ci95[1, 1]
        assert low < true.dynamic_stiffness[1, 1].real < high


def test_accelerances_without_a_mode_cost_the_hammers_results_alone(tmp_path: Path) -> None:
    found = identify(replace(silent(), points=sine_points("I", "II")), CONSTANT)
    assert found.inverse is None
    assert set(found.direct) == {"I", "II"}
    assert found.inverse_left_out.startswith("no mode")
    assert identification_document(found)["inverse_left_out"] == found.inverse_left_out
    said = "No joints from the hammer: no mode"
    assert any(said in str(item) for section in summary_sections(found) for item in section.content)
    write_report(found, tmp_path / "report.html")
    assert said in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_hammer_without_a_mode_and_with_nothing_beside_it_is_an_error() -> None:
    with pytest.raises(NoModeError, match="no mode"):
        identify(silent(), CONSTANT)
