"""What a trial's process answers."""

import json
from pathlib import Path

from jointlab.trials.worker import answer
from simlab.case.bundle import write_case
from simlab.case.draw import CaseKind, draw_case


def test_a_bundle_of_the_tester_alone_is_answered_without_accelerances(tmp_path: Path) -> None:
    """It ended the process: there is no row of which a fit could be kept."""
    write_case(draw_case(5, CaseKind.NONE), tmp_path)
    setup = tmp_path / "setup.json"
    document = json.loads(setup.read_text(encoding="utf-8")) | {"inverse": [], "predict": []}
    setup.write_text(json.dumps(document), encoding="utf-8")
    found = answer(tmp_path)
    assert "error" not in found
    assert found["verdict"]["status"] == "none"
    assert "fitted" not in found
