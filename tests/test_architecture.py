"""The rules that hold for the whole tree: which package may import which, and what its files may name."""

import ast
import re
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("analysis", "api", "daq", "jointlab", "rig", "simlab", "store")

# What each package may import of ours besides itself; arrows point down only.
ALLOWED: dict[str, set[str]] = {
    "analysis": set(),
    "daq": set(),
    "store": set(),
    "rig": {"analysis", "daq", "store"},
    "jointlab": {"analysis", "daq", "rig", "store"},
    "api": {"analysis", "daq", "jointlab", "rig", "store"},
    "simlab": set(),
}
# Exceptions, each with its reason.
ALSO_ALLOWED: dict[str, set[str]] = {
    "rig.registers": {"simlab"},  # the tester's wire contract
    # the commands that start it, and the trials that draw cases on it
    "simlab": {"api.commands.simulate", "api.commands.demo", "jointlab.trials"},
}
# Rooms of the packages with many files: each imports only those before it. Files beside the rooms are used by all, but
# for `diagnosis` and the like, which use them all.
ROOMS: dict[str, tuple[str, ...]] = {
    "analysis.gap": (
        "outside_catalogue", "simulation", "effects", "evidence", "fitting", "faults", "search", "findings",
        "experiments",
    ),
    "rig": ("tester", "sequences", "hammer", "sweep", "runs", "checks"),
    "store": (
        "database", "models", "waveforms", "measurements", "results", "service", "exchange", "exports", "backup",
    ),
}  # fmt: skip
# Frameworks of the ways in: only `api` imports them.
FRAMEWORKS = {"typer", "fastapi", "fastapi_offline", "nicegui", "starlette", "uvicorn"}
INPUT_OUTPUT = {"io", "os", "pathlib", "socket", "sqlite3", "subprocess", "sqlalchemy", "urllib", "http", "shutil"}


def modules(folder: str) -> list[Path]:
    return sorted((ROOT / folder).rglob("*.py"))


def module_name(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def imports(path: Path) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.relative_to(ROOT)}: relative import; write the package's name"
            found.add(str(node.module))
            found.update(f"{node.module}.{alias.name}" for alias in node.names)
    return found


def may_import(importer: str, imported: str) -> bool:
    package, target = importer.split(".")[0], imported.split(".")[0]
    if target not in PACKAGES or target == package or target in ALLOWED[package]:
        return True
    for name, importers in ALSO_ALLOWED.items():
        within = imported == name or imported.startswith(name + ".")
        if within and any(importer == allowed or importer.startswith(allowed + ".") for allowed in importers):
            return True
    # `from rig import registers` names the package on the way to the allowed module
    return f"{imported}.registers" == "rig.registers" and package == "simlab"


@pytest.mark.parametrize("package", PACKAGES)
def test_arrows_between_packages_point_down_only(package: str) -> None:
    importers = {module_name(path): imports(path) for path in modules(package)}
    wrong = {
        f"{each} imports {name}" for each, names in importers.items() for name in names if not may_import(each, name)
    }
    assert not wrong


def test_the_arrow_rule_refuses_what_it_should() -> None:
    assert not may_import("rig.tester.driver", "simlab.bench")
    assert not may_import("analysis.structure.beam", "store.catalogue")
    assert not may_import("simlab.beam", "analysis.structure.beam")
    assert not may_import("daq.device", "rig.hammer.session")
    assert not may_import("simlab.tester_server", "rig.tester.driver")
    assert may_import("simlab.tester_server", "rig.registers")
    assert may_import("rig.sweep.driven_sweep", "daq.block")


@pytest.mark.parametrize("base", ROOMS)
def test_rooms_import_only_those_before_them(base: str) -> None:
    order = ROOMS[base]
    wrong = {
        f"{module_name(path)} imports {name}"
        for place, room in enumerate(order)
        for path in modules(f"{base.replace('.', '/')}/{room}")
        for name in imports(path)
        for later in order[place + 1 :]
        if name == f"{base}.{later}" or name.startswith(f"{base}.{later}.")
    }
    assert not wrong


@pytest.mark.parametrize("base", ROOMS)
def test_each_room_has_its_place_in_the_order(base: str) -> None:
    apart = {"structures", "migrations"}  # a simulation, fit and search of their own; Alembic's revisions
    folders = {path.parent.name for path in (ROOT / base.replace(".", "/")).glob("*/__init__.py")}
    assert folders - apart == set(ROOMS[base])


@pytest.mark.parametrize("package", [each for each in PACKAGES if each != "api"])
def test_only_the_ways_in_know_web_page_and_command_frameworks(package: str) -> None:
    known = {path: {name.split(".")[0] for name in imports(path)} & FRAMEWORKS for path in modules(package)}
    assert not {module_name(path): names for path, names in known.items() if names}


def test_the_page_imports_no_route() -> None:
    known = {module_name(path): imports(path) for path in modules("api/page")}
    assert not {
        each for each, names in known.items() if any(name.startswith("api.service.resources") for name in names)
    }


def test_analysis_does_no_input_or_output() -> None:
    for path in modules("analysis"):
        calls = {n.func.id for n in ast.walk(parsed(path)) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)}
        assert not calls & {"open", "print", "input"}, module_name(path)
        assert not {name.split(".")[0] for name in imports(path)} & INPUT_OUTPUT, module_name(path)


def test_the_rig_carries_out_a_run_without_a_database() -> None:
    code = (
        "import sys, rig.runs.run, rig.runs.spool; assert not {'sqlalchemy', 'alembic', 'psycopg'} & set(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_service_loads_no_work_of_jobs() -> None:
    code = (
        "import sys, api.commands.service, api.page.routes; "
        "assert not {'jointlab.jobs.tasks', 'jointlab.jobs.work', 'jointlab.report.identification'} & set(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_every_dependency_is_used() -> None:
    known = {name.split(".")[0] for package in PACKAGES for path in modules(package) for name in imports(path)}
    wanted = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["dependencies"]
    names = {re.split(r"[\[<>=~,]", each)[0].replace("-", "_") for each in wanted}
    modules_of = {"psycopg": "store", "pyyaml": "yaml", "pyserial": "serial"}  # psycopg by the name in the URL
    assert not {name for name in names if modules_of.get(name, name) not in known}


def test_lock_files_name_no_address() -> None:
    for lock in ROOT.glob("requirements*.lock"):
        text = lock.read_text(encoding="utf-8")
        assert not re.search(r"https?://|file:|--index-url|--find-links", text), lock.name


def test_every_top_folder_is_one_the_design_names() -> None:
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    if tracked.returncode != 0:
        pytest.skip("not a git checkout")
    folders = {line.split("/")[0] for line in tracked.stdout.splitlines() if "/" in line}
    assert folders <= {*PACKAGES, "deploy", "tests", "docs", ".ci"}
