"""The suffixes of the files in which a run is exported for other programs, without what writes them."""

from collections.abc import Mapping

SUFFIXES: Mapping[str, str] = {
    "bluesky": ".jsonl", "hdf5": ".h5", "mat": ".mat", "parquet": ".zip", "uff": ".unv",
}  # fmt: skip
