"""Write the stored schema again, where a change of it is intended: ``python -m tests.api.service.snapshot``."""

import json
import tempfile
from pathlib import Path

from store.catalogue import Catalogue
from tests.api.service.test_schema import SNAPSHOT, schema_of


def main() -> None:
    """Write it."""
    with (
        tempfile.TemporaryDirectory() as folder,
        Catalogue.open(f"sqlite:///{Path(folder) / 'jointlab.db'}") as catalogue,
    ):
        SNAPSHOT.write_text(json.dumps(schema_of(catalogue), indent=1, sort_keys=True) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
