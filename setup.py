"""Has a wheel and a source distribution carry the commit that they are made from; `pyproject.toml` has the rest."""

import runpy
from collections.abc import Iterable
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

COMMIT = runpy.run_path(str(Path(__file__).parent / "store" / "version.py"))["commit_name"]()


def write_commit(folder: str) -> None:
    """Write the commit to the copy of `store/commit.txt` in `folder`."""
    if COMMIT is not None:
        copy = Path(folder) / "store" / "commit.txt"
        copy.unlink(missing_ok=True)  # it may be a hard link to the source
        copy.write_text(COMMIT + "\n", encoding="utf-8")


class BuildWithCommit(build_py):
    """Copies the packages, and writes the commit to the copy."""

    def run(self) -> None:
        """Copy, then write; an editable installation is a checkout and asks git."""
        super().run()
        if not self.editable_mode:
            write_commit(self.build_lib)


class ArchiveWithCommit(sdist):
    """Collects the sources, and writes the commit beside them."""

    def make_release_tree(self, base_dir: str, files: Iterable[str]) -> None:
        """Collect, then write."""
        super().make_release_tree(base_dir, files)
        write_commit(base_dir)


setup(cmdclass={"build_py": BuildWithCommit, "sdist": ArchiveWithCommit})
