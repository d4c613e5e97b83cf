"""`jointlab runs` and `jointlab show`."""

from pathlib import Path

from store.catalogue import Catalogue
from store.measurements.runs import start_run
from store.states import RunState
from tests.api.conftest import Command
from tests.store.conftest import fill


def test_runs_are_listed_newest_first_and_shown_one_by_one(jointlab: Command, tmp_path: Path) -> None:
    assert jointlab("runs").stdout == "no run fits\n"
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue:
        fill(catalogue)
        with catalogue.writing() as session:
            start_run(session, kind="sequence", title="t", article="beam 4", setup={}, state=RunState.CREATED)
    listed = [line.split() for line in jointlab("runs").stdout.splitlines()[2:]]
    assert [(line[0], line[1]) for line in listed] == [("3", "–"), ("2", "2026-03-04"), ("1", "2026-03-04")]
    one = jointlab("runs", "--article", "beam 3", "--state", "stopped", "--limit", 1).stdout
    assert "beam 3, sweep" in one
    assert one.endswith("older ones: --before 2\n")
    assert jointlab("runs", "--specimen", "II").stdout.splitlines()[2].split()[0] == "1"
    assert jointlab("runs", "--specimen", "III").stdout == "no run fits\n"
    hammer, sweep = (" ".join(jointlab("show", number).stdout.split()) for number in (1, 2))
    assert hammer.startswith("run 1, finished: beam 3, roving hammer (beam 3), rig ")
    for words in ("hammer cDAQ1Mod1/ai0 2.3 mV/N 4711 2026-01-15", "1 4y 2 1", "joint_matrices modal"):
        assert words in hammer
    assert "reason: stopped by the operator" in sweep
    for words in ("I shear 0.1 1", "nothing to correct", "tester servo-hydraulic 7"):
        assert words in sweep
    missing = jointlab("show", 9)
    assert (missing.returncode, missing.stderr) == (3, "jointlab: there is no run 9\n")
