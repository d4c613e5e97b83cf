"""STOP from the press to the confirmed rest, while a sweep cycles in real time, under all that can go wrong around it.

Everything is a process of its own: simulated instruments, drive process, service, and who disturbs. Each press asks the
STOP listener over its socket, as the page's button does; then STOP is reset and the sweep begins again. The time to
rest is that of the instrument's own record; the time to the answer is longer, as rest is confirmed before. The
instrument's ramp, its exponential stop from the amplitude that it cycled with to the amplitude that it calls rest, is
taken off both. Instruments and who presses come first of all processes, because they stand for what has processors of
its own; `SHARED=1` in the environment lets them wait for their turn like the others.

`PRESSES` in the environment is the number of presses in all, 160 by default; a full run has 2,000. `CONDITIONS` are the
names of those to try, such as "full_disk half_open"; all by default.
"""

import math
import multiprocessing
import os
import re
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

from daq.errors import DaqError
from jointlab.drive.endpoint import connect
from jointlab.drive.phase import Phase
from jointlab.drive.priority import REAL_TIME
from jointlab.drive.protocol import Acknowledge, AnswerPrompt, Begin, LookAtChannel, News, ResetStop, Snapshot
from jointlab.settings import DriveSettings, Settings
from jointlab.supervision.drive_link import DriveLink
from jointlab.trials.simulated_laboratory import as_toml, simulated_settings
from rig.errors import RigError
from rig.runs.records import RunOrder
from rig.sequences.sequence import sequence_from
from rig.tester.limits import TesterLimits
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
START = 300.0  # s, of one who disturbs
LEFT_FREE = 2 * 10**9  # bytes
PAGE = 4096  # bytes
BATCH = 20  # presses between the beginning and the end of a condition
STEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [1e3 * AMPLITUDE_PP],
    "frequencies": {"first": 20, "last": 200, "step": 0.25}, "preset_mm": 0.0,
}  # fmt: skip
SWEEP = sequence_from(paper() | {"steps": [STEP]}).with_seed()


@dataclass
class Times:
    """Times in s from a press: of all presses to their answers, of each first one to the rest of the actuator."""

    answers: list[float] = field(default_factory=list)
    rests: list[float] = field(default_factory=list)


@dataclass
class Bench:
    """The processes around one press.

    Attributes:
        news: the latest from the drive process.
        failed: why runs ended before they were stopped.
        coils: stops that ended in the emergency stop.
        pressed: time of each press since the last one was counted, s of `time.monotonic`.
    """

    link: DriveLink
    laboratory: LaboratoryProcess
    folder: Path
    service: Popen[str]
    address: str
    database: Server | None
    port: int
    news: list[News] = field(default_factory=list)
    pressed: list[float] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)
    coils: int = 0

    @property
    def now(self) -> Snapshot:
        return self.news[-1].snapshot if self.news else Snapshot()

    def motion(self) -> dict[str, float | None]:
        found: dict[str, float | None] = self.laboratory.operator.do("motion")
        return found

    def cycle(self, number: int) -> bool:
        """Begin a run, and see the actuator cycle; whether it does. A run that ends before is noted."""
        lease = self.link.take_lease("bench")
        if self.now.stop is not None:
            self.link.ask(ResetStop(epoch=self.now.stop.epoch, lease=lease))
        if self.now.state.interlocks:
            self.coils += 1
            self.link.ask(Acknowledge(lease=lease))
        order = RunOrder(number, f"bench-{number}", SWEEP, "bench")
        try:
            self.link.ask(Begin(order=order, limits=TesterLimits(), lease=lease), 60.0)
        except (RigError, DaqError) as error:
            self.failed.append(str(error))
            return False
        wait(lambda: self.now.state.run_id == number and (self.now.prompt is not None or self._has_ended()))
        if self.now.prompt is None:
            self.failed.append(self.now.state.reason or "")
            return False
        self.laboratory.operator.do("mount", specimen="I", configuration="shear")
        self.link.ask(AnswerPrompt(run_id=number, prompt=self.now.prompt.number, lease=lease))
        wait(lambda: self.motion()["rests_since"] is None or self._has_ended())
        if self._has_ended():
            self.failed.append(self.now.state.reason or "")
        return not self._has_ended()

    def _has_ended(self) -> bool:
        return self.now.state.phase is Phase.IDLE

    def press(self) -> float:
        """One press: s until the answer says that the actuator is at rest; infinity where it does not."""
        began = time.monotonic()
        self.pressed.append(began)
        try:
            with closing(socket.create_connection(("127.0.0.1", self.port), ANSWER)) as connection:
                connection.sendall(b"POST /stop HTTP/1.1\r\nHost: rig\r\n\r\n")
                answer = b"".join(iter(lambda: connection.recv(4096), b""))
        except OSError:
            return math.inf
        return time.monotonic() - began if b'"at_rest": true' in answer else math.inf

    def rest(self) -> float:
        """Wait until the run has ended; s from the first press to the rest of the actuator, by its own physics."""
        wait(lambda: self.now.state.phase is Phase.IDLE and self.now.stop is not None)
        since = self.motion()["rests_since"]
        began = min(self.pressed)
        self.pressed.clear()
        return math.inf if since is None else since - began


