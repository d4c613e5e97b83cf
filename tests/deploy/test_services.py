"""The services of the compose file as processes: same options, TLS proxy, read-only root; updates and the way back."""

import json
import os
import shlex
import shutil
import socket
import ssl
import subprocess
import sys
import tarfile
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path

import httpx
import pytest

from jointlab.trials.simulated_laboratory import as_toml
from simlab.laboratory import Laboratory
from simlab.ordinary import BenchConditions
from store.backup.check import check
from store.catalogue import Catalogue
from store.exchange.bundle_exchange import export_bundle
from store.measurements.runs import list_runs, start_run
from store.service.keys import count_keys
from store.states import ENDED_JOB_STATES, JobState
from tests.archives import unpack
from tests.deploy.test_files import DEPLOY, ROOT, SERVICES, environment_of_service
from tests.ports import free_port
from tests.postgresql_server import NotInstalledError, Server, running_server
from tests.store.conftest import fill
from tests.waiting import LONG, until

VERSION_0_1 = "3c2c1dde8b323f728f0035b131118b1e66bdd51b"
PROGRAM = [sys.executable, "-m", "api.cli"]
READ_ONLY = 'mount --bind "$0" "$0" && mount -o remount,bind,ro / && exec "$@"'
SIGN = b"READY=1\nWATCHDOG=1"


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    """A server of PostgreSQL."""
    try:
        with running_server() as running:
            yield running
    except NotInstalledError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def caddy() -> str:
    """Where the proxy is; `make test` puts it beside the tests' packages."""
    found = shutil.which("caddy", path=f"{os.environ['PATH']}:{sys.prefix}/caddy/usr/bin")
    if found is None:
        pytest.skip("caddy is not installed")
    return found


def read_only(folder: Path) -> list[str]:
    """What is put before a command so that it can write to `folder` alone; nothing where the system allows none."""
    command = ["unshare", "--mount", "sh", "-c", READ_ONLY, str(folder)]
    may = shutil.which("unshare") and subprocess.run([*command, "true"], capture_output=True, check=False)
    return command if may and may.returncode == 0 else []


@dataclass(frozen=True)
class Place:
    """A folder that services may write to, and their environment."""

    folder: Path
    environment: dict[str, str]

    def do(self, *words: str, source: Path = ROOT) -> "subprocess.CompletedProcess[str]":
        """What a command of the program, or of its sources elsewhere, says."""
        return subprocess.run(
            [*PROGRAM, *words],
            env=self.environment | {"PYTHONPATH": str(source)}, cwd=self.folder, text=True, capture_output=True,
            check=False,
        )  # fmt: skip

    @contextmanager
    def service(self, name: str, *more: str, **environment: str) -> Iterator[subprocess.Popen[bytes]]:
        """A service of the compose file, with further options and variables."""
        entry, command = SERVICES[name].get("entrypoint", ["jointlab"]), SERVICES[name]["command"]
        program = {"jointlab": PROGRAM, "dask": [sys.executable, "-m", "dask"]}[entry[0]]
        given = {key: value for key, value in environment_of_service(name).items() if key not in self.environment}
        with (self.folder / f"{name}.log").open("wb") as log, subprocess.Popen(
            [*read_only(self.folder), *program, *command, *more],
            env={**given, **self.environment, **environment}, cwd=self.folder, stdout=log, stderr=log,
        ) as process:  # fmt: skip
            try:
                yield process
            finally:
                process.terminate()


@contextmanager
def place(folder: Path, database: str) -> Iterator[Place]:
    """A folder with the configuration of a simulated laboratory, on a database."""
    for name in ("tmp", "state", "caddy", "backups"):
        (folder / name).mkdir()
    with Laboratory(3, 200.0, BenchConditions(double_hits=0.0)) as laboratory:
        (folder / "jointlab.toml").write_text(as_toml(laboratory.addresses), encoding="utf-8")
        yield Place(
            folder,
            {
                "PATH": os.environ["PATH"],
                "PYTHONPATH": str(ROOT),
                "HOME": "/nonexistent",
                "TMPDIR": str(folder / "tmp"),
                "XDG_STATE_HOME": str(folder / "state"),
                "JOINTLAB_CONFIG": str(folder / "jointlab.toml"),
                "JOINTLAB_DATABASE_URL": database,
                "JOINTLAB_WAVEFORM_FOLDER": str(folder / "waveforms"),
                "OPENBLAS_NUM_THREADS": "1",
            },
        )


