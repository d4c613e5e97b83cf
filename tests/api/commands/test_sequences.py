"""`jointlab run` on simulated instruments, from a configuration file, and what it says when they are not there."""

import re
import socket
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pytest

from analysis.dof import Dof
from api.commands.console import PlainConsole
from api.commands.terminal_operator import TerminalOperator
from jointlab.drive.process import driving
from jointlab.settings import load_settings
from jointlab.trials.simulated_operator import SimulatedOperator
from rig.errors import RequestError
from rig.tester.limits import TesterLimits
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from simlab.plc_tester import start_plc_tester
from store.catalogue import Catalogue
from store.exchange.bundle import read_bundle
from store.measurements.frequency_responses import list_frequency_responses
from store.service.rig_limits import save_rig_limits
from tests.api.conftest import SPEED, Command, Contents, Query, Write
from tests.ports import free_port

BAD_INPUT, INSTRUMENT, INTERRUPTED = 3, 4, 130
QUICK = ("--elements", 1, "--joint-law", "constant")
"""An identification that takes less than half as long as the usual one, which the demo has."""


@pytest.mark.usefixtures("operator")
def test_a_sequence_is_measured_identified_exported_and_imported_back(
    jointlab: Command, sequence: Write, query: Query, tmp_path: Path
) -> None:
    # the six components that identification needs
    file = sequence({"points": ["1y", "3y", "5y", "7y", "9y", "11y", "1x", "11x"]}, {"specimens": ["I", "II"]})
    measured = jointlab("run", file)
    assert measured.returncode == 0
    assert "run 1" in measured.stderr.splitlines()
    assert measured.stdout == "run 1 finished; jointlab identify 1 evaluates it\n"
    assert query("SELECT state, blows_accepted, sine_records FROM v_runs") == [("finished", 16, 12)]
    assert query("SELECT action, target, outcome FROM audit_entries") == [("start run", "run 1", "at the terminal")]

    identified = jointlab("identify", 1, *QUICK, "--json", "found.json")
    assert identified.returncode == 0, identified.stderr
    assert (tmp_path / "found.json").is_file()
    ((modes,),) = query("SELECT count(*) FROM v_modes WHERE latest")
    assert modes >= 6
    elements = query("SELECT method, count(*) FROM v_joint_stiffness WHERE latest GROUP BY method")
    assert [count for _, count in elements] == [18, 18]
    assert query("SELECT count(*) FROM v_dynamic_stiffness WHERE latest") == [(12,)]

    assert jointlab("export", 1, "bundle.zip").returncode == 0
    hdf5 = jointlab("export", 1, "run.h5", "--format", "hdf5")
    assert re.fullmatch(r"run\.h5 written: [1-9]\d* analyses\n", hdf5.stdout)
    assert jointlab("import", "bundle.zip", "--article", "again").returncode == 0
    assert query("SELECT run_id, kind, article FROM v_runs ORDER BY run_id")[1] == (2, "import", "again")
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue, catalogue.reading() as session:
        (ours,), (theirs,) = list_frequency_responses(session, 1), list_frequency_responses(session, 2)
    assert (theirs.response, theirs.inputs) == (ours.response, ours.inputs)
    for name in ("frequency", "accelerance", "coherence"):
        np.testing.assert_array_equal(getattr(theirs, name), getattr(ours, name))
    points = "SELECT specimen, configuration, amplitude_pp_mm, frequency, magnitude, loss_angle_deg, temperature_c"
    one, other = (query(f"{points} FROM v_dynamic_stiffness WHERE run_id = {run}") for run in (1, 2))
    assert [row[:3] for row in one] == [row[:3] for row in other]
    np.testing.assert_allclose([row[3:] for row in one], [row[3:] for row in other], rtol=1e-14)
    blows = read_bundle(tmp_path / "bundle.zip").blows
    assert len(blows) == 16

    again = jointlab("identify", 1, *QUICK)
    assert again.returncode == 0
    assert query("SELECT count(*), sum(latest) FROM v_analyses WHERE run_id = 1 AND kind = 'modes'") == [(2, 1)]


