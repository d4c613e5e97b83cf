"""STOP from the press to the confirmed rest, while a sweep cycles in real time, under all that can go wrong around it.

Everything is a process of its own: simulated instruments, drive process, service. Each press asks the STOP listener
over its socket, as the page's button does; then STOP is reset and the sweep goes on as a new run. The instrument's own
ramp, its exponential stop from the amplitude that it cycled with to the amplitude that it calls rest, is taken off.

`PRESSES` in the environment is the number of presses in all, 160 by default; a full run has 2,000.
"""

import math
import os
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from subprocess import Popen

import httpx
import numpy as np

from jointlab.drive.phase import Phase
from jointlab.drive.protocol import AnswerPrompt, Begin, News, ResetStop, Snapshot
from jointlab.settings import DriveSettings, Settings
from jointlab.supervision.drive_link import DriveLink
from jointlab.trials.simulated_laboratory import as_toml, simulated_settings
from rig.records import RunOrder
from rig.sequence import sequence_from
from rig.tester_limits import TesterLimits
from simlab.actuator import Servo
from simlab.laboratory import LaboratoryProcess
from simlab.tester_device import REST_WITHIN
from tests.api.conftest import paper
from tests.postgresql_server import NotInstalledError, Server, running_server

AMPLITUDE_PP = 1e-4  # m
RAMP = Servo().stopping_time * math.log(AMPLITUDE_PP / REST_WITHIN)  # s
PRESSES = int(os.environ.get("PRESSES", "160"))
TOGETHER = 300
HALF_OPEN = 2000
ANSWER = 10.0  # s
SWEEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [1e3 * AMPLITUDE_PP],
    "frequencies": {"first": 20, "last": 200, "step": 0.25},
}  # fmt: skip


@dataclass
class Bench:
    """The processes around one press.

    Attributes:
        presses: makes one press, or many at once; the time of each in s, and what each was answered.
    """

    link: DriveLink
    laboratory: LaboratoryProcess
    folder: Path
    service: Popen[str]
    address: str
    database: Server | None
    port: int
    news: list[News] = field(default_factory=list)

    @property
    def now(self) -> Snapshot:
        return self.news[-1].snapshot if self.news else Snapshot()

    def cycle(self, number: int) -> None:
        """Begin a run, and see it measure."""
        lease = self.link.take_lease("bench")
        if self.now.stop is not None:
            self.link.ask(ResetStop(epoch=self.now.stop.epoch, lease=lease))
        sequence = sequence_from(paper() | {"steps": [SWEEP]}).with_seed()
        order = RunOrder(number, f"bench-{number}", sequence, "bench")
        self.link.ask(Begin(order=order, limits=TesterLimits(), lease=lease), 60.0)
        wait(lambda: self.now.prompt is not None and self.now.state.run_id == number)
        assert self.now.prompt is not None
        self.laboratory.operator.do("mount", specimen="I", configuration="shear")
        self.link.ask(AnswerPrompt(run_id=number, prompt=self.now.prompt.number, lease=lease))
        wait(lambda: self.now.state.sines > 0)

    def press(self) -> float:
        """One press: s until the answer says that the actuator is at rest; infinity where it does not."""
        began = time.perf_counter()
        try:
            with closing(socket.create_connection(("127.0.0.1", self.port), ANSWER)) as connection:
                connection.sendall(b"POST /stop HTTP/1.1\r\nHost: rig\r\n\r\n")
                answer = b"".join(iter(lambda: connection.recv(4096), b""))
        except OSError:
            return math.inf
        return time.perf_counter() - began if b'"at_rest": true' in answer else math.inf

    def rests(self) -> None:
        """Wait until the run has ended, and the presses are told."""
        wait(lambda: self.now.state.phase is Phase.IDLE and self.now.stop is not None)
        time.sleep(0.3)


def wait(holds: Callable[[], bool]) -> None:
    """Wait until something holds."""
    end = time.monotonic() + 120.0
    while not holds():
        if time.monotonic() > end:
            raise TimeoutError("the bench waited in vain")
        time.sleep(0.002)


@contextmanager
def one_by_one(bench: Bench) -> Iterator[Callable[[], list[float]]]:
    """Nothing else happens."""
    yield lambda: [bench.press()]


