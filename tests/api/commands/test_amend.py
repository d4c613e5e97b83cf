"""`jointlab amend`: values of an article from the command line, in the audit log."""

import json
from pathlib import Path

from jointlab.sequences import BUILT_IN, built_in
from store.catalogue import Catalogue
from store.measurements.runs import finish_run, get_run, start_run
from store.states import RunState
from tests.api.conftest import Command, Query


def test_a_value_is_corrected_with_its_reason_and_noted(jointlab: Command, query: Query, tmp_path: Path) -> None:
    setup = built_in(BUILT_IN).article.model_dump(mode="json")
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue, catalogue.writing() as session:
        run = start_run(session, kind="import", title="t", article="beam 3", setup=setup)
        finish_run(session, run.id, RunState.FINISHED)
    why = ("--reason", "weighed again")
    answer = jointlab("amend", run.id, "beam.density=7810", "accelerometer.mass=0.002", *why)
    assert (answer.returncode, answer.stderr) == (0, "")
    assert "run 1 has version 2 of its setup; jointlab identify 1" in " ".join(answer.stdout.split())
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue, catalogue.reading() as session:
        amended = get_run(session, run.id).setup
    assert (amended["beam"]["density"], amended["accelerometer"]["mass"]) == (7810, 0.002)
    for value, words in (("beam.density", "there is no = in it"), ("beam.density=heavy", "beam.density=heavy: ")):
        refused = jointlab("amend", run.id, value, *why)
        assert (refused.returncode, refused.stdout) == (3, "")
        assert words in refused.stderr
    assert jointlab("amend", run.id, "beam.length=2.0", *why).returncode == 3
    for number, name in (("NaN", "nan"), ("-Infinity", "-inf"), ("1e999", "inf")):
        refused = jointlab("amend", run.id, f"beam.length={number}", *why)
        assert (refused.returncode, refused.stdout) == (3, "")
        words = f"the amended article of run 1: beam.length: is {name}, which is no finite number"
        assert refused.stderr == f"jointlab: {words}\n"
        noted = query("SELECT outcome, details FROM audit_entries ORDER BY id DESC LIMIT 1")
        assert [(outcome, json.loads(details)["article"]) for outcome, details in noted] == [
            (words, {"beam": {"length": name}})
        ]
    outcomes = query("SELECT target, outcome FROM audit_entries WHERE action = 'amend setup' ORDER BY id")
    assert outcomes[0] == ("run 1", "done")
    assert "make them agree" in outcomes[1][1]


def test_a_run_of_a_corrected_article_is_identified_again_and_the_old_results_stay_beside_the_new(
    jointlab: Command, measured: int, query: Query
) -> None:
    of_both = (
        "SELECT latest, stiffness FROM v_joint_stiffness WHERE joint = 'II' AND element = 'k22' AND method LIKE "
        "'maximum likelihood%' ORDER BY analysis_id"
    )
    (before,) = query(of_both)
    density = measured_density(query)
    assert jointlab("amend", measured, f"beam.density={1.01 * density}", "--reason", "weighed again").returncode == 0
    assert query(of_both) == [before]
    again = jointlab("identify", measured)
    assert again.returncode == 0, again.stderr
    old, new = query(of_both)
    assert (old[1], old[0], new[0]) == (before[1], False, True)
    # k of the same eigenvalues grows with the mass of the beam, as far as the tolerance of the density lets it
    assert 1.001 < new[1] / old[1] < 1.02


def measured_density(query: Query) -> float:
    ((setup,),) = query("SELECT setup FROM runs")
    density: float = json.loads(setup)["beam"]["density"]
    return density
