"""A bundle of one rig alone goes into the store, is identified there and comes out, like one of both."""

import json
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from analysis.inverse.frequency_law import FrequencyLaw
from api.commands.identification import show
from jointlab.identification.document import identification_document
from jointlab.identification.options import Options
from jointlab.identification.run import identify_and_save
from jointlab.report.identification import write_run_report
from jointlab.sequences.of_run import sequence_of_run
from store.catalogue import Catalogue
from store.exchange.bundle import read_bundle

Command = Callable[..., CompletedProcess[str]]
QUICK = Options(elements=1, joint_law=FrequencyLaw.CONSTANT)
LACKING = {"beam": "inverse", "tester": "direct"}


@pytest.fixture(params=list(LACKING))
def missing(request: pytest.FixtureRequest, bundle: Path) -> str:
    setup = json.loads((bundle / "setup.json").read_text(encoding="utf-8"))
    del setup[LACKING[request.param]]
    (bundle / "setup.json").write_text(json.dumps(setup), encoding="utf-8")
    return str(request.param)


def test_what_one_rig_measured_is_identified_exported_and_measured_again(
    missing: str, bundle: Path, jointlab: Command, tmp_path: Path
) -> None:
    assert jointlab("import", bundle).returncode == 0
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue:
        found = identify_and_save(catalogue, 1, QUICK)
        write_run_report(catalogue, 1, found, tmp_path / "report.html")
    show(found)
    document = json.loads(json.dumps(identification_document(found), allow_nan=False))
    assert bool(document["inverse"]) == (missing != "beam")
    assert bool(document["direct"]) == (missing != "tester")
    out = jointlab("export", 1, tmp_path / "out")
    assert out.returncode == 0, out.stderr
    again, before = read_bundle(tmp_path / "out"), read_bundle(bundle)
    assert (len(again.inverse), len(again.direct)) == (len(before.inverse), len(before.direct))
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue, catalogue.reading() as session:
        assert sequence_of_run(session, 1).title == before.setup.title
