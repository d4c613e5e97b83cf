"""A base installation: the commands of a rig work without any extra, and others say which one they need."""

import re
import subprocess
import sys
import tomllib
from ast import literal_eval
from pathlib import Path

import pytest

from store.catalogue import Catalogue
from store.extras import EXTRAS, MissingExtraError, explained_imports
from tests.store.conftest import fill

ROOT = Path(__file__).resolve().parents[2]
WITHOUT = f"""
import sys
class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {sorted(EXTRAS)}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Blocked())
"""
IMPORT_ALL = """
from api.cli import COMMANDS, load
for name in sorted(set(COMMANDS) - {"serve"}):
    load(name)
import jointlab.drive.__main__, jointlab.notebook, jointlab.client
"""


def without_extras(code: str, folder: Path, *arguments: str) -> "subprocess.CompletedProcess[str]":
    """What a process says that finds no package of any extra."""
    return subprocess.run(
        [sys.executable, "-c", WITHOUT + code, *arguments], env={"PYTHONPATH": str(ROOT), "PATH": ""}, cwd=folder,
        text=True, capture_output=True, check=False,
    )  # fmt: skip


def test_every_command_but_the_service_is_there_without_extras(tmp_path: Path) -> None:
    done = without_extras(IMPORT_ALL, tmp_path)
    assert done.returncode == 0, done.stderr


RUN = """
import contextlib, io
from api.cli import main
for words in {lines}:
    sys.argv, said = ["jointlab", *words], io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            main()
    except SystemExit as ended:
        print(repr((ended.code, said.getvalue())))
"""


@pytest.fixture
def stored(tmp_path: Path) -> None:
    """A catalogue in the folder of the test."""
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as opened:
        fill(opened)


@pytest.mark.usefixtures("stored")
def test_a_rig_shows_exports_and_backs_up_without_extras(tmp_path: Path) -> None:
    lines = ["show 1", "export 1 out.mat --format mat", "export 1 out.unv --format uff", "store backup backup.zip"]
    done = without_extras(RUN.format(lines=[line.split() for line in lines]), tmp_path)
    assert done.stdout.count("(0, ") == len(lines), done


def test_a_rig_identifies_without_extras(exported: Path, tmp_path: Path) -> None:
    quick = ["--elements", "1", "--joint-law", "constant"]
    lines = [["import", str(exported)], ["identify", "1", *quick], ["export", "1", "out"]]
    done = without_extras(RUN.format(lines=lines), tmp_path)
    assert done.stdout.count("(0, ") == len(lines), done
    assert (tmp_path / "out" / "setup.json").exists()


@pytest.mark.usefixtures("stored")
def test_what_needs_an_extra_names_it_in_one_line(tmp_path: Path) -> None:
    needing = {
        "serve": "page",
        "export 1 run.h5 --format hdf5": "files",
        "export 1 run --format parquet": "parquet",
        "worker tcp://127.0.0.1:9": "cluster",
        "mqtt mqtt://127.0.0.1:9": "mqtt",
        "opcua": "opcua",
    }
    done = without_extras(RUN.format(lines=[line.split() for line in needing]), tmp_path)
    refusals = [literal_eval(line) for line in done.stdout.splitlines() if line.startswith("(")]
    assert len(refusals) == len(needing), done
    for (exit_code, said), extra in zip(refusals, needing.values(), strict=True):
        assert (exit_code, len(said.splitlines())) == (3, 1), said
        assert f"pip install 'jointlab[{extra}]'" in said


@pytest.mark.parametrize(
    ("code", "extra"),
    [
        ("from jointlab.report.plots import figure; figure()", "report"),
        ("from store.catalogue import Catalogue; Catalogue.open('postgresql://a@/b', 'w')", "postgres"),
    ],
)
def test_what_needs_an_extra_inside_says_which(code: str, extra: str, tmp_path: Path) -> None:
    done = without_extras(code, tmp_path)
    assert f"MissingExtraError: {'matplotlib' if extra == 'report' else 'psycopg'} is not installed" in done.stderr
    assert f"pip install 'jointlab[{extra}]'" in done.stderr


def test_another_missing_package_is_no_matter_of_extras() -> None:
    with pytest.raises(ModuleNotFoundError, match="no_such_package"), explained_imports():
        import no_such_package  # type: ignore[import-not-found]  # noqa: F401 - its absence is the point
    with pytest.raises(MissingExtraError), explained_imports():
        raise ModuleNotFoundError("No module named 'h5py'", name="h5py")


def test_the_table_of_extras_is_that_of_the_distribution() -> None:
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = declared["optional-dependencies"]
    assert extras["all"] == [f"jointlab[{','.join(sorted(set(EXTRAS.values())))}]"]
    for extra in set(EXTRAS.values()):
        for requirement in extras[extra]:
            (name,) = re.findall(r"^[a-z0-9-]+", requirement)
            family = name.partition("-")[0]  # of packages that are imported by one name
            imported = family if family in {"opentelemetry", "paho"} else name.replace("-", "_")
            assert name == "jinja2" or EXTRAS[imported] == extra  # that is in two of them
            assert not [each for each in declared["dependencies"] if re.match(rf"{name}\b", each)]