@contextmanager
def silent_database(bench: Bench) -> Iterator[Callable[[], list[float]]]:
    """The database accepts and answers nothing, and the page is asked for."""
    assert bench.database is not None
    bench.database.send(signal.SIGSTOP)
    try:
        with flooding(bench, "/page/measure", 4):
            yield lambda: [bench.press()]
    finally:
        bench.database.send(signal.SIGCONT)


@contextmanager
def full_disk(bench: Bench) -> Iterator[Callable[[], list[float]]]:
    """The disk of the spool is filled a moment before the press."""
    filler = bench.folder / "filler"

    def press() -> list[float]:
        with open(filler, "wb", buffering=0) as file, suppress(OSError):
            while True:
                file.write(bytes(2**20))
        return [bench.press()]

    try:
        yield press
    finally:
        filler.unlink(missing_ok=True)


@contextmanager
def large_bodies(bench: Bench) -> Iterator[Callable[[], list[float]]]:
    """Bodies of 500 MB are sent to the listener and to the service without an end."""
    over = threading.Event()

    def send(port: int, path: str) -> None:
        head = f"POST {path} HTTP/1.1\r\nHost: rig\r\nContent-Length: 500000000\r\n\r\n".encode()
        while not over.is_set():
            with suppress(OSError), closing(socket.create_connection(("127.0.0.1", port), ANSWER)) as connection:
                connection.sendall(head)
                for _ in range(500):
                    connection.sendall(bytes(10**6))

    service = int(bench.address.rsplit(":", 1)[1])
    senders = [threading.Thread(target=send, args=at) for at in ((bench.port, "/state"), (service, "/api/runs"))]
    for each in senders:
        each.start()
    try:
        yield lambda: [bench.press()]
    finally:
        over.set()
        for each in senders:
            each.join()


@contextmanager
def half_open(bench: Bench) -> Iterator[Callable[[], list[float]]]:
    """2,000 connections stay half open at the listener, and are opened again as it drops them."""
    over, opened = threading.Event(), list[socket.socket]()

    def open_all() -> None:
        while not over.is_set():
            while len(opened) < HALF_OPEN and not over.is_set():
                with suppress(OSError):
                    opened.append(socket.create_connection(("127.0.0.1", bench.port), ANSWER))
                    opened[-1].sendall(b"POST /st")
            while opened:
                opened.pop().close()

    opening = threading.Thread(target=open_all)
    opening.start()
    try:
        yield lambda: [bench.press()]
    finally:
        over.set()
        opening.join()
        for each in opened:
            each.close()


@contextmanager
def all_at_once(bench: Bench) -> Iterator[Callable[[], list[float]]]:
    """300 presses at once."""
    with ThreadPoolExecutor(TOGETHER) as pressing:
        yield lambda: list(pressing.map(lambda _: bench.press(), range(TOGETHER)))


@contextmanager
def flooding(bench: Bench, path: str, clients: int) -> Iterator[None]:
    over = threading.Event()

    def ask() -> None:
        with httpx.Client(timeout=2.0) as client:
            while not over.is_set():
                with suppress(httpx.HTTPError):
                    client.get(f"{bench.address}{path}")

    asking = [threading.Thread(target=ask) for _ in range(clients)]
    for each in asking:
        each.start()
    try:
        yield
    finally:
        over.set()
        for each in asking:
            each.join()


@contextmanager
def page_flooded(bench: Bench) -> Iterator[Callable[[], list[float]]]:
    """The page is asked for by 16 clients without a pause."""
    with flooding(bench, "/page/measure", 16):
        yield lambda: [bench.press()]


@contextmanager
def service_frozen(bench: Bench) -> Iterator[Callable[[], list[float]]]:
    """The service is frozen."""
    bench.service.send_signal(signal.SIGSTOP)
    try:
        yield lambda: [bench.press()]
    finally:
        bench.service.send_signal(signal.SIGCONT)


@contextmanager
def service_killed(bench: Bench) -> Iterator[Callable[[], list[float]]]:
    """The service is killed; it is the last condition."""
    bench.service.kill()
    yield lambda: [bench.press()]


CONDITIONS = (
    one_by_one, silent_database, full_disk, large_bodies, half_open, all_at_once, page_flooded, service_frozen,
    service_killed,
)  # fmt: skip


