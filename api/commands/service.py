"""`jointlab serve`: the REST service, in front of the configured instruments or simulated ones."""

import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path
from typing import Annotated
from urllib.parse import urlsplit

import typer

from api.commands.log_options import LogFormOption, LogLevel, with_log_options
from api.commands.terminal import open_catalogue, out
from api.service.application import create_app
from api.service.context import Services
from api.service.server import make_server, raise_descriptor_limit, tls_of
from jointlab.alarms.alarms import Alarms, channels_of
from jointlab.channel_file import ChannelFile
from jointlab.errors import JointlabError
from jointlab.hall import Hall
from jointlab.jobs.executors import DaskExecutor, Executor, ProcessExecutor
from jointlab.jobs.limits import JobLimits
from jointlab.jobs.queue import JobQueue
from jointlab.logs import write_logs
from jointlab.loopback import is_loopback
from jointlab.memory import keep_memory_flat
from jointlab.runs.carry_out import store_spools
from jointlab.settings import Settings, config_path, load_settings, state_folder
from jointlab.supervision.automatic_operator import AutomaticOperator
from jointlab.supervision.manager import RunManager
from jointlab.systemd import SignsOfLife
from jointlab.traces import send_traces
from jointlab.trials.simulated_operator import SimulatedOperator, operator_at
from store.catalogue import Catalogue
from store.service.keys import count_keys

LOOPBACK = "127.0.0.1"
SWITCH = 1e-3  # s that one thread may keep the others waiting; the run and STOP are threads among those of readers


def serve(
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0: any free one.")] = 8000,
    host: Annotated[
        str, typer.Option(help="Address; any but the loopback address needs keys: jointlab key create.")
    ] = LOOPBACK,
    simulated: Annotated[bool, typer.Option("--simulated", help="Drive simulated instruments, started here.")] = False,
    seed: Annotated[int, typer.Option(min=0, help="Which simulated bench is drawn.")] = 1,
    speed: Annotated[float, typer.Option(min=0.01, max=1000, help="Simulated bench time over wall time.")] = 1.0,
    tls_certificate: Annotated[
        Path | None, typer.Option(exists=True, dir_okay=False, help="Encrypt: certificate and chain, a PEM file.")
    ] = None,
    tls_key: Annotated[
        Path | None, typer.Option(exists=True, dir_okay=False, help="Key of the certificate, a PEM file.")
    ] = None,
    log_level: LogLevel = None,
    log_form: LogFormOption = None,
) -> None:
    """Serve runs, results and the rig over REST, until interrupted (Ctrl-C); documentation is at /docs."""
    from api.page.routes import mount  # a second to import, which no other command is to wait for

    keep_memory_flat()
    if (tls_certificate is None) != (tls_key is None):
        raise JointlabError("--tls-certificate and --tls-key belong together; give both")
    tls = None if tls_certificate is None or tls_key is None else tls_of(tls_certificate, tls_key)
    given = with_log_options(load_settings(), log_level, log_form)
    signs = SignsOfLife()
    channels = channels_of(given.alarms)
    with (
        _laboratory(given, simulated, seed, speed) as (settings, automatic_operator),
        open_catalogue(settings) as catalogue,
        _listening(host, port) as listener,
        _driving(catalogue, settings, automatic_operator) as runs,
    ):
        loopback = is_loopback(host)
        if not loopback:
            _refuse_without_keys(catalogue, host)
        lasts = timedelta(hours=settings.service.session_hours)
        limits = JobLimits(settings.service.open_jobs, settings.service.export_days)
        write_logs(settings.log)
        send_traces(settings.log.traces, "jointlab serve")
        queue = JobQueue(catalogue, _executor(settings), limits)
        alarms = Alarms(catalogue, settings, runs, channels)
        hall = Hall(settings.hall) if settings.hall else None
        file = None if simulated else ChannelFile(config_path().absolute())
        services = Services(catalogue, runs, loopback, queue, alarms, hall, file, session_lasts=lasts)
        name, number = (f"[{host}]" if ":" in host else host), listener.getsockname()[1]
        address = f"{'http' if tls is None else 'https'}://{name}:{number}"
        out.print(f"page {address}/page/, health {address}/api/health, catalogue {catalogue.address}")
        app = create_app(services)
        mount(app, services)
        sys.setswitchinterval(SWITCH)
        raise_descriptor_limit()
        proxies = settings.service.trusted_proxies
        make_server(app, tls=tls, trusted_proxies=proxies, beat=signs.give).run(sockets=[listener])


@contextmanager
def _laboratory(
    settings: Settings, simulated: bool, seed: int, speed: float
) -> Iterator[tuple[Settings, AutomaticOperator | None]]:
    """The settings to work with, and an automatic operator where the bench is simulated."""
    if not simulated:
        with operator_at(settings.simulated_operator) as operator:
            yield settings, operator
        return
    # half a second to import, which no service of a real rig is to wait for
    from jointlab.trials.simulated_laboratory import simulated_laboratory, simulated_settings

    with simulated_laboratory(seed, speed) as laboratory:
        kept = (
            "database_url",
            "database_limits",
            "waveform_folder",
            "scheduler",
            "service",
            "workers",
            "alarms",
            "hall",
            "log",
        )
        others = {name: getattr(settings, name) for name in kept}
        # of its own, so that no simulated rig meets a real one, nor takes the presses of its button
        folder = (settings.drive.folder or state_folder()) / f"simulated-{urlsplit(laboratory.addresses.tester).port}"
        own = {"folder": folder, "stop_port": 0, "stop_button": None}
        others["drive"] = settings.drive.model_copy(update=own)
        yield simulated_settings(laboratory.addresses, **others), SimulatedOperator(laboratory.operator)


@contextmanager
def _driving(
    catalogue: Catalogue, settings: Settings, automatic_operator: AutomaticOperator | None
) -> Iterator[RunManager | None]:
    """The run manager of the service that steers the rig; none where no channel is configured, which only reads."""
    if not settings.channels:
        yield None
        return
    store_spools(catalogue)
    yield RunManager(catalogue, settings, automatic_operator)


def _executor(settings: Settings) -> Executor:
    if settings.scheduler is not None:
        return DaskExecutor(settings.scheduler)
    return ProcessExecutor(settings.workers, settings.log)


def _refuse_without_keys(catalogue: Catalogue, host: str) -> None:
    with catalogue.reading() as session:
        if count_keys(session) == 0:
            raise JointlabError(
                f"on {host} everyone who reaches this computer could move the machine; make keys first "
                "(jointlab key create), or serve on the loopback address"
            )


def _listening(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except OSError as error:
        why = error.strerror or str(error)
        raise JointlabError(
            f"port {port} of {host} cannot be used: {why}; name another with --port or --host"
        ) from error