def answers(port: int) -> bool:
    with closing(socket.socket()) as line:
        return line.connect_ex(("127.0.0.1", port)) == 0


@contextmanager
def watchdog(folder: Path) -> Iterator[tuple[str, socket.socket]]:
    """Where systemd would hear signs of life, and its address."""
    with closing(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)) as line:
        line.bind(str(folder / "notify"))
        line.settimeout(LONG)
        yield str(folder / "notify"), line


def two_signs_of(process: subprocess.Popen[bytes], signs: socket.socket, said: Path) -> None:
    """Wait for two signs of life, however busy the machine is; a process that ends instead fails with what it said."""
    heard = 0
    while heard < 2:
        try:
            assert signs.recv(100) == SIGN
            heard += 1
        except TimeoutError:
            assert process.poll() is None, said.read_text(encoding="utf-8")


@contextmanager
def telling_logs(folder: Path) -> Iterator[None]:
    """Add to a failure what the services said last."""
    try:
        yield
    except BaseException as error:
        for log in sorted(folder.glob("*.log")):
            error.add_note(f"{log.name}: {log.read_text(encoding='utf-8', errors='replace')[-2000:]}")
        raise


# a short name: the path of a socket in its folder has at most 100 characters
def test_services_behind_tls(server: Server, caddy: str, tmp_path: Path) -> None:
    """They work together, and write to their folder alone."""
    server.execute("CREATE DATABASE {}", "deployed")
    https, http, inside, stop, scheduler = (free_port() for _ in range(5))
    at = f"tcp://127.0.0.1:{scheduler}"
    with Catalogue.open(server.url("deployed"), tmp_path / "waveforms") as catalogue:
        fill(catalogue)
    with place(tmp_path, server.url("deployed")) as lab, telling_logs(tmp_path), ExitStack() as running:
        lab = replace(lab, environment=lab.environment | {"JOINTLAB_SCHEDULER": at})
        key = lab.do("key", "create", "page", *(f"--scope={each}" for each in ("read:data", "run:analysis"))).stdout
        address, signs = running.enter_context(watchdog(tmp_path))
        begin = running.enter_context
        begin(lab.service("scheduler", f"--port={scheduler}", "--host=127.0.0.1"))
        drive = json.dumps({"stop_address": "127.0.0.1", "stop_port": stop})
        driving = begin(lab.service("drive", JOINTLAB_DRIVE=drive, NOTIFY_SOCKET=address))
        begin(lab.service("worker"))
        two_signs_of(driving, signs, lab.folder / "drive.log")  # the service would begin a drive process of its own
        trust = json.dumps({"trusted_proxies": ["127.0.0.1"]})
        begin(lab.service("service", f"--port={inside}", JOINTLAB_SERVICE=trust, JOINTLAB_DRIVE=drive))
        until(lambda: answers(inside))
        with proxied([caddy], lab.folder, https, http, inside) as client:
            client.headers["Authorization"] = f"Bearer {key.strip()}"
            health = client.get("/api/health").json()
            assert (health["status"], health["drives_a_rig"]) == ("ok", True)
            assert [run["kind"] for run in client.get("/api/runs").json()["items"]] == ["sweep", "hammer"]
            check_job(client)
            check_page(client, key.strip(), https)
        assert json.loads(lab.do("stop", "--state").stdout)["phase"] == "idle"
        with socket.create_connection(("127.0.0.1", stop)) as line:
            line.sendall(b"STOP\n")
            assert json.loads(line.makefile().readline())["at_rest"] is True
        check_backup(lab, server)


