"""`jointlab run --automatic` on a simulated bench, and a person who confirms what that bench then does."""

from contextlib import closing
from pathlib import Path

import pytest
import yaml

from jointlab.trials.simulated_operator import SimulatedOperator
from rig.errors import RequestError
from simlab.laboratory import Laboratory
from tests.api.commands.test_interrupts import Terminal
from tests.api.conftest import Command, Contents, Query, Write
from tests.waiting import LONG

BAD_INPUT = 3
NOBODY = "there is no terminal to confirm it on"


@pytest.fixture
def simulated_bench(laboratory: Laboratory, tmp_path: Path) -> None:
    """A configuration that says who strikes on the simulated bench."""
    table = tmp_path / "jointlab.toml"
    operator = f'simulated_operator = "{laboratory.addresses.operator}"\n'
    table.write_text(operator + table.read_text(encoding="utf-8"), encoding="utf-8")


@pytest.mark.usefixtures("laboratory")
@pytest.mark.parametrize("arguments", [("run", "paper"), ("run", "paper", "--dry-run"), ("resume", 1)])
def test_a_bench_that_is_not_simulated_does_not_strike_by_itself(
    arguments: tuple[str | int, ...], jointlab: Command, contents: Contents
) -> None:
    before = contents()
    refused = jointlab(*arguments, "--automatic")
    assert refused.returncode == BAD_INPUT
    (line,) = refused.stderr.splitlines()
    assert line.startswith("jointlab: --automatic: only a simulated bench strikes and mounts by itself, and none is")
    assert contents() == before


@pytest.mark.usefixtures("simulated_bench", "drive")
@pytest.mark.parametrize("options", [(), ("--automatic",)])
def test_a_simulated_bench_measures_without_prompts_and_a_resumed_run_remembers_it(
    options: tuple[str, ...], jointlab: Command, sequence: Write, query: Query, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise RequestError("the bench is in use")

    with monkeypatch.context() as patched:
        patched.setattr(SimulatedOperator, "mount", refuse)
        failed = jointlab("run", sequence({"points": ["5y"]}, {"configurations": ["shear"]}), *options)
    assert failed.returncode == BAD_INPUT
    assert "the bench is in use" in failed.stderr
    assert query("SELECT blows_accepted, sine_records FROM v_runs") == [(2, 0)]
    assert query("SELECT automatic FROM runs") == [(1,)]  # also for the page, and for other programs
    done = jointlab("resume", 1)
    assert done.returncode == 0, done.stderr
    assert query("SELECT state, blows_accepted, sine_records FROM v_runs") == [("finished", 2, 2)]


@pytest.mark.usefixtures("simulated_bench", "drive")
def test_a_run_that_was_begun_with_prompts_is_resumed_with_them_unless_told_otherwise(
    jointlab: Command, sequence: Write, query: Query
) -> None:
    file = sequence(sweep={"configurations": ["shear"]})
    document = yaml.safe_load(file.read_text("utf-8"))
    document["steps"] = document["steps"][1:]
    file.write_text(yaml.safe_dump(document), encoding="utf-8")
    for arguments in (("run", file, "--no-automatic"), ("resume", 1)):
        refused = jointlab(*arguments)
        assert refused.returncode == BAD_INPUT
        assert NOBODY in refused.stderr
    done = jointlab("resume", 1, "--automatic")
    assert done.returncode == 0, done.stderr
    assert query("SELECT state, automatic FROM runs") == [("finished", 1)]


@pytest.mark.usefixtures("simulated_bench")
def test_without_automatic_the_bench_strikes_when_enter_is_pressed(
    sequence: Write, query: Query, tmp_path: Path
) -> None:
    file = sequence({"points": ["5y"]})
    document = yaml.safe_load(file.read_text("utf-8"))
    document["steps"] = document["steps"][:1]
    file.write_text(yaml.safe_dump(document), encoding="utf-8")
    with closing(Terminal(tmp_path, "run", str(file), "--no-automatic")) as terminal:
        for blow in (1, 2):
            terminal.wait_for(f"strike 5y (blow {blow}), then press Enter")
            assert query("SELECT coalesce(sum(blows_accepted), 0) FROM v_runs") == [(blow - 1,)]
            terminal.type_keys(b"\n")
        terminal.wait_for("run 1 finished")
        assert terminal.process.wait(LONG) == 0
    assert query("SELECT state, blows_accepted FROM v_runs") == [("finished", 2)]
