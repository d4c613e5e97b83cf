"""Joints against amplitude where a shaker is there: sets of steady sines beside one of a hammer, in one bundle."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from jointlab.diagnosis.load import subject_of_bundle
from jointlab.identification.document import identification_document
from jointlab.identification.load import measurement_of_bundle, measurement_of_run
from jointlab.identification.pipeline import identify
from jointlab.sequences.of_run import sequence_of_run
from simlab.article import NODE_POSITIONS
from simlab.bench import SimulatedBench, ordinary_bench
from simlab.clock import Clock
from simlab.ordinary import BenchConditions
from simlab.truth import BLOW_BAND
from store.catalogue import Catalogue
from store.dof import StoredDof
from store.exchange.accelerance_file import accelerance_functions
from store.exchange.bundle import Bundle, read_bundle
from store.exchange.bundle_exchange import import_bundle
from store.exchange.uff import write_uff
from store.states import HAMMER, SINE, Excitation
from tests.simlab.shaking import shake

NOISE = 0.003  # (m/s^2)/N a line
FREQUENCY = np.arange(20.0, 1025.0, 1.0)
POINTS = tuple(map(StoredDof.parse, ["1y", "3y", "4y", "5y", "6y", "7y", "8y", "9y", "11y", "1x", "11x"]))
SHAKER = StoredDof.parse("5y")
FORCES = (0.02, 0.5)


@pytest.fixture(scope="module")
def bench() -> SimulatedBench:
    return ordinary_bench(1, Clock(), BenchConditions(tolerances=0.0, gain_error=0.0, cross_axis=0.0))


@pytest.fixture(scope="module")
def bundle(bench: SimulatedBench, tmp_path_factory: pytest.TempPathFactory) -> Bundle:
    folder = tmp_path_factory.mktemp("shaken")
    rng = np.random.default_rng(5)

    def written(name: str, fixed: StoredDof, accelerance: Any, excitation: Excitation) -> None:
        noise = NOISE * rng.standard_normal((2, *accelerance.shape))
        noisy = accelerance + noise[0] + 1j * noise[1]
        write_uff(folder / name, accelerance_functions(fixed, POINTS, FREQUENCY, noisy, excitation=excitation))

    struck = np.array([bench.accelerance(FREQUENCY, point.node, point.direction) for point in POINTS])
    written("inverse_1.unv", StoredDof.parse("3y"), struck, HAMMER)
    entries = [{"file": "inverse_1.unv", "peak_force": 100.0}]
    for number, force in enumerate(FORCES, start=2):
        places = [(NODE_POSITIONS[point.node - 1], point.direction) for point in POINTS]
        shaken = shake(bench.built.article, NODE_POSITIONS[SHAKER.node - 1], places, FREQUENCY, force)
        written(f"inverse_{number}.unv", SHAKER, shaken.accelerance, SINE)
        entries.append({"file": f"inverse_{number}.unv", "peak_force": force, "excitation": "sine"})
    recorded = {"averages": 1, "temperature_c": 23.0, "window": "none", "sample_rate": 4096.0, "block_seconds": 1.0}
    beam = bench.built.article.beam
    setup = {
        "format": "jointlab-bundle/1",
        "title": "shaken",
        "beam": {
            "length": beam.length, "height": beam.height, "width": beam.width, "youngs_modulus": beam.youngs_modulus,
            "poisson_ratio": beam.poisson_ratio, "density": beam.density,
            "free_damping_ratios": list(beam.damping_ratios),
        },
        "node_positions": list(NODE_POSITIONS),
        "joints": [
            {"name": "I", "node": 2, "inclinations_deg": [-45, 135], "eccentricity": 0.006, "added_mass": 0.0},
            {"name": "II", "node": 10, "inclinations_deg": [45, -135], "eccentricity": 0.006, "added_mass": 0.0},
        ],
        "accelerometer": {"node": 3, "direction": "y", "mass": 0.0},
        "inverse": [entry | recorded for entry in entries],
        "tolerances": {
            "node_position": 0.0, "sensor_gain": 0.0, "youngs_modulus": 0.0, "density": 0.0,
            "impact_position": 0.0, "inclination_deg": 0.0, "tester_gain": 0.0,
        },
    }  # fmt: skip
    (folder / "setup.json").write_text(json.dumps(setup), encoding="utf-8")
    return read_bundle(folder)


@pytest.fixture(scope="module")
def levels(bundle: Bundle) -> list[dict[str, Any]]:
    document = identification_document(identify(measurement_of_bundle(bundle)))
    assert [level["excitation"] for level in document["levels"]] == ["hammer", "sine", "sine"]
    return list(document["levels"])


def test_a_faint_sine_finds_the_joints_as_they_are_at_rest(bench: SimulatedBench, levels: list[dict[str, Any]]) -> None:
    for name, joint in levels[1]["joints"].items():
        at_rest = bench.built.article.joints[name].dynamic_stiffness(1e-8, BLOW_BAND).mean(axis=0)
        for at in ((0, 1), (1, 1)):
            assert joint["k"][at[0]][at[1]] == pytest.approx(at_rest[at].real, rel=0.003)
            assert joint["h"][at[0]][at[1]] == pytest.approx(at_rest[at].imag, rel=0.01)


@pytest.mark.parametrize("joint", ["I", "II"])
def test_the_louder_the_softer(levels: list[dict[str, Any]], joint: str) -> None:
    struck, faint, loud = (level["joints"][joint] for level in levels)
    assert struck["k"][1][1] < 0.99 * loud["k"][1][1] < 0.99 * faint["k"][1][1]
    assert faint["amplitude_pp_mm"] < loud["amplitude_pp_mm"] < struck["amplitude_pp_mm"]
    assert loud["amplitude_pp_mm"] / faint["amplitude_pp_mm"] == pytest.approx(FORCES[1] / FORCES[0], rel=0.1)
    assert "a sine of 0.5 N at 5y" in loud["amplitude_source"]


def test_amplitudes_at_the_modes_are_those_that_the_shaker_really_made(
    bench: SimulatedBench, bundle: Bundle, levels: list[dict[str, Any]]
) -> None:
    found = identify(measurement_of_bundle(bundle))
    assert found.inverse is not None
    modes = found.inverse.modal.modes.frequency
    places = [(NODE_POSITIONS[4], "y")]
    shaken = shake(bench.built.article, NODE_POSITIONS[4], places, np.asarray(modes), FORCES[0])
    for name, amplitude in shaken.amplitudes.items():
        expected = 2e3 * float(np.exp(np.mean(np.log(amplitude))))
        assert levels[1]["joints"][name]["amplitude_pp_mm"] == pytest.approx(expected, rel=0.15)


def test_the_hammer_levels_of_an_imported_run_are_struck_again_and_its_sines_are_not(
    bundle: Bundle, tmp_path: Path
) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'lab.db'}") as catalogue:
        run = import_bundle(catalogue, bundle)
        found = measurement_of_run(catalogue, run)
        assert [each.excitation for each in found.sets] == ["hammer", "sine", "sine"]
        with catalogue.reading() as session:
            again = sequence_of_run(session, run)
    assert [step.peak_force for step in again.hammer_steps] == [100.0]


def test_a_diagnosis_leaves_the_shaker_out_and_says_so(bundle: Bundle) -> None:
    subject = subject_of_bundle(bundle)
    assert len(subject.measurement.sets) == 1
    assert subject.left_out == tuple(
        f"set {number} is of a shaker at 5y: a diagnosis takes hammer sets only" for number in (2, 3)
    )
