"""What the documentation names exists: links, paths, modules, commands and options."""

import re
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest
import yaml

from api.cli import COMMANDS
from tests.command_lines import is_known

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
GENERATED = {f"docs/notebooks/{notebook.stem}.md" for notebook in (ROOT / "docs" / "notebooks").glob("*.ipynb")}
PACKAGES = "analysis|api|daq|deploy|docs|jointlab|rig|simlab|store|tests"
LINK = re.compile(r"(?<!`)\]\(([^)\s]+)\)")
CODE = re.compile(r"`([^`\n]+)`")
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
PATH = re.compile(rf"(?<![\w/.-])(?:{PACKAGES})/[\w./-]*")
MODULE = re.compile(rf"(?<![\w/.-])(?:{PACKAGES})(?:\.[A-Za-z_]\w*)+(?![\w/])")
TEST = re.compile(r"`(tests/[\w/]+\.py)::(\w+)`")
NO_MODULES = (".md", ".py", ".db", ".toml")


def name(page: Path) -> str:
    return str(page.relative_to(ROOT))


def anchors(page: Path) -> set[str]:
    """As both the site and code hosts make them, plus those that a page writes itself."""
    text = BLOCK.sub("", page.read_text(encoding="utf-8"))
    found = set(re.findall(r'(?:id|name)="([^"]+)"', text))
    for heading in re.findall(r"^#+ (.+)$", text, re.MULTILINE):
        plain = re.sub(r"[^\w\s-]", "", heading.lower()).strip()
        found |= {re.sub(r"\s", "-", plain), re.sub(r"[-\s]+", "-", plain)}
    return found


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_lead_somewhere(page: Path) -> None:
    missing = []
    for link in LINK.findall(BLOCK.sub("", page.read_text(encoding="utf-8"))):
        target, _, anchor = link.partition("#")
        file = (page.parent / target).resolve() if target else page
        if "://" in link or (file.is_relative_to(ROOT) and name(file) in GENERATED):
            continue
        if not file.exists() or (anchor and anchor not in anchors(file)):
            missing.append(link)
    assert not missing


@pytest.mark.parametrize("page", [page for page in PAGES if "::" in page.read_text(encoding="utf-8")], ids=name)
def test_tests_that_are_named_exist(page: Path) -> None:
    named = TEST.findall(page.read_text(encoding="utf-8"))
    assert not [test for file, test in named if f"def {test}(" not in (ROOT / file).read_text(encoding="utf-8")]


@pytest.mark.parametrize("page", [*PAGES, ROOT / "docs" / "images" / "ways.svg"], ids=name)
def test_paths_and_modules_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    named = [text] if page.suffix == ".svg" else CODE.findall(BLOCK.sub("", text))
    paths = {path for each in named for path in PATH.findall(each) if f"/{path}" not in each}
    files = {each for each in named if re.fullmatch(r"\w+\.py", each)}
    modules = {module for each in named for module in MODULE.findall(each) if not module.endswith(NO_MODULES)}
    missing = [path for path in paths if not (ROOT / path).exists()]
    missing += files - file_names()
    missing += [module for module in modules if not importable(module)]
    assert not missing


@cache
def file_names() -> set[str]:
    return {path.name for package in PACKAGES.split("|") for path in (ROOT / package).rglob("*.py")}


@cache
def importable(dotted: str) -> bool:
    """Whether a module, or a name in one, is called so."""
    parts = dotted.split(".")
    for count in range(len(parts), 0, -1):
        module = ".".join(parts[:count])
        try:
            if find_spec(module) is None:
                continue
        except ModuleNotFoundError:
            continue
        found = import_module(module)
        for part in parts[count:]:
            if not hasattr(found, part):
                return part in getattr(found, "__annotations__", {})
            found = getattr(found, part)
        return True
    return (ROOT / dotted).exists()


def commands(page: Path) -> list[str]:
    """Lines of a page's blocks that call the program."""
    blocks = [body for language, body in BLOCK.findall(page.read_text(encoding="utf-8")) if not language]
    lines = [line.split("#")[0].strip() for body in blocks for line in body.splitlines()]
    return [line.removeprefix(".venv/bin/") for line in lines if re.match(r"(?:\.venv/bin/)?jointlab ", line)]


@pytest.mark.parametrize("page", [page for page in PAGES if commands(page)], ids=name)
def test_commands_and_options_exist(page: Path) -> None:
    assert not [line for line in commands(page) if not is_known(line)]


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_targets_of_make_exist(page: Path) -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    text = page.read_text(encoding="utf-8")
    asked = set(re.findall(r"`make ([a-z-]+)`", text)) | set(re.findall(r"^make ([a-z-]+)", text, re.MULTILINE))
    assert asked <= targets


def test_the_table_of_commands_is_whole() -> None:
    text = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    rows = " ".join(re.findall(r"^\| (`.*?) \|", text, re.MULTILINE))
    assert {each for each in COMMANDS if not re.search(rf"`{each}\b", rows)} == set()


def test_the_site_has_every_page_and_no_other() -> None:
    config = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))

    def pages(entry: object) -> list[str]:
        if isinstance(entry, str):
            return [entry]
        children = entry.values() if isinstance(entry, dict) else entry
        assert not isinstance(children, (str, int))
        return [page for child in children or () for page in pages(child)]  # type: ignore[attr-defined]  # YAML

    shown = {f"docs/{page}" for page in pages(config["nav"])}
    assert shown == {name(page) for page in PAGES if name(page).startswith("docs/")} | GENERATED


def test_locks_name_the_same_versions_and_no_registry() -> None:
    def pins(lock: str) -> dict[str, set[str]]:
        lines = (ROOT / lock).read_text(encoding="utf-8").splitlines()
        heads = [line.removesuffix(" \\").split(" ; ")[0].split("==") for line in lines if not line.startswith(" ")]
        assert all(line.strip().startswith("--hash=sha256:") for line in lines if line.startswith(" "))
        return {package: {each[1] for each in heads if each[0] == package} for package, _ in heads}

    program, site = pins("requirements.lock"), pins("requirements-docs.lock")
    base, tests = pins("requirements-base.lock"), pins("requirements-test.lock")
    for other in (site, base, tests):
        assert all(program[each] == pinned for each, pinned in other.items() if each in program)
    assert base.keys() < program.keys() < tests.keys()
    assert {"mkdocs-material", "mkdocstrings-python", "latex2mathml"} <= site.keys() - program.keys()
