"""Mosquitto, a broker of MQTT, on loopback in a process of its own that a test may kill."""

import shutil
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from tests.waiting import until

PLACES = "/usr/sbin:/usr/local/sbin:/usr/bin:/usr/local/bin:/opt/homebrew/sbin"


@contextmanager
def broker_process(
    port: int, user: tuple[str, str] | None = None, tls: tuple[Path, Path] | None = None
) -> Iterator["subprocess.Popen[bytes]"]:
    """A broker that keeps nothing on disk; skips the test where Mosquitto is not installed.

    Args:
        port: on which it listens.
        user: name and password of the only one who may enter; everybody by default.
        tls: certificate and key, where the connection is encrypted.
    """
    program = shutil.which("mosquitto", path=PLACES)
    if program is None:
        pytest.skip("Mosquitto is not installed; tests/install_programs.sh installs it")
    with TemporaryDirectory() as folder:
        # as root it would change to a user who may not read these files
        lines = [f"listener {port} 127.0.0.1", f"allow_anonymous {str(user is None).lower()}", "user root"]
        if user is not None:
            passwords = Path(folder) / "passwords"
            subprocess.run(["mosquitto_passwd", "-b", "-c", passwords, *user], check=True, capture_output=True)
            lines.append(f"password_file {passwords}")
        if tls is not None:
            lines += [f"certfile {tls[0]}", f"keyfile {tls[1]}"]
        configuration = Path(folder) / "mosquitto.conf"
        configuration.write_text("\n".join(lines) + "\n", encoding="utf-8")
        quiet = subprocess.DEVNULL
        with subprocess.Popen([program, "-c", configuration], stdout=quiet, stderr=quiet) as process:
            try:
                until(lambda: process.poll() is not None or _answers(port))
                assert process.poll() is None, "Mosquitto has ended"
                yield process
            finally:
                process.kill()


def _answers(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), 5).close()
    except ConnectionRefusedError:
        return False
    return True
