"""What a run waits for when it writes a record to its spool, and how fast spools are stored in the catalogue."""

import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path

from jointlab.runs.ingest import SpoolIngest
from jointlab.runs.orders import order_to_begin, plan_run
from rig.runs.records import BeginRecord, EndRecord, RunRecords, SinePointRecord
from rig.runs.spool import spooling, spools
from rig.sequences.sequence import sequence_from
from rig.tester.limits import TesterLimits
from store.catalogue import Catalogue
from store.states import RunState
from store.waveforms.waveform_codec import encode
from tests.bench.bench_store import print_row, record, synchronised_write
from tests.rig.conftest import DOCUMENT

RECORDS = 500
SAMPLES = {"sine point, 2 x 5000 samples": 5_000, "blow, 2 x 10240 samples": 10_240}


def main() -> None:
    """Print the time of a record in the spool beside that of one synchronised write, and the rate of the ingest."""
    with tempfile.TemporaryDirectory() as folder, Catalogue.open(f"sqlite:///{Path(folder) / 'lab.db'}") as catalogue:
        path = Path(folder) / "spools"
        print_row(
            "one synchronised write of 40 kB", [synchronised_write(Path(folder) / "disk") for _ in range(RECORDS)]
        )
        for name, samples in SAMPLES.items():
            wave = record(samples)
            size = len(encode(wave)[1])
            run = plan_run(sequence_from(DOCUMENT), TesterLimits(), catalogue, rig="rig")
            with spooling(path, order_to_begin(run, rig="rig")) as spool:
                took = written(spool, samples)
            print_row(f"{name}, into the spool", took)
            print(f"  {RECORDS / sum(took):.0f} records/s, {size / 1e3:.0f} kB each", flush=True)
            began = time.perf_counter()
            SpoolIngest(catalogue, spools(path)[0]).advance()
            print(f"  {RECORDS / (time.perf_counter() - began):.0f} records/s into the catalogue")


def written(spool: RunRecords, samples: int) -> list[float]:
    """Seconds of each sine point that is written."""
    wave, now, took = record(samples), datetime.now(UTC), list[float]()
    spool.write(BeginRecord(now, "benchmark", (), (), None))
    for number in range(1, RECORDS + 1):
        point = SinePointRecord(number, "I", "shear", 0.1, 0.1, 5.0, float(number), now, 23.0)
        began = time.perf_counter()
        spool.write(point, wave)
        took.append(time.perf_counter() - began)
    spool.write(EndRecord(now, "benchmark", RunState.FINISHED, None))
    return took


if __name__ == "__main__":
    main()
