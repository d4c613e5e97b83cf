"""Results of a run as a MAT file (version 5), for MATLAB and Octave: one structure, nested as the results are."""

import re
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat
from scipy.io.matlab import MatWriteError

from store.catalogue import Catalogue
from store.errors import StoreError
from store.exports.content import Attributes, Variable, content_of
from store.exports.names import distinct_paths
from store.new_file import new_file

FORMAT = "jointlab-mat/1"
LONGEST = 63
"""Characters of a name in MATLAB."""


def export_mat(catalogue: Catalogue, run_id: int, path: Path) -> int:
    """Write the newest results of a run, and return the number of analyses.

    ``jointlab.modes.analysis_3.frequency`` has the fields ``values``, ``units`` and ``dims``; what an analysis was made
    from is beside it. Names are made fit for MATLAB; the own name of a joint is its field ``joint``.

    Raises:
        NotFoundError: there is no such run.
        DamagedError: a result is damaged.
        StoreError: the file exists already or cannot be written.
    """
    with catalogue.reading(long=True) as session:
        content = content_of(session, run_id)
    tree: dict[str, Any] = {"format": FORMAT, **_fields(content.attributes), "setup": content.setup}
    reserved = {*tree, *(field_name(name) for part in content.parts for name in part.origin)}
    places = distinct_paths((part.path for part in content.parts), field_name, reserved, LONGEST)
    for part in content.parts:
        _place(tree, places[part.analysis]).update(_fields(part.origin))
        place = _place(tree, places[part.path])
        place.update(_fields({**part.labels, **part.attributes}))
        place.update({field_name(name): _structure(variable) for name, variable in part.variables.items()})
    with new_file(path) as unfinished, unfinished.open("wb") as file:
        try:
            savemat(file, {"jointlab": tree}, long_field_names=True, do_compression=True)
        except (MatWriteError, ValueError) as error:
            raise StoreError(f"{path} cannot be written: {error}; write HDF5 in its place") from error
    return content.analyses


def _place(tree: dict[str, Any], path: tuple[str, ...]) -> dict[str, Any]:
    for name in path:
        tree = tree.setdefault(name, {})
    return tree


def field_name(text: str) -> str:
    """A name that MATLAB takes: letters, digits and underscores, a letter first."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", text)
    return (plain if re.match("[A-Za-z]", plain) else f"n_{plain}")[:LONGEST]


def _fields(attributes: Attributes) -> dict[str, Any]:
    return {
        field_name(name): np.array(value) if isinstance(value, tuple) else value for name, value in attributes.items()
    }


def _structure(variable: Variable) -> dict[str, Any]:
    dims = np.array(variable.dims, dtype=object)
    return {"values": variable.values, "units": variable.unit, "dims": dims}
