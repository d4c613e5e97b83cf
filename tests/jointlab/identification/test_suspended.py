"""A run on the suspended beam: Table 1 near the truth, and damping that the inverse method then uses."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from jointlab.errors import BAD_INPUT
from jointlab.identification.document import identification_document
from jointlab.identification.run import identify_and_save
from jointlab.report.identification import write_run_report
from simlab.laboratory import Laboratory
from store.catalogue import Catalogue
from tests.api.conftest import Command, paper


@pytest.fixture
def both(tmp_path: Path) -> Path:
    """A sequence with the suspended beam and the supported one."""
    document = paper()
    (hammer, _) = document["steps"]
    hung = {"beam": "suspended", "block_seconds": 4.0, "points": ["1y", "4y", "6y", "8y", "9y", "11y"], "blows": 4}
    hung["suspension"] = {"bounce": 4.0, "positions": [0.0595, 0.8545], "loss_factor": 0.1}
    hung["weight"] = {"mass": 9.25, "standard_error": 0.03}
    document["steps"] = [hammer | hung, hammer | {"blows": 4}]
    document["article"]["beam"]["youngs_modulus"] = 203e9  # two per cent less than it is
    document["article"]["tolerances"]["youngs_modulus"] = 0.01
    path = tmp_path / "both.yaml"
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    return path


@pytest.mark.usefixtures("drive", "operator")
def test_the_suspended_beam_gives_table_1_and_the_damping_of_the_inverse_method(
    jointlab: Command, both: Path, laboratory: Laboratory, tmp_path: Path, query: Callable[[str], list[Any]]
) -> None:
    assert "hammer on the suspended beam: 4 blows" in jointlab("run", both, "--dry-run").stdout
    ran = jointlab("run", both)
    assert ran.returncode == 0, ran.stderr
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue:
        found = identify_and_save(catalogue, 1)
        write_run_report(catalogue, 1, found, tmp_path / "report.html")
    document = identification_document(found)
    free = laboratory.bench.truth()["free"]
    table = document["suspended_beam"]["modes"]
    assert [row["mode"] for row in table] == [4, 5, 6]
    assert [row["frequency_hz"] for row in table] == pytest.approx(free["frequency_hz"], rel=1e-3)
    assert [row["damping_ratio"] for row in table] == pytest.approx(free["damping_ratio"], rel=0.1)
    for row in table:
        low, high = row["frequency_ci95"]
        assert low < row["frequency_hz"] < high
    beam = laboratory.bench.built.article.beam
    for name, true in (("youngs_modulus", beam.youngs_modulus), ("density", beam.density)):
        assert document["suspended_beam"]["beam"][name]["value"] == pytest.approx(true, rel=0.01)
    assert any("the suspension at 4 Hz raised mode 4" in text for text in document["suspended_beam"]["statements"])

    assert {"I", "II"} <= set(document["inverse"])  # the supported set alone
    assert query("SELECT method, count(*) FROM v_modes GROUP BY method")[-1][0] == "suspended beam"
    assert query("SELECT DISTINCT set_number FROM frequency_response_sets") == [(2,)]
    assert "Table 1: the suspended beam" in (tmp_path / "report.html").read_text(encoding="utf-8")

    assert found.measurement.suspended is not None
    assert [each.number for each in found.measurement.sets] == [2]
    (hung, *_), (used, *_) = (
        [json.loads(settings) for (settings,) in query(f"SELECT settings FROM analyses WHERE method LIKE '{method}%'")]
        for method in ("suspended beam", "maximum likelihood")
    )
    assert hung["damping_ratios"] == [row["damping_ratio"] for row in table]
    assert hung["run"] == 1
    assert used["youngs_modulus"] == pytest.approx(beam.youngs_modulus, rel=0.01)
    assert used["density"] == pytest.approx(beam.density, rel=0.01)
    assert used["tolerances"]["material_correlation"] > 0.5
    stiffness = laboratory.bench.truth()["inverse"]
    for name in ("I", "II"):
        assert document["inverse"][name]["k"][1][1] == pytest.approx(stiffness[name]["k"][1][1], rel=0.02)


@pytest.mark.usefixtures("laboratory")
def test_a_run_without_suspended_beam_lends_no_damping(jointlab: Command, measured: int) -> None:
    refused = jointlab("identify", measured, "--free-beam", measured)
    assert refused.returncode == BAD_INPUT
    assert refused.stderr.endswith("run 1 has no hammer step on the suspended beam\n")


def test_the_suspended_sequence_is_built_in(jointlab: Command) -> None:
    listed = jointlab("run", "suspended", "--dry-run")
    assert listed.returncode == 0, listed.stderr
    assert "hammer on the suspended beam: 10 blows at each of 1y, 3y" in listed.stdout
