"""The version of this software: the release from `pyproject.toml`, and the commit it was made from.

The commit is in `commit.txt`: `git archive` writes it there by `.gitattributes`, the build of a wheel or of a source
distribution by `setup.py`. In a checkout the file holds git's placeholder, and git is asked. Needs the standard
library only, because `setup.py` runs this file before anything is installed.
"""

import subprocess
import tomllib
from functools import cache
from importlib import metadata
from pathlib import Path

_ROOT = Path(__file__).parents[1]
_COMMIT_FILE = Path(__file__).with_name("commit.txt")
_DIGITS = 7
_CHANGED = ".changed"


@cache
def software_version() -> str:
    """Release and commit, such as ``0.2.0+g1a2b3c4``; ``.changed`` follows where a tracked file differs from it.

    ``0.2.0+unknown`` where neither git nor `commit.txt` names the commit. Found once for each process.
    """
    commit = commit_name()
    return f"{release()}+{f'g{commit}' if commit else 'unknown'}"


@cache
def release() -> str:
    """The number of the release, such as ``0.2.0``: of the source folder, or of the installed distribution."""
    try:
        return str(tomllib.loads((_ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"])
    except FileNotFoundError:
        return metadata.version("jointlab")


def commit_name() -> str | None:
    """The first digits of the commit, with ``.changed`` where a tracked file differs from it; None if not known."""
    recorded = _COMMIT_FILE.read_text(encoding="utf-8").strip()
    if not recorded.startswith("$Format"):
        commit, changed, _ = recorded.partition(_CHANGED)
        return commit[:_DIGITS] + changed or None
    if not (_ROOT / ".git").exists():  # git would answer for a repository further up
        return None
    command = ["git", "--no-optional-locks", "-C", str(_ROOT), "describe", "--always", "--exclude=*"]
    command += [f"--abbrev={_DIGITS}", f"--dirty={_CHANGED}"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):  # git is not installed, or does not trust the folder
        return None