def wait(holds: Callable[[], bool]) -> None:
    """Wait until something holds."""
    end = time.monotonic() + 120.0
    while not holds():
        if time.monotonic() > end:
            raise TimeoutError("the bench waited in vain")
        time.sleep(0.002)


Press = Callable[[], list[float]]


@contextmanager
def one_by_one(bench: Bench) -> Iterator[Press]:
    """Nothing else happens."""
    yield lambda: [bench.press()]


@contextmanager
def silent_database(bench: Bench) -> Iterator[Press]:
    """The database accepts and answers nothing, and the page is asked for."""
    assert bench.database is not None
    bench.database.send(signal.SIGSTOP)
    try:
        with elsewhere(ask, f"{bench.address}/page/measure", 4):
            yield lambda: [bench.press()]
    finally:
        bench.database.send(signal.SIGCONT)


@contextmanager
def full_disk(bench: Bench) -> Iterator[Press]:
    """The disk of the spool is filled a moment before the press."""
    filler = bench.folder / "filler"

    def press() -> list[float]:
        with open(filler, "wb", buffering=0) as file, suppress(OSError):
            while True:
                file.write(bytes(2**20))
        took = bench.press()
        filler.unlink()
        return [took]

    yield press


@contextmanager
def large_bodies(bench: Bench) -> Iterator[Press]:
    """Bodies of 500 MB are sent to the listener and to the service without an end."""
    service = int(bench.address.rsplit(":", 1)[1])
    with elsewhere(send_bodies, bench.port, "/state"), elsewhere(send_bodies, service, "/api/runs"):
        yield lambda: [bench.press()]


@contextmanager
def half_open(bench: Bench) -> Iterator[Press]:
    """2,000 connections stay half open at the listener, and are opened again as it drops them."""
    with elsewhere(open_half, bench.port):
        yield lambda: [bench.press()]


@contextmanager
def all_at_once(bench: Bench) -> Iterator[Press]:
    """300 presses at once."""
    with ThreadPoolExecutor(TOGETHER) as pressing:
        yield lambda: list(pressing.map(lambda _: bench.press(), range(TOGETHER)))


@contextmanager
def page_flooded(bench: Bench) -> Iterator[Press]:
    """The page is asked for by 16 clients without a pause."""
    with elsewhere(ask, f"{bench.address}/page/measure", 16):
        yield lambda: [bench.press()]


@contextmanager
def channels_asked(bench: Bench) -> Iterator[Press]:
    """Four programs ask for a channel without a pause, which the drive process refuses beside a run."""
    with elsewhere(look, bench.folder, 4):
        yield lambda: [bench.press()]


