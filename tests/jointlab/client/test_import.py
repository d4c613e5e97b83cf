"""The client starts fast: it imports only a few packages, none of which needs a laboratory's computer."""

import subprocess
import sys

import pytest

# of `daq` the errors, which import nothing
OURS = {"analysis", "daq", "jointlab", "rig", "store"}
NEEDED = {"httpx", "pydantic", "yaml"}
# imported by the three above
BY_THEM = {
    "annotated_types", "anyio", "certifi", "click", "h11", "httpcore", "idna", "pydantic_core", "pygments", "rich",
    "sniffio", "typing_extensions", "typing_inspection",
}  # fmt: skip
# imported by any Python that has an editable installation, or extension modules by Cython
BY_PYTHON = {"cython_runtime", "sitecustomize", "usercustomize"}


@pytest.mark.parametrize(
    ("module", "allowed"), [("jointlab", {"jointlab"}), ("jointlab.client", OURS | NEEDED | BY_THEM)]
)
def test_only_light_packages_are_imported(module: str, allowed: set[str]) -> None:
    program = f"import sys, {module}; print(*{{name.split('.')[0] for name in sys.modules}})"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    imported = {name for name in done.stdout.split() if not name.startswith("_")}
    assert imported - sys.stdlib_module_names - BY_PYTHON <= allowed
