"""A run as one HDF5 file, for other programs: waveforms in physical units, and results."""

from pathlib import Path
from typing import Any

import numpy as np

from store.catalogue import Catalogue
from store.exports.content import RunContent, content_of, known
from store.exports.names import distinct_paths
from store.extras import explained_imports
from store.measurements.blows import list_blows
from store.measurements.sine_records import list_sine_records
from store.new_file import new_file
from store.waveforms.waveform import Waveform

FORMAT = "jointlab-hdf5/3"


def export_hdf5(catalogue: Catalogue, run_id: int, path: Path) -> int:
    """Write every waveform of a run, verified, and its newest results; return the number of analyses.

    A waveform is a group, ``blows/3y/set1/02`` or ``sine_records/0007``, of one dataset a channel: float64 values in
    the unit of its attribute ``units``. ``sensitivity`` is in volts (V/V of a bridge, C of a charge) per unit, where
    they were measured in counts.
    Results are in ``results/KIND/analysis_N``, with units, intervals and provenance; the attribute ``dims`` names the
    dimensions of a dataset. On an error no file is left.

    Raises:
        NotFoundError: there is no such run or waveform.
        DamagedError: a waveform or a result is damaged.
        StoreError: the file exists already or cannot be written, or h5py is not installed.
    """
    with explained_imports():
        import h5py
    with catalogue.reading(long=True) as session:
        content = content_of(session, run_id)
        blows, sines = list_blows(session, run_id), list_sine_records(session, run_id)
    with new_file(path) as unfinished, h5py.File(unfinished, "w") as file:
        file.attrs.update(format=FORMAT, **content.attributes)
        file["setup"] = content.setup
        for blow in blows:
            if blow.waveform is not None:
                name = f"blows/{blow.point}/set{blow.set_number}/{blow.number:02}"
                group = _add(file, name, catalogue.waveforms.read(blow.waveform))
                group.attrs.update(known(accepted=blow.accepted, reason=blow.reason, peak_force=blow.peak_force))
        for sine in sines:
            if sine.waveform is not None:
                group = _add(file, f"sine_records/{sine.order_number:04}", catalogue.waveforms.read(sine.waveform))
                group.attrs.update(
                    specimen=sine.specimen,
                    configuration=sine.configuration,
                    commanded_pp_mm=sine.commanded_pp_mm,
                    frequency=sine.frequency,
                )
        _add_results(file, content)
    return content.analyses


def _add_results(file: Any, content: RunContent) -> None:
    import h5py

    places = distinct_paths((part.path for part in content.parts), lambda name: name.replace("/", "_"))
    for part in content.parts:
        file.require_group("/".join(("results", *places[part.analysis]))).attrs.update(part.origin)
        group = file.require_group("/".join(("results", *places[part.path])))
        group.attrs.update({**part.labels, **part.attributes})
        for name, variable in part.variables.items():
            kind = h5py.string_dtype() if variable.values.dtype == object else None
            dataset = group.create_dataset(name, data=variable.values, dtype=kind)
            dataset.attrs.update(units=variable.unit, dims=variable.dims)


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