@contextmanager
def memory_pressure(bench: Bench) -> Iterator[Press]:
    """Another program takes all memory but 2 GB, and half of the swap, and writes to every page of it again and again.

    Where there is no swap, files in memory are dropped, programs among them, and read again; nothing is swapped out.
    """
    known = dict(re.findall(r"(\w+):\s+(\d+) kB", Path("/proc/meminfo").read_text()))
    size = 1024 * (int(known["MemAvailable"]) + int(known["SwapFree"]) // 2) - LEFT_FREE
    with elsewhere(touch, max(size, 0)):
        yield lambda: [bench.press()]


@contextmanager
def service_frozen(bench: Bench) -> Iterator[Press]:
    """The service is frozen."""
    bench.service.send_signal(signal.SIGSTOP)
    try:
        yield lambda: [bench.press()]
    finally:
        bench.service.send_signal(signal.SIGCONT)


@contextmanager
def service_killed(bench: Bench) -> Iterator[Press]:
    """The service is killed; it is the last condition."""
    bench.service.kill()
    yield lambda: [bench.press()]


CONDITIONS = (
    one_by_one, silent_database, full_disk, large_bodies, half_open, all_at_once, page_flooded, channels_asked,
    memory_pressure, service_frozen, service_killed,
)  # fmt: skip


def come_first_of_all(process: int) -> None:
    """Let all threads of a process come before others, and not those that it starts."""
    policy = os.SCHED_RR | os.SCHED_RESET_ON_FORK
    for thread in Path(f"/proc/{process}/task").iterdir():
        os.sched_setscheduler(int(thread.name), policy, os.sched_param(2 * REAL_TIME))


@contextmanager
def elsewhere(work: Callable[..., None], *arguments: object) -> Iterator[None]:
    """Let a process of its own do `work`, so that it does not delay the presses here; it says when it is under way."""
    spawning = multiprocessing.get_context("spawn")
    under_way = spawning.Event()
    process = spawning.Process(target=work, args=(*arguments, under_way.set), daemon=True)
    process.start()
    try:
        assert under_way.wait(START), f"{work.__name__} did not begin"
        yield
    finally:
        process.kill()
        process.join()


def ask(url: str, clients: int, under_way: Callable[[], None]) -> None:
    """Ask for a page without an end."""

    def one() -> None:
        with httpx.Client(timeout=2.0) as client:
            while True:
                with suppress(httpx.HTTPError):
                    client.get(url)
                under_way()

    for _ in range(clients):
        threading.Thread(target=one).start()


def look(folder: Path, clients: int, under_way: Callable[[], None]) -> None:
    """Ask the drive process of `folder` for a channel without an end."""
    request = LookAtChannel(channel="hammer", lease=0).model_dump_json().encode() + b"\n"

    def one() -> None:
        with closing(connect(folder, ANSWER)) as connection, connection.makefile("rb") as answers:
            while True:
                connection.sendall(request)
                answers.readline()
                under_way()

    for _ in range(clients):
        threading.Thread(target=one).start()


def send_bodies(port: int, path: str, under_way: Callable[[], None]) -> None:
    """Send bodies of 500 MB without an end."""
    head = f"POST {path} HTTP/1.1\r\nHost: rig\r\nContent-Length: 500000000\r\n\r\n".encode()
    while True:
        with suppress(OSError), closing(socket.create_connection(("127.0.0.1", port), ANSWER)) as connection:
            connection.sendall(head)
            under_way()
            for _ in range(500):
                connection.sendall(bytes(10**6))


def open_half(port: int, under_way: Callable[[], None]) -> None:
    """Open 2,000 connections that do not ask to the end, and again, without an end."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (resource.getrlimit(resource.RLIMIT_NOFILE)[1],) * 2)
    opened = list[socket.socket]()
    while True:
        while len(opened) < HALF_OPEN:
            with suppress(OSError):
                opened.append(socket.create_connection(("127.0.0.1", port), ANSWER))
                opened[-1].sendall(b"POST /st")
        under_way()
        while opened:
            opened.pop().close()


def touch(size: int, under_way: Callable[[], None]) -> None:
    """Write to every page of `size` bytes without an end; the first that is ended where memory runs out."""
    Path("/proc/self/oom_score_adj").write_text("1000")
    pages = np.zeros(size, np.uint8)[::PAGE]
    pages += 1
    os.nice(19)
    while True:
        under_way()
        pages += 1


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
    with output.open("a") as errors:
        service = Popen(
            [sys.executable, "-u", "-m", "api.cli", "serve", "--port", "0"],
            env=environment, stdout=subprocess.PIPE, stderr=errors, text=True,
        )  # fmt: skip
        assert service.stdout is not None
        try:
            line = service.stdout.readline()
            if "/api/health" not in line:
                raise RuntimeError(f"the service did not start: {output.read_text()}")
            yield service, line.partition("health ")[2].partition("/api/health")[0]
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
        if "SHARED" not in os.environ:
            for process in (laboratory.process, os.getpid()):
                come_first_of_all(process)
        yield Bench(link, laboratory, disk, service, address, database, port, news)


def main() -> None:
    """Press STOP under each condition; print quantiles in ms and how many presses were lost."""
    chance, number, everything = np.random.default_rng(4), 0, Times()
    with benched() as bench:
        wanted = os.environ.get("CONDITIONS", " ".join(each.__name__ for each in CONDITIONS)).split()
        conditions = [each for each in CONDITIONS if each.__name__ in wanted]
        if bench.database is None and silent_database in conditions:
            conditions.remove(silent_database)
        print(f"the instrument's own ramp, {1e3 * RAMP:.0f} ms, is taken off", flush=True)
        for condition in conditions:
            times, began = Times(), time.monotonic()
            while len(times.answers) < math.ceil(PRESSES / len(conditions)):
                with condition(bench) as press:
                    for _ in range(min(BATCH, math.ceil(PRESSES / len(conditions)) - len(times.answers))):
                        number += 1
                        while not bench.cycle(number):
                            number += 1
                        time.sleep(float(chance.uniform(0.1, 0.6)))
                        times.answers += press()
                        times.rests.append(bench.rest())
                        bench.news[:] = bench.news[-1:]
                        if condition is all_at_once:
                            break
            everything.answers += times.answers
            everything.rests += times.rests
            took = (time.monotonic() - began) / len(times.rests)
            show(f"{condition.__name__.replace('_', ' ')} ({took:.1f} s each)", times)
        show("all", everything)
        print(f"{bench.coils} stops ended in the emergency stop")
        print(f"{len(bench.failed)} runs ended before they were stopped", *dict.fromkeys(bench.failed), sep="\n  ")


def show(what: str, times: Times) -> None:
    """Print one line."""
    lost = sum(map(math.isinf, times.answers))
    print(f"{what:<30} {len(times.answers):5d} presses, {lost} lost", end="", flush=True)
    for name, each in (("at rest", times.rests), ("answered", times.answers)):
        known = [1e3 * (one - RAMP) for one in each if math.isfinite(one)]
        median, most, worst = np.percentile(known, [50, 99, 100]) if known else (math.nan,) * 3
        print(f"   {name}: median {median:6.1f}  99 % {most:6.1f}  worst {worst:6.1f} ms", end="", flush=True)
    print(flush=True)
