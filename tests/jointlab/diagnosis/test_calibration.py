"""The calibration that comes with this version."""

from analysis.gap.evidence.calibration import Calibration
from jointlab.diagnosis.calibration import CALIBRATION, shipped_calibration


def test_what_is_shipped_is_complete_and_says_where_it_is_from() -> None:
    found = shipped_calibration()
    assert CALIBRATION.validate_json(CALIBRATION.dump_json(found)) == found
    assert found.provenance
    assert abs(sum(found.counts) - 1) < 1e-9
    assert set(CALIBRATION.dump_python(found)) == set(Calibration.__dataclass_fields__)
