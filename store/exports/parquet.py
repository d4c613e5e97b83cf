"""Results of a run as Parquet files, one a table, for data frames and databases."""

import json
from pathlib import Path

from store.catalogue import Catalogue
from store.exports.content import RunContent, content_of
from store.exports.tables import as_parquet, tables_of
from store.new_file import new_folder

FORMAT = "jointlab-parquet/1"


def export_parquet(catalogue: Catalogue, run_id: int, path: Path) -> int:
    """Write the newest results of a run, and return the number of analyses.

    Each column has its unit as metadata ``unit``; each file has ``jointlab`` as metadata: JSON with what the run
    is, and what each of its analyses was made from.

    Args:
        path: a new or empty folder, or a new file that ends in .zip.

    Raises:
        NotFoundError: there is no such run.
        DamagedError: a result is damaged.
        StoreError: `path` exists already or cannot be written, or pyarrow is not installed.
    """
    with catalogue.reading(long=True) as session:
        content = content_of(session, run_id)
    with new_folder(path) as folder:
        for name, table in tables_of(content.parts).items():
            (folder / f"{name}.parquet").write_bytes(as_parquet(table, origin(content)))
    return content.analyses


def origin(content: RunContent) -> dict[str, str]:
    """Metadata of a file: what the run is, and what each of its analyses was made from."""
    parts = {"/".join(part.path): {**part.origin, **part.labels, **part.attributes} for part in content.parts}
    document = {"format": FORMAT, **content.attributes, "setup": json.loads(content.setup), "parts": parts}
    return {"jointlab": json.dumps(document)}
