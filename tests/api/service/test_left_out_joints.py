"""REST tells why the newest identification of a run has no joints, and gives older ones by their number alone."""

from pathlib import Path

import httpx

from store.catalogue import Catalogue
from store.results.analyses import list_analyses
from store.states import AnalysisKind
from tests.jointlab.identification.left_out import REASON, identified_then_left_out


def test_the_reason_takes_the_place_of_joints_modes_and_comparison(
    catalogue: Catalogue, client: httpx.Client, tmp_path: Path
) -> None:
    run, first = identified_then_left_out(catalogue, tmp_path / "bundle")
    assert first.inverse is not None
    for what in ("joint-matrices", "modes", "comparisons"):
        answer = client.get(f"/api/runs/{run}/{what}")
        assert answer.status_code == 404, what
        assert REASON in answer.json()["detail"], what
    listed = client.get(f"/api/runs/{run}/analyses", params={"kind": "joint_matrices"}).json()["items"]
    assert listed[0]["settings"]["no_result"] == REASON

    older = catalogue.read(list_analyses, run, AnalysisKind.JOINT_MATRICES)[2]
    answer = client.get(f"/api/runs/{run}/joint-matrices", params={"analysis": older.id})
    assert answer.status_code == 200
    assert {each["joint"] for each in answer.json()["items"]} == set(first.inverse.likelihood.joints)
