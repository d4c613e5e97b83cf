"""The version names release and commit: in a checkout, a source archive, a wheel and a source distribution."""

import io
import os
import runpy
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path
from unittest.mock import Mock

import pytest

from store.version import release
from tests.archives import unpack

ROOT = Path(__file__).parents[2]
FILES = (".gitattributes", "LICENSE", "README.md", "pyproject.toml", "setup.py",
         "store/__init__.py", "store/commit.txt", "store/version.py")  # fmt: skip
BACKEND = tomllib.loads((ROOT / "pyproject.toml").read_text())["build-system"]["requires"][0]
INSTALLED = [f"{each.name}=={each.version}" for each in metadata.distributions(name="setuptools")]


def version_in(folder: Path) -> str:
    return str(runpy.run_path(str(folder / "store" / "version.py"))["software_version"]())


def git(folder: Path, *arguments: str) -> bytes:
    person = ("-c", "user.name=Somebody", "-c", "user.email=somebody@example.com")
    return subprocess.run(["git", *person, *arguments], cwd=folder, capture_output=True, check=True).stdout


def build(folder: Path, kind: str) -> Path:
    """The wheel or the source distribution of a source folder, made by the project's own build backend."""
    call = f"import setuptools.build_meta as b; b.build_{kind}('dist')"
    done = subprocess.run([sys.executable, "-c", call], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return next((folder / "dist").iterdir())


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A repository with one commit of the files that the version is made from."""
    folder = tmp_path / "checkout"
    for name in FILES:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, folder / name)
    (folder / ".gitignore").write_text("build/\ndist/\n*.egg-info/\n")
    git(folder, "init", "-q")
    git(folder, "add", ".")
    git(folder, "commit", "-q", "-m", "Begin")
    return folder


@pytest.fixture
def expected(checkout: Path) -> str:
    return f"{release()}+g{git(checkout, 'rev-parse', 'HEAD').decode()[:7]}"


def test_a_checkout_names_its_commit_and_says_when_it_was_changed(checkout: Path, expected: str) -> None:
    assert version_in(checkout) == expected
    (checkout / "README.md").write_text("Changed.\n")
    assert version_in(checkout) == f"{expected}.changed"


def test_an_archive_of_the_sources_names_its_commit(checkout: Path, expected: str, tmp_path: Path) -> None:
    archive = git(checkout, "archive", "HEAD")
    with tarfile.open(fileobj=io.BytesIO(archive)) as packed:
        unpack(packed, tmp_path / "archive")
    assert version_in(tmp_path / "archive") == expected


def test_the_commit_of_a_repository_further_up_is_not_taken(checkout: Path) -> None:
    copy = checkout / "copy"
    shutil.copytree(checkout / "store", copy / "store")
    shutil.copyfile(checkout / "pyproject.toml", copy / "pyproject.toml")
    assert version_in(copy) == f"{release()}+unknown"


def test_without_git_the_commit_is_unknown(checkout: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    assert version_in(checkout) == f"{release()}+unknown"


def test_git_is_asked_once(checkout: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = Mock(wraps=subprocess.run)
    monkeypatch.setattr(subprocess, "run", run)
    module = runpy.run_path(str(checkout / "store" / "version.py"))
    assert module["software_version"]() == module["software_version"]()
    assert run.call_count == 1


@pytest.mark.skipif(BACKEND not in INSTALLED, reason=f"{BACKEND} builds the wheel and is not installed")
@pytest.mark.parametrize("changed", [False, True])
@pytest.mark.parametrize("source_distribution", [False, True])
def test_a_wheel_names_the_commit_that_it_was_built_from(
    checkout: Path, expected: str, tmp_path: Path, changed: bool, source_distribution: bool
) -> None:
    if changed:
        (checkout / "README.md").write_text("Changed.\n")
        expected += ".changed"
    folder = checkout
    if source_distribution:
        with tarfile.open(build(checkout, "sdist")) as packed:
            unpack(packed, tmp_path)
        folder = next(tmp_path.glob("jointlab-*"))
    with zipfile.ZipFile(build(folder, "wheel")) as wheel:
        wheel.extractall(tmp_path / "installed")
    asked = subprocess.run(
        [sys.executable, "-c", "from store.version import software_version; print(software_version())"],
        cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(tmp_path / "installed")}, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert asked.stdout.strip() == expected
    assert "$Format" in (checkout / "store" / "commit.txt").read_text()