@contextmanager
def proxied(program: list[str], folder: Path, https: int, http: int, inside: int) -> Iterator[httpx.Client]:
    """A client that reaches the service through the proxy of the compose file."""
    environment = {
        "PATH": os.environ["PATH"],
        "HOME": "/nonexistent",
        "XDG_DATA_HOME": str(folder),
        "XDG_CONFIG_HOME": str(folder),
        "HTTP_PORT": str(http),
        "SITE_ADDRESS": f"https://localhost:{https}",
        "SERVICE_ADDRESS": f"127.0.0.1:{inside}",
    }
    assert set(SERVICES["proxy"]["environment"]) <= set(environment)
    command = [*program, "run", "--config", str(DEPLOY / "Caddyfile"), "--adapter", "caddyfile"]
    root = folder / "caddy" / "pki" / "authorities" / "local" / "root.crt"
    with (
        (folder / "proxy.log").open("wb") as log,
        subprocess.Popen([*read_only(folder), *command], env=environment, stdout=log, stderr=log) as process,
    ):
        try:
            until(lambda: root.exists() and answers(https))
            trust = ssl.create_default_context(cafile=str(root))
            with httpx.Client(base_url=f"https://localhost:{https}", verify=trust, timeout=LONG) as client:
                until(lambda: has_certificate(client))
                yield client
        finally:
            process.terminate()


def has_certificate(client: httpx.Client) -> bool:
    try:
        return client.get("/api/health").status_code == 200
    except httpx.ConnectError:
        return False


def check_job(client: httpx.Client) -> None:
    """A job is done by the worker, and its events come through the proxy while it goes on."""
    asked = client.post("/api/exports", json={"run": 1, "form": "hdf5"}, headers={"Idempotency-Key": "one"})
    assert asked.status_code == 202, asked.text
    with client.stream("GET", f"/api/jobs/{asked.json()['id']}/events") as events:
        told = (json.loads(line[5:]) for line in events.iter_lines() if line.startswith("data:"))
        assert next(each["state"] for each in told if each["state"] in ENDED_JOB_STATES) == JobState.DONE


def check_page(client: httpx.Client, key: str, port: int) -> None:
    """A log-in through the proxy gets a cookie that is secure, and a socket of the page."""
    form = {"key": key}
    logged_in = client.post("/page/log-in", data=form, headers={"Origin": f"https://localhost:{port}"})
    assert logged_in.status_code == 303, logged_in.text
    assert "; secure" in logged_in.headers["set-cookie"].lower()
    cookies = "; ".join(f"{cookie.name}={cookie.value}" for cookie in client.cookies.jar)
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE  # the client has verified it
    with context.wrap_socket(socket.create_connection(("127.0.0.1", port)), server_hostname="localhost") as line:
        lines = (
            "GET /page/_nicegui_ws/socket.io/?EIO=4&transport=websocket HTTP/1.1", f"Host: localhost:{port}",
            f"Origin: https://localhost:{port}", f"Cookie: {cookies}", "Connection: Upgrade", "Upgrade: websocket",
            "Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "", "",
        )  # fmt: skip
        line.sendall("\r\n".join(lines).encode())
        assert line.recv(100).startswith(b"HTTP/1.1 101")


