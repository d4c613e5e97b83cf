"""The paper's 720 sine points through every wire, as fast as the simulated bench lets it, and where the time goes."""

import cProfile
import pstats
import tempfile
import time
from pathlib import Path

from api.commands.sequences import named_sequence
from jointlab.instruments import instruments_of
from jointlab.runs.carry_out import run_sequence
from jointlab.sequences import BUILT_IN
from jointlab.trials.simulated_laboratory import simulated_settings
from jointlab.trials.simulated_operator import SimulatedOperator
from rig.sequences.sequence import SweepStep
from simlab.laboratory import LaboratoryProcess
from store.catalogue import Catalogue

SPEED = 1000.0
PARTS = {
    "commands, read back": "rig/tester/driver.py(cycle)",
    "waiting until settled": "rig/tester/driver.py(wait)",
    "records from the instrument": "daq/task.py(record)",
    "sine fits": "analysis/direct/sine.py(fit_sine)",
    "into the spool": "rig/runs/recorder.py(add_sine)",
    "temperature": "rig/thermometer.py(celsius)",
    "mounting, preset, hydraulics": "rig/sweep/driven_sweep.py(begin)",
}


def main() -> None:
    """Print seconds for the sweep, and for each of its parts."""
    sequence = named_sequence(BUILT_IN)
    sequence = sequence.model_copy(update={"steps": tuple(s for s in sequence.steps if isinstance(s, SweepStep))})
    profile = cProfile.Profile()
    with LaboratoryProcess(1, SPEED) as laboratory, tempfile.TemporaryDirectory() as folder:
        address = f"sqlite:///{Path(folder) / 'jointlab.db'}"
        settings = simulated_settings(laboratory.addresses, database_url=address)
        for name, profiled in (("", False), (", profiled", True)):
            with Catalogue.open(address) as catalogue:
                began = time.perf_counter()
                if profiled:
                    profile.enable()
                run_sequence(sequence, instruments_of(settings), catalogue, SimulatedOperator(laboratory.operator))
                profile.disable()
                print(f"720 sine points at speed {SPEED:g}{name}: {time.perf_counter() - began:.1f} s", flush=True)
    seconds = {
        f"{'/'.join(Path(file).parts[-2:])}({function})": row[3]
        for (file, _, function), row in pstats.Stats(profile).stats.items()  # type: ignore[attr-defined]  # typeshed does not know it
    }
    for part, place in PARTS.items():
        found = next((value for name, value in seconds.items() if place.endswith(name) or name in place), None)
        print(f"  {part:<32} {'-' if found is None else f'{found:.1f} s'}")


if __name__ == "__main__":
    main()
