"""Modes of accelerances that others recorded, and of a bundle of hammer measurements."""

import json

import numpy as np
import pytest
import pyuff

from analysis.dof import Dof
from analysis.frequency_response import FrequencyResponses
from analysis.modal.estimation import ModalEstimate, estimate_modes
from analysis.modal.response_variance import smoothed_variance, variance_from_coherence
from analysis.structure.beam import Beam, Mesh, assemble
from analysis.structure.forward import eigensolution
from analysis.structure.joints import Joint
from tests.recordings import Recording

BEAM_HZ = [51.5, 142.18, 278.66, 460.39, 687.16, 958.5]  # what three other tools agree on
BUNDLES = {  # modes up to 1024 Hz
    "none": 6,
    "amplitude": 6,
    "delay": 6,
    "frame": 6,
    "pair": 6,
    "sensor_mass": 6,
    "foundation": 7,  # and the resonance of the foundation
    "out_of_plane": 8,  # and two of bending out of plane
}


def recorded_beam(recording: Recording) -> FrequencyResponses:
    sets = pyuff.UFF(str(recording("data/beam/beam_accelerance_derived.uff"))).read_sets()
    return FrequencyResponses(
        frequency=sets[0]["x"],
        accelerance=np.array([entry["data"] for entry in sets]),
        response=Dof.parse("1y"),
        inputs=tuple(Dof.parse(f"{entry['ref_node']}y") for entry in sets),
    )


def bundle(recording: Recording, name: str) -> FrequencyResponses:
    """The reference set of a bundle; its coherence is of ten averages."""
    sets = pyuff.UFF(str(recording(f"examples/{name}/inverse_1.unv"))).read_sets()
    accelerances = [entry for entry in sets if entry["func_type"] == 4]
    accelerance = np.array([entry["data"] for entry in accelerances])
    coherence = np.array([entry["data"].real for entry in sets if entry["func_type"] == 6])
    return FrequencyResponses(
        frequency=accelerances[0]["x"],
        accelerance=accelerance,
        response=Dof.parse("3y"),
        inputs=tuple(Dof.parse(f"{entry['ref_node']}{' xy'[entry['ref_dir']]}") for entry in accelerances),
        coherence=coherence,
        variance=smoothed_variance(variance_from_coherence(accelerance, coherence, 10)),
    )


@pytest.fixture(scope="module")
def beam(recording: Recording) -> ModalEstimate:
    return estimate_modes(recorded_beam(recording))


@pytest.fixture(scope="module")
def bench(recording: Recording) -> ModalEstimate:
    return estimate_modes(bundle(recording, "none"), band=(20.0, 1024.0))


def test_a_recorded_beam_has_the_six_modes_that_other_tools_find(beam: ModalEstimate) -> None:
    assert beam.modes.frequency == pytest.approx(BEAM_HZ, rel=1e-3)


def test_intervals_of_a_recorded_beam_hold_what_other_tools_find(beam: ModalEstimate) -> None:
    """The others round to 0.01 Hz, and to 0.1 Hz in the first and the last."""
    rounding = np.array([0.05, 0.005, 0.005, 0.005, 0.005, 0.05])
    assert np.all(beam.frequency_ci95[:, 0] - rounding < BEAM_HZ)
    assert np.all(beam.frequency_ci95[:, 1] + rounding > BEAM_HZ)


def test_the_sixth_damping_of_a_recorded_beam_lies_among_those_of_other_tools(beam: ModalEstimate) -> None:
    """Peaks narrower than the line spacing: the others give 0.007 to 0.021 % of critical."""
    ratio = beam.modes.loss_factor[5] / 2
    assert 0.7e-4 < ratio < 2.1e-4
    assert np.all(beam.loss_factor_ci95[:, 0] > 0)


def test_the_six_modes_of_a_bench_are_found_and_the_near_repeated_ones_separated(bench: ModalEstimate) -> None:
    assert bench.modes.poles.size == 6
    assert bench.modes.frequency[1] - bench.modes.frequency[0] == pytest.approx(2.3, abs=0.3)
    assert bench.modes.loss_factor[1] > 2 * bench.modes.loss_factor[0]


def test_measured_noise_explains_the_residual_of_a_bench(bench: ModalEstimate) -> None:
    assert 0.85 < bench.chi_square_per_line.mean() < 1.1
    assert bench.noise_scale < 1.05


def test_the_modes_of_a_bench_are_those_of_its_true_joints(recording: Recording, bench: ModalEstimate) -> None:
    """The beam model with the joints, positions and material that were put in gives what was estimated."""
    setup = json.loads(recording("examples/none/setup.json").read_text())
    truth = json.loads(recording("examples/truth/none.json").read_text())
    put_in, given = truth["baseline"], setup["beam"]
    beam = Beam(
        given["length"],
        given["height"],
        given["width"],
        given["youngs_modulus"] * put_in["E"],
        given["poisson_ratio"],
        given["density"] * put_in["rho"],
    )
    positions = setup["node_positions"]
    positions[1], positions[9] = put_in["joint_x"]
    free_beam = assemble(beam, Mesh.through(positions), damping_ratios=tuple(given["free_damping_ratios"]))
    joints = [
        Joint(name, node, np.array(joint["k"]) + 1j * np.array(joint["h"]))
        for (name, joint), node in zip(truth["joints"].items(), (2, 10), strict=True)
    ]
    true = eigensolution(free_beam, joints, 1024.0)
    assert bench.modes.frequency == pytest.approx(true.frequency, rel=1e-4)
    assert bench.modes.loss_factor == pytest.approx(true.loss_factor, rel=1e-3)


@pytest.mark.parametrize("name", [name for name in BUNDLES if name != "none"])
def test_every_mode_of_a_bundle_is_found_and_none_is_invented(recording: Recording, name: str) -> None:
    estimate = estimate_modes(bundle(recording, name), band=(20.0, 1024.0))
    assert estimate.modes.poles.size == BUNDLES[name]
    assert 0.85 < estimate.chi_square_per_line.mean() < 1.1


def test_a_structure_that_changes_between_points_is_not_explained(recording: Recording) -> None:
    estimate = estimate_modes(bundle(recording, "novel_2"), band=(20.0, 1024.0))
    assert estimate.noise_scale > 1.15
