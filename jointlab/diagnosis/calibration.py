"""The calibration by trials that is shipped with this version."""

import json
from functools import cache
from importlib import resources
from pathlib import Path

from pydantic import TypeAdapter

from analysis.gap.evidence.calibration import UNCALIBRATED, Calibration

FILE = "calibration.json"
CALIBRATION = TypeAdapter(Calibration)


@cache
def shipped_calibration() -> Calibration:
    """The calibration that is shipped with this version; assumed figures where no trial was made."""
    file = resources.files("jointlab.diagnosis") / FILE
    return CALIBRATION.validate_json(file.read_text(encoding="utf-8")) if file.is_file() else UNCALIBRATED


def write_calibration(calibration: Calibration, file: Path) -> None:
    """Write a calibration as JSON."""
    document = CALIBRATION.dump_python(calibration, mode="json")
    file.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