def check_backup(lab: Place, server: Server) -> None:
    """The script keeps the newest backups, and what it has made is restored without a fault."""
    backups = lab.folder / "backups"
    (lab.folder / "jointlab").write_text(f'#!/bin/sh\nexec {shlex.join(PROGRAM)} "$@"\n')
    (lab.folder / "jointlab").chmod(0o755)
    for day in (1, 2, 3):
        (backups / f"jointlab-2020-01-0{day}T020000Z.zip").touch()
    environment = {**lab.environment, "PATH": f"{lab.folder}:{lab.environment['PATH']}"}
    script = ["sh", str(DEPLOY / "backup.sh"), str(backups), "2"]
    done = subprocess.run(script, env=environment, cwd=lab.folder, text=True, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    *_, newest = kept = sorted(backups.iterdir())
    assert [path.name for path in kept[:-1]] == ["jointlab-2020-01-03T020000Z.zip"]
    server.execute("CREATE DATABASE {}", "restored")
    elsewhere = {
        "JOINTLAB_DATABASE_URL": server.url("restored"), "JOINTLAB_WAVEFORM_FOLDER": str(lab.folder / "restored")
    }  # fmt: skip
    restored = replace(lab, environment=lab.environment | elsewhere).do("store", "restore", str(newest))
    assert (restored.returncode, "no damage found" in restored.stdout) == (0, True), restored


def test_a_backup_that_fails_removes_nothing(tmp_path: Path) -> None:
    (tmp_path / "jointlab").write_text("#!/bin/sh\nexit 3\n")
    (tmp_path / "jointlab").chmod(0o755)
    old = tmp_path / "jointlab-2020-01-01T020000Z.zip"
    old.touch()
    environment = {"PATH": f"{tmp_path}:{os.environ['PATH']}"}
    done = subprocess.run(["sh", str(DEPLOY / "backup.sh"), str(tmp_path), "0"], env=environment, check=False)
    assert (done.returncode, old.exists()) == (3, True)


@pytest.fixture(scope="module")
def version_0_1(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sources of version 0.1, as it was."""
    made = subprocess.run(["git", "archive", VERSION_0_1], cwd=ROOT, capture_output=True, check=False)
    if made.returncode != 0:
        pytest.skip("this checkout does not have the history with version 0.1")
    folder = tmp_path_factory.mktemp("version-0.1")
    with tarfile.open(fileobj=BytesIO(made.stdout)) as packed:
        unpack(packed, folder)
    return folder


@pytest.fixture(params=["sqlite", "postgresql"])
def databases(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[tuple[str, str]]:
    """Addresses of two empty databases of a kind."""
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path / 'lab.db'}", f"sqlite:///{tmp_path / 'again.db'}"
        return
    server: Server = request.getfixturevalue("server")
    for name in ("lab", "again"):
        server.execute("CREATE DATABASE {}", name)
    yield server.url("lab"), server.url("again")


def as_version_0_1(configuration: Path) -> None:
    """Take what version 0.1 did not know yet out of the channels."""
    lines = configuration.read_text(encoding="utf-8").splitlines()
    kept = [line for line in lines if not line.startswith(("certificate", "polarity", "noise"))]
    configuration.write_text("\n".join(kept), encoding="utf-8")


def test_a_laboratory_of_version_0_1_is_updated_and_goes_back(
    version_0_1: Path, databases: tuple[str, str], tmp_path: Path
) -> None:
    first, second = databases
    with Catalogue.open(f"sqlite:///{tmp_path / 'source.db'}") as source:
        hammer, sweep = fill(source)
        export_bundle(source, hammer, tmp_path / "bundle", also=[sweep])
    with place(tmp_path, first) as old:
        as_version_0_1(tmp_path / "jointlab.toml")
        imported = old.do("import", str(tmp_path / "bundle"), source=version_0_1)
        assert imported.returncode == 0, imported.stderr
        assert old.do("key", "create", "page", "--scope=read:data", source=version_0_1).returncode == 0
        before = tmp_path / "before.zip"
        assert old.do("store", "backup", str(before), source=version_0_1).returncode == 0
        assert new_work(first, tmp_path / "waveforms") == ["import", "hammer"]
        refused = old.do("store", "check", source=version_0_1)
        assert (refused.returncode, "update jointlab or open another database" in refused.stderr) == (3, True), refused
        environment = {"JOINTLAB_DATABASE_URL": second, "JOINTLAB_WAVEFORM_FOLDER": str(tmp_path / "again")}
        back = replace(old, environment=old.environment | environment)
        restored = back.do("store", "restore", str(before), source=version_0_1)
        assert (restored.returncode, "no damage found" in restored.stdout) == (0, True), restored
        assert new_work(second, tmp_path / "again") == ["import", "hammer"]


def new_work(database: str, waveforms: Path) -> list[str]:
    """Update a database, store another run in it, and look for damage; the kinds of its runs."""
    with Catalogue.open(database, waveforms) as catalogue:
        with catalogue.writing() as session:
            start_run(session, kind="hammer", title="new", article="beam 3", setup={})
        assert not [finding for finding in check(catalogue) if finding.damage]
        with catalogue.reading() as session:
            assert count_keys(session) == 1
            return [run.kind for run in list_runs(session)][::-1]