@contextmanager
def small_disk(folder: Path) -> Iterator[Path]:
    """A file system of 400 MB; a folder where none can be mounted, and then no disk is filled."""
    folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=400m", "tmpfs", str(folder)], check=False, capture_output=True
    )
    try:
        yield folder
    finally:
        if mounted.returncode == 0:
            subprocess.run(["umount", str(folder)], check=False)


@contextmanager
def drive_process(settings: Settings, given: Path) -> Iterator[Popen[bytes]]:
    """A drive process, which waits for nobody."""
    given.write_text(settings.model_dump_json(), encoding="utf-8")
    process = Popen([sys.executable, "-m", "jointlab.drive", str(given)])
    try:
        yield process
    finally:
        process.terminate()
        process.wait()


@contextmanager
def service_process(config: Path, database: str, output: Path) -> Iterator[tuple[Popen[str], str]]:
    """`jointlab serve` in a process of its own, and its address."""
    environment = os.environ | {
        "JOINTLAB_DATABASE_URL": database,
        "JOINTLAB_CONFIG": str(config),
        "JOINTLAB_WAVEFORM_FOLDER": str(config.with_name("jointlab-waveforms")),
    }
    with output.open("w") as errors:
        service = Popen(
            [sys.executable, "-u", "-m", "api.cli", "serve", "--port", "0"],
            env=environment, stdout=subprocess.PIPE, stderr=errors, text=True,
        )  # fmt: skip
        assert service.stdout is not None
        try:
            line = service.stdout.readline()
            if "/api/health" not in line:
                raise RuntimeError(f"the service did not start: {output.read_text()}")
            yield service, line.split("/api/health")[0]
        finally:
            service.send_signal(signal.SIGCONT)
            service.terminate()
            service.wait()


@contextmanager
def benched() -> Iterator[Bench]:
    """All processes."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="stop-")))
        disk = stack.enter_context(small_disk(folder / "disk"))
        laboratory = stack.enter_context(LaboratoryProcess(seed=1, speed=1.0))
        database, url = None, f"sqlite:///{folder / 'jointlab.db'}"
        with suppress(NotInstalledError):
            database = stack.enter_context(running_server())
            url = database.url("postgres")
        drive = DriveSettings(folder=disk, stop_port=0)
        settings = simulated_settings(laboratory.addresses, drive=drive)
        config = folder / "jointlab.toml"
        text = f'{as_toml(laboratory.addresses)}\n[drive]\nfolder = "{disk}"\nstop_port = 0\n'
        config.write_text(text, encoding="utf-8")
        stack.enter_context(drive_process(settings, folder / "settings.json"))
        wait(lambda: (disk / "drive.socket").exists())
        service, address = stack.enter_context(service_process(config, url, folder / "service.log"))
        news = list[News]()
        link = stack.enter_context(
            closing(DriveLink(settings, "bench", news.append, print, lambda welcome: None, starts=False))
        )
        port = link.welcome.stop_port
        yield Bench(link, laboratory, disk, service, address, database, port, news)


def main() -> None:
    """Press STOP under each condition; print quantiles in ms and how many presses were lost."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (resource.getrlimit(resource.RLIMIT_NOFILE)[1],) * 2)
    chance, number, everything = np.random.default_rng(4), 0, list[float]()
    with benched() as bench:
        conditions = [each for each in CONDITIONS if bench.database is not None or each is not silent_database]
        print(f"the instrument's own ramp, {1e3 * RAMP:.0f} ms, is taken off", flush=True)
        for condition in conditions:
            took, wanted = list[float](), math.ceil(PRESSES / len(conditions))
            while len(took) < wanted:
                number += 1
                bench.cycle(number)
                with condition(bench) as press:
                    time.sleep(float(chance.uniform(0.2, 1.0)))
                    took += press()
                bench.rests()
                bench.news[:] = bench.news[-1:]
            everything += took
            show(condition.__name__.replace("_", " "), np.array(took))
        show("all", np.array(everything))


def show(what: str, took: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
    """Print one line."""
    known = 1e3 * (took[np.isfinite(took)] - RAMP)
    median, most, worst = np.percentile(known, [50, 99, 100]) if known.size else (math.nan,) * 3
    print(
        f"{what:<20} {took.size:5d} presses, {took.size - known.size} lost   median {median:7.1f} ms   "
        f"99 % {most:7.1f} ms   worst {worst:7.1f} ms",
        flush=True,
    )
