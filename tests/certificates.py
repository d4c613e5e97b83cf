"""Certificates of this computer for tests."""

import shutil
import subprocess
from pathlib import Path

import pytest


def certificate_in(folder: Path, name: str) -> tuple[Path, Path]:
    """A certificate for a name such as ``DNS:localhost``, and its key; skips the test where openssl is missing."""
    program = shutil.which("openssl")
    if program is None:
        pytest.skip("no openssl here to make a certificate")
    paths = folder / "certificate.pem", folder / "key.pem"
    subprocess.run(
        [
            program, "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", "/CN=localhost",
            "-addext", f"subjectAltName={name}", "-out", paths[0], "-keyout", paths[1],
        ],
        check=True, capture_output=True,
    )  # fmt: skip
    return paths
