"""`jointlab store`: check, backup and restore as a person types them."""

from pathlib import Path

import numpy as np
import pytest
from alembic import command

from store.backup.backup import back_up
from store.catalogue import Catalogue
from store.dof import StoredDof
from store.measurements.blows import add_blow, add_point
from store.measurements.runs import finish_run, start_run
from store.migrate import configuration
from store.service.audit import add_audit_entry
from store.states import RunState
from store.waveforms.waveform import Waveform, WaveformChannel
from tests.api.conftest import Command, Query
from tests.store.forced_change import change_by_force


@pytest.fixture
def waveform_file(tmp_path: Path) -> Path:
    """The waveform file of one run with one blow in jointlab.db."""
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as opened:
        with opened.writing() as session:
            run = start_run(session, kind="hammer", title="t", article="a", setup={})
            point = add_point(session, run.id, StoredDof(1, "y"))
        samples = np.random.default_rng(1).integers(-(2**23), 2**23, (1, 10_000), dtype=np.int32)
        record = opened.waveforms.append(run.waveform_file, Waveform((WaveformChannel("a", "N"),), samples, 1000.0))
        with opened.writing() as session:
            add_blow(session, point, 1, accepted=True, waveform=record)
            finish_run(session, run.id, RunState.FINISHED)
        return opened.waveforms.folder / run.waveform_file


def damage(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2 + 7] ^= 1
    path.write_bytes(content)


def test_a_check_says_what_it_looked_at_and_that_all_is_well(jointlab: Command, waveform_file: Path) -> None:
    done = jointlab("store", "check")
    assert (done.returncode, done.stderr.count("runs: 1")) == (0, 1)
    assert done.stdout == "sqlite:///jointlab.db: 1 runs\nno damage found\n"


def test_a_check_of_a_part_says_what_it_left_out_and_tells_nothing_of_it(
    jointlab: Command, waveform_file: Path, tmp_path: Path
) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as opened, opened.writing() as session:
        start_run(session, kind="hammer", title="t", article="a", setup={})
    damage(waveform_file)
    rest = ", and what belongs to no run, such as instruments and the audit log"
    for runs, *options in ((1, "--run", 2), (1, "--part", 2, 2), (0, "--since", "2999-01-01")):
        done = jointlab("store", "check", *options)
        said = f"sqlite:///jointlab.db: {runs} of 2 runs\nnot checked: {2 - runs} other runs{rest}\n"
        assert (done.returncode, done.stdout) == (0, said + "no damage found in what was checked\n")
        assert f"runs: {runs}" in done.stderr
    done = jointlab("store", "check", "--part", 1, 2)
    assert done.returncode == 3
    assert "1 of 2 runs\nnot checked: 1 other runs\n" in done.stdout
    assert f"waveform file {waveform_file.name} record 1: the waveform is damaged" in done.stdout
    assert jointlab("store", "check", "--run", 2, "--run", 1).returncode == 3
    missing = jointlab("store", "check", "--run", 9)
    assert (missing.returncode, missing.stderr) == (3, "jointlab: there is no run 9\n")
    assert jointlab("store", "check", "--part", 3, 2).returncode == 3


def test_a_check_names_damage_and_ends_with_3(jointlab: Command, waveform_file: Path) -> None:
    damage(waveform_file)
    done = jointlab("store", "check")
    assert done.returncode == 3
    assert f"waveform file {waveform_file.name} record 1: the waveform is damaged" in done.stdout
    assert done.stdout.endswith("restore it from a backup\n1 damaged or missing\n")


def test_what_is_left_over_is_told_but_is_no_damage(jointlab: Command, waveform_file: Path) -> None:
    (waveform_file.parent / "stray.waveforms").write_bytes(waveform_file.read_bytes())
    done = jointlab("store", "check")
    assert done.returncode == 0
    assert "stray.waveforms: no run refers to it" in done.stdout


def test_the_audit_log_is_verified_and_a_hash_that_was_noted_is_looked_for(jointlab: Command, tmp_path: Path) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as opened, opened.writing() as session:
        add_audit_entry(session, who="bench", action="start run", target="run 1", outcome="done")
    done = jointlab("store", "audit")
    assert done.returncode == 0
    said, head = done.stdout.splitlines()[0].split("hash of the last one: ")
    assert said == "1 entries, "
    assert jointlab("store", "audit", "--head", head).returncode == 0
    refused = jointlab("store", "audit", "--head", "w0")
    assert refused.returncode != 0
    assert "no entry of the audit log has the hash w0" in refused.stderr


def test_entries_that_were_changed_are_told_also_where_the_noted_hash_is_not_there(
    jointlab: Command, waveform_file: Path, tmp_path: Path
) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as opened:
        with opened.writing() as session:
            add_audit_entry(session, who="ann", action="start run", target="run 1", outcome="done")
        change_by_force(opened, "UPDATE audit_entries SET who = 'bob'")
    done = jointlab("store", "audit", "--head", "w0")
    assert done.returncode == 3
    assert "entry 1 was changed" in done.stdout
    assert "no entry of the audit log has the hash w0" in done.stderr


@pytest.mark.parametrize("name", ["backup", "backup.zip"])
def test_a_backup_is_restored_where_the_database_is_lost(
    jointlab: Command, waveform_file: Path, tmp_path: Path, name: str
) -> None:
    done = jointlab("store", "backup", name)
    assert done.returncode == 0, done.stderr
    assert f"{name} written: 1 runs, 1 waveform files" in done.stdout
    for path in (*tmp_path.glob("jointlab.db*"), *waveform_file.parent.iterdir()):
        path.unlink()
    done = jointlab("store", "restore", name)
    assert done.returncode == 0, done.stderr
    assert done.stdout.endswith("no damage found\n")
    assert waveform_file.is_file()


def test_runs_of_a_backup_from_before_rigs_had_names_are_those_of_the_configured_rig(
    jointlab: Command, query: Query, waveform_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as opened:
        with opened.writing() as session:
            command.downgrade(configuration(session.connection()), "0010")
        back_up(opened, tmp_path / "backup")
    for path in (*tmp_path.glob("jointlab.db*"), *waveform_file.parent.iterdir()):
        path.unlink()
    monkeypatch.setenv("JOINTLAB_RIG", "frame 2")
    done = jointlab("store", "restore", "backup")
    assert done.returncode == 0, done.stderr
    assert query("SELECT rig FROM v_runs") == [("frame 2",)]


def test_a_restore_into_a_database_that_is_there_ends_with_3(jointlab: Command, waveform_file: Path) -> None:
    jointlab("store", "backup", "backup")
    done = jointlab("store", "restore", "backup")
    assert done.returncode == 3
    assert "jointlab.db exists already; move it away" in done.stderr


def test_a_backup_of_damaged_data_is_made_and_ends_with_3(
    jointlab: Command, waveform_file: Path, tmp_path: Path
) -> None:
    damage(waveform_file)
    done = jointlab("store", "backup", "backup")
    assert done.returncode == 3
    assert "record 1: the waveform is damaged" in done.stdout
    assert (tmp_path / "backup").is_dir()