def test_a_dry_run_without_a_configuration_lists_the_steps_alone(jointlab: Command, contents: Contents) -> None:
    before = contents()
    answer = jointlab("run", "paper", "--dry-run")
    assert answer.returncode == 0
    assert "10 blows at each of 1y, 3y, 4y, 5y, 6y, 7y, 8y, 9y, 11y, 1x, 11x (110 blows" in answer.stdout
    assert "720 sine points, 5 to 200 Hz, 0.1, 0.05, 0.01 mm p-p, preset 0.5 mm" in answer.stdout
    assert "blows of about 100 N, about 11 min)\n" in answer.stdout
    assert "(records alone 9 min); beside the mains: 50 Hz at 48, 100 Hz at 98, 150 Hz at 148," in answer.stdout
    assert "\naltogether at least 20 min; settling" in answer.stdout
    assert "limits of the rig: 0.3 mm p-p" in answer.stdout
    assert "150 m/s^2, 4000 N (no others are set)\nno instruments are configured here" in answer.stdout
    assert contents() == before


def test_a_dry_run_makes_no_database(jointlab: Command, tmp_path: Path) -> None:
    assert jointlab("run", "paper", "--dry-run").returncode == 0
    assert list(tmp_path.iterdir()) == []


def test_a_dry_run_checks_against_the_limits_that_were_set_for_this_rig(
    jointlab: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue, catalogue.writing() as session:
        save_rig_limits(session, "rig", asdict(TesterLimits(amplitude_pp=2e-5)), "an engineer")
        save_rig_limits(session, "other rig", asdict(TesterLimits(force=900.0)), "an engineer")
    refused = jointlab("run", "paper", "--dry-run")
    assert refused.returncode == BAD_INPUT
    one_line(refused, "amplitude 0.1 mm is outside the rig's limits of 0 to 0.02 mm")
    monkeypatch.setenv("JOINTLAB_RIG", "other rig")
    elsewhere = jointlab("run", "paper", "--dry-run")
    assert elsewhere.returncode == 0, elsewhere.stderr
    assert "150 m/s^2, 900 N (set for 'other rig')" in elsewhere.stdout


def test_a_dry_run_lists_the_detectors_that_a_step_tightens(jointlab: Command, sequence: Write) -> None:
    detectors = {"force": {"limit": 900, "action": "hydraulic_interlock"}, "upper_displacement": {"limit_mm": 0.8}}
    answer = jointlab("run", sequence(sweep={"detectors": detectors}), "--dry-run")
    assert answer.returncode == 0, answer.stderr
    assert "; tighter detectors: upper displacement 0.8 mm, force 900 N (hydraulic interlock)\n" in answer.stdout
    refused = jointlab("run", sequence(sweep={"detectors": {"force": {"limit": 4500}}}), "--dry-run")
    assert refused.returncode == BAD_INPUT
    one_line(refused, "detector force 4500 N is outside the rig's limits of 0 to 4000 N")


def test_a_dry_run_moves_nothing_and_says_what_is_not_ready(
    jointlab: Command, laboratory: Laboratory, tmp_path: Path
) -> None:
    commands = len(laboratory.tester.device.applied)
    ready = jointlab("run", "paper", "--dry-run")
    assert (ready.returncode, "not ready" in ready.stdout) == (0, False), ready.stdout
    assert len(laboratory.tester.device.applied) == commands
    table = tmp_path / "jointlab.toml"
    whole = table.read_text(encoding="utf-8")
    absent = f"127.0.0.1:{free_port()}"
    faults = {
        'name = "hammer"': ('name = "mallet"', BAD_INPUT, "no channel hammer in the channel table; it has mallet"),
        laboratory.addresses.daq: (f"grpc://{absent}", INSTRUMENT, f"no NI gRPC device server at {absent}"),
        laboratory.addresses.tester: (f"tcp://{absent}", INSTRUMENT, f"tcp://{absent}: no connection"),
        "tester_url": ("# tester_url", INSTRUMENT, "this rig has no tester; write tester_url"),
        laboratory.addresses.thermometer: (f"socket://{absent}", INSTRUMENT, f"thermometer at socket://{absent}"),
    }
    for right, (wrong, code, words) in faults.items():
        assert right in whole
        table.write_text(whole.replace(right, wrong, 1), encoding="utf-8")
        answer = jointlab("run", "paper", "--dry-run")
        assert (answer.returncode, answer.stdout.count("not ready: ")) == (code, 1), answer.stdout
        assert words in " ".join(answer.stdout.split())
        assert "720 sine points" in answer.stdout
    table.write_text(whole, encoding="utf-8")
    laboratory.thermometer.faults.set("silent")
    silent = jointlab("run", "paper", "--dry-run")
    assert (silent.returncode, silent.stdout.count("not ready: ")) == (INSTRUMENT, 1), silent.stdout
    assert "no answer; check its cable and power" in " ".join(silent.stdout.split())
    laboratory.thermometer.faults.clear()
    laboratory.tester.emergency_stop()
    assert "not ready: the tester is stopped by emergency stop" in jointlab("run", "paper", "--dry-run").stdout


def test_a_dry_run_says_what_a_tester_with_other_registers_lacks_and_what_has_to_be_accepted(
    jointlab: Command, laboratory: Laboratory, tmp_path: Path
) -> None:
    example = Path(__file__).parents[3] / "docs" / "examples" / "tester_map.toml"
    without = re.sub(r"\[heartbeat\].*", "", example.read_text(encoding="utf-8"), flags=re.DOTALL)
    (tmp_path / "map.toml").write_text(without, encoding="utf-8")
    table = tmp_path / "jointlab.toml"
    whole = table.read_text(encoding="utf-8")
    server = start_plc_tester(ordinary_bench(3, Clock(SPEED)), has_watchdog=False)
    try:
        mapped = 'tester_map = "map.toml"\n' + whole.replace(laboratory.addresses.tester, server.url)
        table.write_text(mapped, encoding="utf-8")
        refused = jointlab("run", "paper", "--dry-run")
        said = " ".join(refused.stdout.split())
        assert refused.returncode == INSTRUMENT
        assert "the tester (PLC 5012) has no status age: a status that stands still is noticed while it cycles" in said
        assert "not ready: PLC 5012 has no watchdog: it goes on moving when program" in said
        assert 'write into jointlab.toml: tester_without = ["watchdog"]' in said
        table.write_text('tester_without = ["watchdog"]\n' + mapped, encoding="utf-8")
        accepted = jointlab("run", "paper", "--dry-run")
        assert (accepted.returncode, "not ready" in accepted.stdout) == (0, False), accepted.stdout
        assert server.device.applied == []
        (tmp_path / "map.toml").write_text(without.replace('type = "u32"', 'type = "u23"', 1), encoding="utf-8")
        wrong = jointlab("run", "paper", "--dry-run")
        assert wrong.returncode == BAD_INPUT
        one_line(wrong, "tester map map.toml: line ", "identity.serial.type: is 'u23'")
    finally:
        server.stop()


def one_line(answer: CompletedProcess[str], *words: str) -> None:
    (line,) = answer.stderr.splitlines()
    assert line.startswith("jointlab: ")
    for word in words:
        assert word in line


@pytest.mark.usefixtures("operator")
@pytest.mark.parametrize(
    ("variable", "address"),
    [
        ("JOINTLAB_DAQ_ADDRESS", "local"),
        ("JOINTLAB_TESTER_URL", "tcp://127.0.0.1:{port}"),
        ("JOINTLAB_THERMOMETER_URL", "socket://127.0.0.1:{port}"),
    ],
)
def test_an_absent_instrument_is_exit_code_4_and_nothing_is_stored(
    variable: str, address: str, jointlab: Command, sequence: Write, contents: Contents, monkeypatch: pytest.MonkeyPatch
) -> None:
    address = address.format(port=free_port())
    monkeypatch.setenv(variable, address)
    before = contents()
    with driving(load_settings()):
        answer = jointlab("run", sequence())
    assert answer.returncode == INSTRUMENT
    one_line(answer, address)
    assert contents() == before


@pytest.mark.usefixtures("drive", "operator")
@pytest.mark.parametrize(
    ("fault", "words"), [("wrong_map_version", "register map version"), ("refuse", "the tester did not obey a stop")]
)
def test_a_tester_that_is_another_or_refuses_is_exit_code_4_and_nothing_is_stored(
    fault: str, words: str, jointlab: Command, sequence: Write, contents: Contents, laboratory: Laboratory
) -> None:
    laboratory.tester.faults.set(fault)
    before = contents()
    answer = jointlab("run", sequence())
    assert answer.returncode == INSTRUMENT
    one_line(answer, words)
    assert contents() == before


@pytest.mark.usefixtures("drive", "operator")
@pytest.mark.parametrize(
    ("hammer", "sweep", "words"),
    [
        ({"hammer": "mallet"}, {}, "no channel mallet in the channel table; it has hammer, accelerometer"),
        ({"accelerometer": "force"}, {}, "'force' on cDAQ1Mod2/ai1 measures N"),
        ({"blows": 0}, {}, "steps.0.hammer.blows: is 0; it has to be 2 or more"),
        ({"points": ["3y", "12y"]}, {}, "no node for 12y"),
        ({}, {"amplitudes_pp_mm": [0.5]}, "outside the rig's limits"),
        ({}, {"frequencies": {"first": 0.5}}, "frequency 0.5 Hz is outside the rig's limits"),
        ({}, {"specimens": ["III"]}, "no joint III"),
    ],
)
def test_a_sequence_that_cannot_be_run_is_bad_input_and_nothing_is_stored(
    hammer: dict[str, Any], sweep: dict[str, Any], words: str, jointlab: Command, sequence: Write, contents: Contents
) -> None:
    before = contents()
    answer = jointlab("run", sequence(hammer, sweep))
    assert answer.returncode == BAD_INPUT
    one_line(answer, words)
    assert contents() == before


@pytest.mark.usefixtures("operator")
def test_a_channel_table_that_does_not_fit_the_chassis_is_bad_input(
    jointlab: Command, sequence: Write, contents: Contents, tmp_path: Path
) -> None:
    config = tmp_path / "jointlab.toml"
    config.write_text(config.read_text("utf-8").replace("cDAQ1Mod1/ai0", "cDAQ1Mod7/ai0"), encoding="utf-8")
    before = contents()
    with driving(load_settings()):
        answer = jointlab("run", sequence())
    assert answer.returncode == BAD_INPUT
    one_line(answer, "'hammer' is on cDAQ1Mod7/ai0", "there are cDAQ1")
    assert contents() == before


def test_without_a_channel_table_the_way_to_one_is_said(jointlab: Command, contents: Contents) -> None:
    before = contents()
    answer = jointlab("run", "paper")
    assert answer.returncode == BAD_INPUT
    one_line(answer, "the channel table is empty", "jointlab simulate --config jointlab.toml")
    assert contents() == before


@pytest.mark.usefixtures("drive")
def test_a_run_that_fails_keeps_its_measurements_and_says_why(
    jointlab: Command, sequence: Write, query: Query, laboratory: Laboratory, operator: SimulatedOperator
) -> None:
    strikes = iter(range(1, 100))
    plain_strike = operator.strike

    def strike(point: Any, blow: int) -> None:
        if next(strikes) == 4:
            laboratory.daq.faults.set("device_gone")
        plain_strike(point, blow)

    operator.strike = strike  # type: ignore[method-assign]  # a person who pulls a plug
    answer = jointlab("run", sequence())
    assert answer.returncode == INSTRUMENT
    assert "Traceback" not in answer.stderr
    ((state, reason, blows),) = query("SELECT state, reason, blows_accepted FROM v_runs")
    assert (state, blows) == ("failed", 3)
    assert answer.stderr.splitlines()[-1] == f"jointlab: {reason}"

    laboratory.daq.faults.clear()
    assert jointlab("run", sequence()).returncode == 0
    assert query("SELECT state FROM v_runs ORDER BY run_id") == [("failed",), ("finished",)]


@pytest.mark.usefixtures("drive")
def test_ctrl_c_is_130_and_the_run_is_stopped(
    jointlab: Command, sequence: Write, query: Query, operator: SimulatedOperator
) -> None:
    def leave(specimen: str, configuration: str) -> None:
        raise KeyboardInterrupt

    operator.mount = leave  # type: ignore[method-assign]  # a person who presses Ctrl-C
    answer = jointlab("run", sequence())
    assert answer.returncode == INTERRUPTED
    assert answer.stderr.splitlines()[-1] == "jointlab: interrupted"
    assert query("SELECT state, reason, blows_accepted FROM v_runs") == [("stopped", "stopped by hand", 8)]


def test_nothing_is_mounted_where_there_is_no_terminal_to_confirm() -> None:
    operator = TerminalOperator(PlainConsole(stderr=True))
    with pytest.raises(RequestError, match="mount the cylinders of joint I in shear: there is no terminal to confirm"):
        operator.mount("I", "shear")


def test_a_point_that_no_hammer_reaches_is_said_in_the_bench_s_words(operator: SimulatedOperator) -> None:
    with pytest.raises(RequestError, match="the simulated bench refuses: "):
        operator.strike(Dof.parse("2y"), 1)


def test_a_laboratory_that_has_gone_is_said() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        hand = OperatorClient(f"127.0.0.1:{listener.getsockname()[1]}")
        connection, _ = listener.accept()
        connection.close()
    with closing(hand), pytest.raises(RequestError, match="the simulated laboratory does not answer"):
        SimulatedOperator(hand).strike(Dof.parse("3y"), 1)
