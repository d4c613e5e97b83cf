"""`jointlab worker`: carry out jobs of the service on this computer, for a dask scheduler."""

import asyncio
from importlib import import_module
from typing import Annotated, Any

import typer

from api.commands.log_options import LogFormOption, LogLevel, with_log_options
from api.commands.terminal import out
from jointlab.errors import JointlabError
from jointlab.logs import write_logs
from jointlab.settings import load_settings
from jointlab.traces import send_traces
from store.extras import explained_imports


def worker(
    scheduler: Annotated[str | None, typer.Argument(help="Its address; that of the configuration by default.")] = None,
    jobs: Annotated[int, typer.Option(min=1, max=256, help="At a time.")] = 1,
    log_level: LogLevel = None,
    log_form: LogFormOption = None,
) -> None:
    """Do jobs of the service for a dask scheduler (dask scheduler starts one), until interrupted (Ctrl-C).

    It needs the extra `cluster`, and database_url and waveform_folder in its own configuration, as the service has
    them. It waits for a scheduler that is not there, and joins one again that comes back.
    """
    settings = with_log_options(load_settings(), log_level, log_form)
    address = scheduler or settings.scheduler
    if address is None:
        raise JointlabError("name the scheduler: jointlab worker tcp://host:8786, or `scheduler` in jointlab.toml")
    write_logs(settings.log)
    send_traces(settings.log.traces, "jointlab worker")
    with explained_imports():
        make_worker: Any = import_module("distributed").Worker
        # it would keep the calls of every second for an hour, 400 MB, for a dashboard that is not shown
        import_module("dask").config.set({"distributed.worker.profile.enabled": False})
    try:
        asyncio.run(_work(make_worker, address, jobs))
    except (OSError, ValueError) as error:
        raise JointlabError(f"no dask scheduler answers at {address}: {error}") from error


async def _work(make_worker: Any, address: str, jobs: int) -> None:
    while True:
        async with make_worker(address, nthreads=jobs, dashboard=False) as started:
            out.print(f"works for {address}")
            await started.finished()
        out.print(f"the scheduler at {address} has gone; waiting for it")
