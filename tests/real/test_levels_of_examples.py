"""Joints against amplitude, from a bundle of two hammer levels on joints that soften."""

from pathlib import Path
from typing import Any

import pytest

from jointlab.identification.document import identification_document
from jointlab.identification.load import measurement_of_bundle
from jointlab.identification.pipeline import Identification, identify
from jointlab.report.identification import write_report
from store.exchange.bundle import read_bundle
from tests.recordings import Recording


@pytest.fixture(scope="module")
def found(recording: Recording) -> Identification:
    return identify(measurement_of_bundle(read_bundle(recording("examples/amplitude"))))


@pytest.fixture(scope="module")
def levels(found: Identification) -> list[dict[str, Any]]:
    document = identification_document(found)
    assert [(level["set"], level["peak_force"]) for level in document["levels"]] == [(1, 100.0), (2, 100.0), (3, 400.0)]
    return list(document["levels"])


@pytest.mark.parametrize("joint", ["I", "II"])
def test_harder_blows_find_softer_joints_at_larger_amplitude(levels: list[dict[str, Any]], joint: str) -> None:
    light, again, hard = (level["joints"][joint] for level in levels)
    assert hard["k"][1][1] < 0.9 * light["k"][1][1]
    assert 4.0 < hard["amplitude_pp_mm"] / light["amplitude_pp_mm"] < 5.0  # four times the force, and softer
    low, high = light["k_ci95"][1][1]
    assert low < again["k"][1][1] < high


def test_the_reference_set_is_the_result_itself(found: Identification, levels: list[dict[str, Any]]) -> None:
    assert found.inverse is not None
    for name, joint in found.inverse.likelihood.joints.items():
        assert levels[0]["joints"][name]["k"] == joint.stiffness.tolist()


def test_the_report_shows_stiffness_against_amplitude(found: Identification, tmp_path: Path) -> None:
    write_report(found, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Joints against amplitude" in page
    assert 'aria-label="Stiffness k22 against amplitude"' in page
