"""The public Python API, as a person in a notebook uses it."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jointlab
from jointlab.errors import JointlabError
from simlab.case.bundle import write_case
from simlab.case.draw import CaseKind, draw_case
from store.catalogue import Catalogue
from store.exchange.bundle_exchange import import_bundle
from store.results.analyses import latest_analysis
from store.states import AnalysisKind
from tests.rewriting import with_fewer_lines

FUNCTIONS = [name for name in jointlab.__all__ if name not in ("Options", "Result")]
HEAVY = ("numpy", "scipy", "httpx", "matplotlib", "sqlalchemy", "pydantic")


@pytest.fixture(scope="session")
def simulated_bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bench without effects: two hammer sets and a sweep, which evaluate in a few seconds; tests only read it."""
    folder = tmp_path_factory.mktemp("simulated") / "bundle"
    write_case(draw_case(4, CaseKind.NONE), folder)
    return with_fewer_lines(folder, 4)


@pytest.fixture(scope="module")
def identified(simulated_bundle: Path) -> jointlab.Result[Any]:
    return jointlab.identify(simulated_bundle)


def test_the_import_loads_no_library() -> None:
    code = f"import sys, jointlab; print(*(name for name in {HEAVY!r} if name in sys.modules))"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == ""


def test_type_checkers_see_the_names_that_exist() -> None:
    tree = ast.parse(Path(jointlab.__file__).read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    imported = {alias.name for node in block.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert imported - {"Client"} | {"connect"} == set(jointlab.__all__)
    assert dir(jointlab) == sorted(jointlab.__all__)
    with pytest.raises(AttributeError, match="no attribute 'identfy'"):
        _ = jointlab.identfy


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_says_what_it_takes_gives_and_raises(name: str) -> None:
    function = getattr(jointlab, name)
    text = inspect.getdoc(function) or ""
    assert "Returns:" in text
    assert "For example:" in text
    assert f"jointlab.{name}(" in text
    assert "Raises:" in text or name == "connect"
    missing = [each for each in inspect.signature(function).parameters if f"\n    {each}: " not in text]
    assert not missing


def test_modes_of_a_file_and_of_a_band(simulated_bundle: Path) -> None:
    responses = jointlab.read_uff(simulated_bundle / "inverse_1.unv")
    found = jointlab.modes(responses, band=(20, 400))
    rows = found.tables["modes"]
    assert np.array_equal([row["frequency"] for row in rows], found.details.modes.frequency)
    row = rows[0]
    assert row["loss_factor_low"] < row["loss_factor"] < row["loss_factor_high"]
    assert len(rows) == 4


def test_joints_of_a_bundle_lie_in_their_intervals(identified: jointlab.Result[Any]) -> None:
    joints = identified.tables["joints"]
    assert {(row["joint"], row["element"]) for row in joints} >= {("I", "k22"), ("II", "k12")}
    assert all(row["stiffness_low"] <= row["stiffness"] <= row["stiffness_high"] for row in joints)
    assert any(row["loss_factor"] is None for row in joints), "a term that is not known has no loss factor"
    assert {row["verdict"] for row in identified.tables["comparison"]} >= {"agree"}
    assert "720 sine points of joint I, II" in identified.notes


def test_a_bundle_that_is_read_gives_what_its_path_gives(simulated_bundle: Path) -> None:
    bundle = jointlab.read_bundle(simulated_bundle)
    asked: dict[str, Any] = {"amplitude_pp_mm": 0.03, "frequency": 80.0, "specimens": ["I"]}
    one, other = (jointlab.stiffness(source, **asked) for source in (bundle, str(simulated_bundle)))
    assert one.tables == other.tables
    assert [row["term"] for row in one.tables["stiffness"]] == ["a", "b", "k11", "k22", "k12"]
    far = jointlab.stiffness(bundle, amplitude_pp_mm=1.0, frequency=80.0)
    assert far.notes[0].startswith("extrapolated, joint I: ")


def test_a_result_is_a_table_as_text_and_as_html(identified: jointlab.Result[Any]) -> None:
    text, page = repr(identified), identified._repr_html_()
    assert "number  frequency  frequency_low" in text
    assert max(map(len, text.splitlines())) < 220
    assert page.count("<table>") == len(identified.tables)
    assert "<th>loss_factor_high</th>" in page
    assert "array(" not in text


def test_a_run_is_identified_saved_and_asked(simulated_bundle: Path, tmp_path: Path) -> None:
    with jointlab.open_catalogue(f"sqlite:///{tmp_path / 'lab.db'}") as catalogue:
        assert isinstance(catalogue, Catalogue)
        run = import_bundle(catalogue, simulated_bundle)
        jointlab.identify(catalogue, run=run, save=True)
        with catalogue.reading() as session:
            assert latest_analysis(session, run, AnalysisKind.JOINT_MATRICES)
        asked = jointlab.stiffness(catalogue, run=run, amplitude_pp_mm=0.05, frequency=60)
    assert len(asked.tables["stiffness"]) == 10


def test_the_gap_of_a_bench_without_effects_is_its_noise(simulated_bundle: Path, tmp_path: Path) -> None:
    found = jointlab.diagnose(simulated_bundle)
    assert found.details.document["verdict"]["status"] == "none"
    assert found.tables["explanations"][0]["effects"] == "none: noise and tolerances"
    assert found.tables["parameters"] == []
    assert any(note.startswith("nothing beyond noise and stated tolerances") for note in found.notes)
    page = jointlab.write_report(found, tmp_path / "gap.html")
    assert "The gap between simulation and measurement" in page.read_text(encoding="utf-8")


def test_a_report_of_joints_is_a_page(identified: jointlab.Result[Any], tmp_path: Path) -> None:
    page = jointlab.write_report(identified, str(tmp_path / "report.html"))
    assert page.read_text(encoding="utf-8").startswith("<!doctype html>")


def test_what_cannot_be_done_is_refused(simulated_bundle: Path, tmp_path: Path) -> None:
    with jointlab.open_catalogue(f"sqlite:///{tmp_path / 'lab.db'}") as catalogue:
        for ask in (jointlab.identify, jointlab.diagnose):
            with pytest.raises(JointlabError, match="needs the number of a run"):
                ask(catalogue)
            with pytest.raises(JointlabError, match="a bundle none"):
                ask(simulated_bundle, run=1)
            with pytest.raises(JointlabError, match="no database to save to"):
                ask(simulated_bundle, save=True)
    modes = jointlab.modes(simulated_bundle / "inverse_1.unv")
    with pytest.raises(JointlabError, match="identify and diagnose"):
        jointlab.write_report(modes, tmp_path / "modes.html")


def test_a_service_is_reached_by_a_client() -> None:
    with jointlab.connect("http://127.0.0.1:1", key="jl_x", timeout=0.1) as lab:
        assert type(lab).__name__ == "Client"
