"""Schemathesis against a service that has something of everything, on a simulated rig: the schema must hold."""

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import httpx
from sqlalchemy import text

from api.service.application import create_app
from api.service.context import Services
from jointlab.jobs.executors import ProcessExecutor
from jointlab.jobs.queue import JobQueue
from jointlab.settings import DriveSettings
from jointlab.trials.simulated_laboratory import simulated_settings
from jointlab.trials.simulated_operator import SimulatedOperator
from simlab.laboratory import LaboratoryProcess
from store.catalogue import Catalogue
from store.service.keys import add_key
from store.states import Scope
from tests.api.service.conftest import managing, served
from tests.store.conftest import fill
from tests.waiting import LONG

# Rejects what it may reject for reasons that no schema can tell, such as a cursor of another list.
NOT_CHECKED = "positive_data_acceptance"
ENDLESS = "/events$"
FAR = 2_000_000_011  # number of the key: one that is revoked by chance is another


@contextmanager
def fuzzed_service(folder: Path, database: str | None) -> Iterator[tuple[str, str]]:
    """A service in front of a filled catalogue and a simulated rig; its address, and a key with every scope."""
    with ExitStack() as stack:
        catalogue = stack.enter_context(
            Catalogue.open(database or f"sqlite:///{folder / 'jointlab.db'}", folder / "waveforms")
        )
        laboratory = stack.enter_context(LaboratoryProcess(1, 200.0))
        fill(catalogue)
        with catalogue.writing() as session:
            key, secret = add_key(session, "fuzz", list(Scope))
            session.execute(text(f"UPDATE api_keys SET id = {FAR} WHERE id = {key.id}"))
        settings = simulated_settings(laboratory.addresses, drive=DriveSettings(folder=folder / "drive", stop_port=0))
        runs = stack.enter_context(managing(catalogue, settings, SimulatedOperator(laboratory.operator)))
        app = create_app(Services(catalogue, runs, jobs=JobQueue(catalogue, ProcessExecutor())))
        client = stack.enter_context(served(app))
        yield str(client.base_url).rstrip("/"), secret


def fuzz(folder: Path, phases: str, examples: int, seed: int, database: str | None = None) -> tuple[int, str]:
    """Generate cases; how many, and what schemathesis says where one fails ("" where none does).

    The database is an SQLite file in `folder` where no other one is named.
    """
    with fuzzed_service(folder, database) as (address, secret):
        schema = folder / "openapi.json"
        schema.write_bytes(httpx.get(f"{address}/openapi.json", timeout=LONG).content)
        done = subprocess.run(
            [
                sys.executable, "-m", "schemathesis.cli", "run", str(schema), "--url", address,
                "--request-timeout", str(LONG), "--suppress-health-check", "too_slow",
                "--header", f"Authorization: Bearer {secret}", "--exclude-path-regex", ENDLESS,
                "--exclude-checks", NOT_CHECKED, "--phases", phases, "--max-examples", str(examples),
                "--seed", str(seed), "--no-color", "--generation-database", "none",
            ],
            capture_output=True, text=True, cwd=folder, check=False,
        )  # fmt: skip
    generated = re.search(r"(\d+) generated", done.stdout)
    return int(generated[1]) if generated else 0, done.stdout + done.stderr if done.returncode else ""
