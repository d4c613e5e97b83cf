"""A run as one HDF5 file, for other programs: waveforms in physical units, and results."""

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from store.blows import list_blows
from store.catalogue import Catalogue
from store.errors import StoreError
from store.hdf5_results import add_results, known
from store.runs import get_run
from store.sine_records import list_sine_records
from store.version import software_version
from store.waveform import Waveform

FORMAT = "jointlab-hdf5/2"


@dataclass(frozen=True)
class Exported:
    """How many waveforms and analyses a file has."""

    waveforms: int
    analyses: int


def export_hdf5(catalogue: Catalogue, run_id: int, path: Path) -> Exported:
    """Write every waveform of a run, verified, and its newest results.

    A waveform is a group, ``blows/3y/set1/02`` or ``sine_records/0007``, of one dataset a channel: float64 values in
    the unit of its attribute ``units``. ``sensitivity`` is in volts per unit, where they were measured in counts.
    Results are in ``results``, with units, intervals and provenance (`add_results`). On an error no file is left.

    Raises:
        NotFoundError: there is no such run or waveform.
        DamagedError: a waveform or a result is damaged.
        StoreError: the file exists already or cannot be written.
    """
    if path.exists():
        raise StoreError(f"{path} exists already; name a new file")
    with catalogue.reading() as session:
        run = get_run(session, run_id)
        blows, sines = list_blows(session, run_id), list_sine_records(session, run_id)
    unfinished = path.with_name(path.name + ".unfinished")
    count = 0
    try:
        with h5py.File(unfinished, "w") as file:
            file.attrs.update(
                format=FORMAT,
                creator=f"Jointlab {software_version()}",
                run=run.id,
                kind=run.kind,
                title=run.title,
                article=run.article,
                started_at=run.started_at.isoformat(),
                measured_by=f"Jointlab {run.software_version}",
                configuration_hash=run.configuration_hash,
            )
            file["setup"] = json.dumps(run.setup)
            for blow in blows:
                if blow.waveform is not None:
                    name = f"blows/{blow.point}/set{blow.set_number}/{blow.number:02}"
                    group = _add(file, name, catalogue.waveforms.read(blow.waveform))
                    group.attrs.update(known(accepted=blow.accepted, reason=blow.reason, peak_force=blow.peak_force))
                    count += 1
            for sine in sines:
                if sine.waveform is not None:
                    group = _add(file, f"sine_records/{sine.order_number:04}", catalogue.waveforms.read(sine.waveform))
                    group.attrs.update(
                        specimen=sine.specimen,
                        configuration=sine.configuration,
                        commanded_pp_mm=sine.commanded_pp_mm,
                        frequency=sine.frequency,
                    )
                    count += 1
            with catalogue.reading() as session:
                analyses = add_results(session, run_id, file)
        os.replace(unfinished, path)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error}") from error
    finally:
        unfinished.unlink(missing_ok=True)
    return Exported(count, analyses)


def _add(file: Any, name: str, waveform: Waveform) -> Any:
    group = file.create_group(name)
    group.attrs.update(
        known(
            sample_rate=waveform.sample_rate,
            started_at=waveform.started_at.isoformat() if waveform.started_at else None,
            trigger_index=waveform.trigger_index,
        )
    )
    group.attrs["overloaded"] = ", ".join(waveform.overloaded)
    for channel in waveform.channels:
        values = waveform.value(channel.name)
        dataset = group.create_dataset(channel.name, data=values, compression="gzip", shuffle=True, fletcher32=True)
        dataset.attrs["units"] = channel.unit
        if waveform.samples.dtype == np.int32:
            dataset.attrs["sensitivity"] = channel.sensitivity
    return group
