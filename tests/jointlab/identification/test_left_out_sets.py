"""Further sets: one that does not suffice costs itself alone, and all are held as the first set is."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.inverse.frequency_dependent_joints import modes_on
from analysis.inverse.frequency_law import FrequencyLaw
from analysis.modes import Modes
from jointlab.identification import levels
from jointlab.identification.document import identification_document
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.options import Options
from jointlab.identification.pipeline import identify
from jointlab.report.identification import write_report
from jointlab.report.summary import summary_sections
from tests.jointlab.identification.layouts import LAYOUTS, measured


def with_second_set(lines: int) -> MeasuredArticle:
    """The second set has one row, and only so many lines."""
    measurement = measured(LAYOUTS["nine nodes"])
    (struck,) = measurement.sets
    assert struck.variance is not None
    short = replace(
        struck,
        number=2,
        inputs=struck.inputs[:1],
        frequency=struck.frequency[:lines],
        accelerance=struck.accelerance[:1, :lines],
        variance=struck.variance[:1, :lines],
    )
    return replace(measurement, sets=(struck, short))


def test_a_set_with_too_few_lines_is_left_out_with_the_reason(tmp_path: Path) -> None:
    found = identify(with_second_set(10), Options(joint_law=FrequencyLaw.CONSTANT))
    assert found.inverse is not None
    assert found.inverse.fit.passed
    assert [level.number for level in found.levels.found] == [1]
    (said,) = found.levels.left_out
    assert said.startswith("set 2: 10 accelerances between")
    assert said.endswith("are too few for 24 parameters")
    assert identification_document(found)["levels_left_out"] == [said]
    shown = [str(item) for section in summary_sections(found) for item in section.content]
    assert any("Left out: set 2: 10 accelerances" in item for item in shown)
    write_report(found, tmp_path / "report.html")
    assert "Left out: set 2: 10 accelerances" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_set_on_whose_joints_no_mode_settles_is_left_out_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    measurement = measured(LAYOUTS["nine nodes"])
    (struck,) = measurement.sets
    again = replace(measurement, sets=(struck, replace(struck, number=2, peak_force=300.0)))
    calls = []

    def unsettled(*given: Any) -> Modes:
        calls.append(given)
        if len(calls) > 1:
            raise AnalysisError("mode 3 finds no frequency on joints that follow frequency")
        return modes_on(*given)

    monkeypatch.setattr(levels, "modes_on", unsettled)
    found = identify(again, Options(joint_law=FrequencyLaw.CONSTANT))
    assert [level.number for level in found.levels.found] == [1]
    assert found.levels.left_out == ("set 2: mode 3 finds no frequency on joints that follow frequency",)


def test_every_set_is_held_as_the_reference_set_is() -> None:
    """With the same accelerances in both, both sets have the same joints."""
    measurement = measured(LAYOUTS["interior joints"])
    (struck,) = measurement.sets
    again = replace(measurement, sets=(struck, replace(struck, number=2)))
    first, second = identify(again, Options(joint_law=FrequencyLaw.CONSTANT, regularise=0.1)).levels.found
    for name, joint in first.fit.joints.items():
        deviation = np.sqrt(np.diag(joint.covariance)).reshape(2, 6)
        off = second.fit.joints[name].stiffness - joint.stiffness
        assert np.all(np.abs(off[np.triu_indices(3)]) < 0.1 * deviation[0])
        np.testing.assert_allclose(second.fit.joints[name].covariance, joint.covariance, rtol=0.01, atol=1e-3)
