"""The notebooks and the short examples run, and show what they promise."""

import importlib.util
import json
import re
import shutil
import sys
from pathlib import Path
from types import ModuleType

import pytest

import jointlab
from simlab.case.bundle import write_case
from simlab.case.draw import Case, CaseKind, draw_case
from store.exchange.bundle_exchange import import_bundle
from tests.rewriting import with_fewer_lines

DOCS = Path(__file__).resolve().parents[2] / "docs"
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))
EXAMPLES = re.findall(
    r"^```python\n(.*?)^```", (DOCS / "index.md").read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
)
SHOWN = {
    "uff_to_modes": "modes</p><table>",
    "bundle_to_joints": "agree",
    "diagnosing_a_gap": r"explained \['joint_mass'\]",
}


def module(name: str) -> ModuleType:
    """A module of the documentation, which is no package."""
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


@pytest.fixture
def few_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    """Simulated benches are measured with one line in four, which are quicker to evaluate."""
    monkeypatch.setattr("simlab.case.bundle.write_case", write_with_fewer_lines)


def write_with_fewer_lines(case: Case, folder: Path) -> None:
    write_case(case, folder)
    with_fewer_lines(folder, 4)


@pytest.mark.usefixtures("few_lines")
@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(notebook: Path) -> None:
    page = module("run_notebook").as_markdown(notebook)
    assert re.search(SHOWN[notebook.stem], page)
    assert "data:image/png;base64," in page


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_stored_without_outputs(notebook: Path) -> None:
    for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None


def test_a_cell_shows_what_it_prints_and_its_last_value(tmp_path: Path) -> None:
    cells = ["print('seen')\n1 + 1", "2 + 2;", "x = 5", "x"]
    document = {"cells": [{"cell_type": "code", "source": [cell]} for cell in cells]}
    (tmp_path / "small.ipynb").write_text(json.dumps(document), encoding="utf-8")
    page = module("run_notebook").as_markdown(tmp_path / "small.ipynb")
    assert re.findall(r"```text\n(.*?)\n```", page) == ["seen", "2", "5"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the short examples find: a UFF file, a bundle, and a database with one run."""
    found = tmp_path_factory.mktemp("examples")
    write_with_fewer_lines(draw_case(4, CaseKind.NONE), found / "bundle")
    shutil.copy(found / "bundle" / "inverse_1.unv", found / "beam.unv")
    with jointlab.open_catalogue(f"sqlite:///{found / 'jointlab.db'}") as catalogue:
        assert import_bundle(catalogue, found / "bundle") == 1
    return found


@pytest.mark.parametrize("number", range(len(EXAMPLES)))
def test_a_short_example_runs(
    number: int, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = [line for line in EXAMPLES[number].splitlines() if line]
    assert len(lines) <= 5
    monkeypatch.chdir(folder)
    exec(compile(EXAMPLES[number], f"example {number}", "exec"), {})
    assert capsys.readouterr().out


def test_a_page_that_loads_from_another_host_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    errors = pytest.importorskip("mkdocs.exceptions")
    monkeypatch.setattr(sys, "path", [*sys.path])
    hooks = module("site_hooks")
    config = type("Config", (), {"site_dir": str(tmp_path)})
    page = tmp_path / "page.html"
    page.write_text('<a href="https://elsewhere/">a link is no load</a><img src="images/x.png">', encoding="utf-8")
    hooks.on_post_build(config)
    page.write_text('<script src="https://elsewhere/x.js"></script>', encoding="utf-8")
    with pytest.raises(errors.PluginError, match="elsewhere"):
        hooks.on_post_build(config)


def test_equations_become_mathml(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mkdocs")
    monkeypatch.setattr(sys, "path", [*sys.path])
    page = module("site_hooks").on_page_content(r'<span class="arithmatex">\(k &lt; h\)</span>')
    assert page.startswith("<math")
    assert "&lt;" in page or "&#x0003C;" in page
