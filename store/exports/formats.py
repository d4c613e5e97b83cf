"""The file formats in which a run is exported for other programs."""

from collections.abc import Callable, Mapping
from pathlib import Path

from store.catalogue import Catalogue
from store.exports.bluesky import export_bluesky
from store.exports.hdf5 import export_hdf5
from store.exports.mat import export_mat
from store.exports.parquet import export_parquet
from store.exports.suffixes import SUFFIXES
from store.exports.uff import export_uff

FORMS: Mapping[str, tuple[str, Callable[[Catalogue, int, Path], int]]] = {
    "bluesky": (SUFFIXES["bluesky"], export_bluesky),
    "hdf5": (SUFFIXES["hdf5"], export_hdf5),
    "mat": (SUFFIXES["mat"], export_mat),
    "parquet": (SUFFIXES["parquet"], export_parquet),
    "uff": (SUFFIXES["uff"], export_uff),
}
"""By name: the suffix of a file, and what writes it and returns the number of analyses."""
