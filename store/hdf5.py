"""The waveforms of a run as one HDF5 file, for other programs."""

import os
from pathlib import Path
from typing import Any

import h5py

from store.blows import list_blows
from store.catalogue import Catalogue
from store.errors import StoreError
from store.runs import get_run
from store.sine_records import list_sine_records
from store.waveform import Waveform


def export_hdf5(catalogue: Catalogue, run_id: int, path: Path) -> int:
    """Write every waveform of a run, verified, and return how many there were.

    A waveform is a group, ``blows/3y/set1/02`` or ``sine_records/0007``, of one dataset a channel: raw samples, with
    unit, sensitivity (volts per unit) and polynomial coefficients (to volts, lowest power first) as attributes. On
    an error no file is left.

    Raises:
        NotFoundError: there is no such run or waveform.
        DamagedError: a waveform is damaged.
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
            file.attrs.update(run=run.id, title=run.title, article=run.article, started_at=run.started_at.isoformat())
            for blow in blows:
                if blow.waveform is not None:
                    name = f"blows/{blow.point}/set{blow.set_number}/{blow.number:02}"
                    group = _add(file, name, catalogue.waveforms.read(blow.waveform))
                    group.attrs.update(_known(accepted=blow.accepted, reason=blow.reason, peak_force=blow.peak_force))
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
        os.replace(unfinished, path)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error}") from error
    finally:
        unfinished.unlink(missing_ok=True)
    return count


def _add(file: Any, name: str, waveform: Waveform) -> Any:
    group = file.create_group(name)
    group.attrs.update(
        _known(
            sample_rate=waveform.sample_rate,
            started_at=waveform.started_at.isoformat() if waveform.started_at else None,
            trigger_index=waveform.trigger_index,
        )
    )
    group.attrs["overloaded"] = ", ".join(waveform.overloaded)
    for channel, row in zip(waveform.channels, waveform.samples, strict=True):
        dataset = group.create_dataset(channel.name, data=row, compression="gzip", shuffle=True, fletcher32=True)
        dataset.attrs.update(unit=channel.unit, sensitivity=channel.sensitivity, coefficients=channel.coefficients)
    return group


def _known(**attributes: Any) -> dict[str, Any]:
    return {name: value for name, value in attributes.items() if value is not None}
