"""The folder of a case: what other people's software reads from it, what it does not tell, and its truth."""

import csv
import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyuff

from simlab.bench import case_bench
from simlab.case.blows import noise_deviation
from simlab.case.bundle import commitment, floor_percent, sealed, truth, write_case
from simlab.case.campaign import ASKED_FOR, MEASURED, ROWS, draw_setup
from simlab.case.draw import CaseKind, draw_case
from simlab.case.simulate import simulate
from simlab.clock import Clock
from store.exchange.bundle import read_bundle

SETUPS = 4000
SEALED = draw_case(3, CaseKind.SINGLE, ["joint_mass"])


def test_the_store_takes_a_case_without_a_warning(tmp_path: Path) -> None:
    write_case(draw_case(3, CaseKind.SINGLE, ["mains_hum"]), tmp_path)
    bundle = read_bundle(tmp_path)
    assert not bundle.warnings
    assert len(bundle.direct) == 720
    assert len(bundle.blows) == 3


def test_pyuff_reads_accelerance_as_far_from_the_noiseless_one_as_its_noise(tmp_path: Path) -> None:
    case = draw_case(3, CaseKind.NONE)
    case = replace(case, campaign=replace(case.campaign, place_scatter=0.0))
    write_case(case, tmp_path)
    clean = simulate(case)
    for number, setup in enumerate(case.campaign.setups):
        datasets = pyuff.UFF(str(tmp_path / f"inverse_{number + 1}.unv")).read_sets()
        accelerances, coherences = datasets[: len(MEASURED)], datasets[len(MEASURED) :]
        assert {d["func_type"] for d in accelerances} == {4}
        assert {d["func_type"] for d in coherences} == {6}
        for functions in (accelerances, coherences):
            places = [(d["rsp_node"], d["rsp_dir"], d["ref_node"], d["ref_dir"]) for d in functions]
            assert places == [(3, 2, row.node, 1 + "xy".index(row.direction)) for row in MEASURED]
            assert all(d["x"][-1] == 1024.0 for d in functions)
        true = clean.accelerance[number, : len(MEASURED)]
        deviation = noise_deviation(true, clean.frequency, case.campaign, setup.peak_force)
        away = np.array([d["data"][1:] for d in accelerances]) - true
        assert np.sqrt(np.mean(np.abs(away / deviation) ** 2) / 2) == pytest.approx(1.0, abs=0.03)
        assert all(0.0 <= d["data"].min() <= d["data"].max() <= 1.0 for d in coherences)


def test_the_tester_table_scatters_as_it_says(tmp_path: Path) -> None:
    case = draw_case(5, CaseKind.NONE)
    write_case(case, tmp_path)
    with (tmp_path / "direct.csv").open(encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert [int(line["order"]) for line in table] == list(range(1, 721))
    size = np.array([float(line["stiffness_n_per_m"]) for line in table])
    phase = np.radians([float(line["phase_deg"]) for line in table])
    deviation = np.array([float(line["sd_rel"]) for line in table])
    stiffness = simulate(case).stiffness
    scatter = (size * np.exp(1j * phase) - stiffness) / np.abs(stiffness) / deviation
    assert np.std(scatter.real) == pytest.approx(1.0, abs=0.1)
    assert np.std(scatter.imag) == pytest.approx(1.0, abs=0.1)


def test_a_case_is_written_the_same_again(tmp_path: Path) -> None:
    for folder in ("once", "twice"):
        write_case(draw_case(7, CaseKind.PAIR, ["joint_mass", "transducer_lag"]), tmp_path / folder)
    once, twice = (
        {p.name: p.read_bytes() for p in (tmp_path / folder).rglob("*") if p.is_file()} for folder in ("once", "twice")
    )
    assert once == twice


@pytest.mark.parametrize(
    ("kind", "name"), [(CaseKind.SINGLE, "density"), (CaseKind.SINGLE, "double_hit"), (CaseKind.NOVEL, "absorber")]
)
def test_what_the_lab_says_of_a_case_does_not_tell_its_effects(kind: CaseKind, name: str, tmp_path: Path) -> None:
    write_case(draw_case(2, kind, [name]), tmp_path / "with")
    write_case(draw_case(2, CaseKind.NONE), tmp_path / "without")
    for file in ("setup.json", "direct.csv"):
        assert (tmp_path / "with" / file).read_bytes() == (tmp_path / "without" / file).read_bytes()


def test_the_truth_is_json_and_names_effects_and_novelties_apart() -> None:
    single = truth(draw_case(2, CaseKind.SINGLE, ["joint_mass"], size=0.5))
    again = json.loads(json.dumps(single))
    assert again["effects"] == ["joint_mass"]
    assert again["novel"] == []
    assert again["size"] == {"joint_mass": 0.5}
    assert {"law", "m"} <= set(again["parameters"]["joint_mass"])
    novel = truth(draw_case(2, CaseKind.NOVEL, ["absorber"]))
    assert novel["effects"] == []
    assert novel["novel"] == ["absorber"]


def test_the_floor_is_what_gain_and_marks_make_it() -> None:
    case = draw_case(6, CaseKind.NONE)
    seen, reference = simulate(case), case.campaign.setups[0]
    rows = slice(len(MEASURED), len(ROWS))
    accelerance, slope = seen.accelerance[0, rows], seen.slope[0, rows]
    random, apart = np.random.default_rng(1), 0.0
    for _ in range(SETUPS):
        again = draw_setup(random, reference.peak_force, reference.temperature)
        moved = accelerance + np.array(again.offsets[: len(ASKED_FOR)])[:, None] * slope
        apart += float(np.sum(np.abs(again.gain / reference.gain * moved - accelerance) ** 2)) / SETUPS
    by_setup = 100 * np.sqrt(apart / np.sum(np.abs(accelerance) ** 2))
    assert by_setup * 0.97 < floor_percent(case) < np.hypot(by_setup * 1.03, 0.3)


def test_what_is_asked_for_is_noiseless_and_where_the_drawing_says() -> None:
    case = draw_case(6, CaseKind.NONE)
    simulated = simulate(case)
    assert [row.name for row in simulated.rows[len(MEASURED) :]] == ["5y", "8y", "2y", "10y"]
    bench = case_bench(case, Clock())
    straight = [bench.accelerance(simulated.frequency, row.node, row.direction) for row in ASKED_FOR]
    np.testing.assert_allclose(simulated.accelerance[0, len(MEASURED) :], straight, rtol=1e-9)


def test_a_bench_opens_what_it_committed_to() -> None:
    bench = case_bench(SEALED, Clock(1.0))
    committed = bench.commitment()
    seal = bench.open_seal()
    assert commitment(seal) == committed == bench.commitment()
    assert seal["truth"]["effects"] == ["joint_mass"]
    # over the operator's line it comes as JSON, and is still what the hash is of
    assert commitment(json.loads(json.dumps(seal))) == committed


def test_a_commitment_is_a_hash_of_nonce_and_truth_that_chance_keeps_from_being_guessed() -> None:
    seal = sealed(truth(SEALED))
    text = json.dumps(seal, sort_keys=True, separators=(",", ":"))
    assert commitment(seal) == hashlib.sha256(text.encode()).hexdigest()
    assert commitment(sealed(truth(SEALED))) != commitment(seal)
    changed = seal | {"truth": seal["truth"] | {"effects": []}}
    assert commitment(changed) != commitment(seal)
