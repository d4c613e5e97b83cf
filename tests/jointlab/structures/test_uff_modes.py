"""A structure from a UFF file with modes that another program wrote, against its matrices."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyuff

from analysis.frequency_response import Complex, Real
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.modal_structure import ModalStructure
from analysis.gap.structures.modes import Attached, NormalModes
from jointlab.errors import JointlabError
from jointlab.structures.plug_ins import simulator_named
from jointlab.structures.uff_modes import structure_of_uff
from store.errors import StoreError
from store.exchange.uff_modes import read_uff_modes
from tests.api.conftest import Command
from tests.jointlab.structures.curves import write_curves

COUNT = 5
DOFS = tuple(f"{node}y" for node in range(1, COUNT + 1))
LOSSES = np.linspace(0.01, 0.03, COUNT)
FREQUENCY = np.linspace(20.0, 250.0, 60)


def chain() -> NormalModes:
    """Five masses of 2 kg in a row, the first spring to the ground."""
    K = 1e6 * (2 * np.eye(COUNT) - np.eye(COUNT, k=1) - np.eye(COUNT, k=-1))
    K[-1, -1] = 1e6
    return replace(NormalModes.of_matrices(2 * np.eye(COUNT), K, DOFS, COUNT), losses=LOSSES)


def write(path: Path, datasets: Sequence[dict[str, Any]]) -> Path:
    for place, dataset in enumerate(datasets):
        pyuff.UFF(str(path)).write_sets(dataset, mode="add" if place else "overwrite")
    return path


def mode(number: int, values: Complex | Real, mass: float, **more: Any) -> dict[str, Any]:
    zeros = np.zeros_like(values)
    kind = {"data_type": 5 if np.iscomplexobj(values) else 2, "n_data_per_node": 3, "spec_data_type": 8}
    names = {f"id{line}": "NONE" for line in range(1, 6)}
    return {
        "type": 55, **names, "model_type": 1, "analysis_type": 2, "data_ch": 2, **kind, "load_case": 1,
        "mode_n": number, "freq": chain().frequencies[number - 1], "modal_m": mass, "modal_damp_vis": 0.0,
        "modal_damp_his": LOSSES[number - 1], "node_nums": np.arange(1, COUNT + 1), "r1": zeros, "r2": values,
        "r3": zeros, **more,
    }  # fmt: skip


def units(code: int, length: float, force: float) -> dict[str, Any]:
    """Dataset 164, whose factors divide."""
    return {"type": 164, "units_code": code, "units_description": "x", "length": length, "force": force, "temp": 1.0,
            "temp_offset": 0.0}  # fmt: skip


def response(structure: ModalStructure) -> Complex:
    size = FREQUENCY.size
    curve = Curve("accelerance(2y,4y)", "a", np.ones(size, dtype=complex), np.ones(size), {"frequency": FREQUENCY})
    return structure.predict({each.name: each.centre for each in structure.parameters}, (), curve)


EXPECTED = response(ModalStructure(chain(), parameters=()))


@pytest.mark.parametrize("mass", [1.0, 3.7])
def test_responses_are_those_of_the_matrices_whatever_the_scale_of_the_shapes(tmp_path: Path, mass: float) -> None:
    shapes = np.sqrt(mass) * chain().shapes.T
    file = write(tmp_path / "a.unv", [mode(n + 1, shapes[n], mass) for n in reversed(range(COUNT))])
    found = structure_of_uff(file)
    assert found.modes.dofs == DOFS
    np.testing.assert_allclose(found.modes.frequencies, chain().frequencies, rtol=1e-4)
    np.testing.assert_allclose(response(found), EXPECTED, rtol=2e-3)


@pytest.mark.parametrize("place", [0, 2, COUNT])
def test_masses_are_in_tonnes_where_the_file_is_in_mm_and_newton_wherever_it_says_so(
    tmp_path: Path, place: int
) -> None:
    datasets = [mode(n + 1, shape * np.sqrt(1e3), 1.0) for n, shape in enumerate(chain().shapes.T)]
    datasets.insert(place, units(10, 1000.0, 1.0))
    found = structure_of_uff(write(tmp_path / "a.unv", datasets))
    np.testing.assert_allclose(response(found), EXPECTED, rtol=2e-3)


def test_modes_of_a_body_that_is_free_to_move_are_read(tmp_path: Path) -> None:
    shapes = chain().shapes.T
    file = write(tmp_path / "a.unv", [mode(1, np.full(COUNT, 0.3), 1.0, freq=0.0), mode(2, shapes[1], 1.0)])
    assert structure_of_uff(file).modes.frequencies[0] == 0.0


def test_complex_shapes_that_are_real_but_for_a_factor_are_turned(tmp_path: Path) -> None:
    modes = [mode(n + 1, shape * np.exp(0.7j * n), 1.0) for n, shape in enumerate(chain().shapes.T)]
    np.testing.assert_allclose(response(structure_of_uff(write(tmp_path / "a.unv", modes))), EXPECTED, rtol=2e-3)


def test_poles_of_complex_modes_are_read_with_their_modal_a(tmp_path: Path) -> None:
    datasets = []
    for n, shape in enumerate(chain().shapes.T):
        root = 2 * np.pi * chain().frequencies[n] * (1j - LOSSES[n] / 2)
        more = {"analysis_type": 3, "eig": root, "modal_a": 2j * root.imag * 4.0, "modal_b": 1.0 + 0j}
        datasets.append(mode(n + 1, 2.0 * shape.astype(complex), 1.0, **more))
    found = read_uff_modes(write(tmp_path / "a.unv", datasets))
    np.testing.assert_allclose(found.frequencies, chain().frequencies, rtol=1e-3)
    np.testing.assert_allclose(found.loss_factors, LOSSES, rtol=1e-3)
    np.testing.assert_allclose(np.abs(found.shapes), np.abs(chain().shapes), rtol=2e-3, atol=1e-4)


def test_of_two_conjugate_poles_one_is_a_mode(tmp_path: Path) -> None:
    root, shape = 2 * np.pi * chain().frequencies[0] * (1j - 0.01), chain().shapes.T[0].astype(complex)
    both = [{"analysis_type": 3, "eig": each, "modal_a": 2j * each.imag, "modal_b": 1 + 0j}
            for each in (root, root.conjugate())]  # fmt: skip
    found = read_uff_modes(write(tmp_path / "a.unv", [mode(1, shape, 1.0, **each) for each in both]))
    np.testing.assert_allclose(found.frequencies, chain().frequencies[:1], rtol=1e-3)


def test_a_shape_at_a_node_with_its_own_axes_is_along_those_of_the_file(tmp_path: Path) -> None:
    shape, nodes = chain().shapes.T[0], np.arange(1, COUNT + 1)
    drawn = {"type": 2411, "node_nums": nodes, "def_cs": 0 * nodes, "disp_cs": 7 * (nodes == 2), "color": nodes,
             "x": 1.0 * nodes, "y": 0.0 * nodes, "z": 0.0 * nodes}  # fmt: skip
    turned = {"type": 2420, "Part_UID": 1, "Part_Name": "a", "nodes": 1, "CS_sys_labels": [7], "CS_types": [0],
              "CS_colors": [1], "CS_names": ["b"], "CS_matrices": [np.diag([1.0, -1.0, -1.0, 1.0])[:, :3]]}  # fmt: skip
    found = read_uff_modes(write(tmp_path / "a.unv", [drawn, turned, mode(1, shape, 1.0)]))
    np.testing.assert_allclose(found.shapes[:, 0].real, shape * np.where(nodes == 2, -1, 1), rtol=1e-4)


def test_modes_that_cannot_be_used_are_refused_with_the_reason(tmp_path: Path) -> None:
    shapes = chain().shapes.T
    travelling = np.exp(1j * np.arange(COUNT))
    cases: list[tuple[list[dict[str, Any]], type[Exception], str]] = [
        ([units(1, 1.0, 1.0)], StoreError, "holds no mode"),
        ([mode(1, shapes[0], 0.0)], StoreError, "dataset 1: the mode has no modal mass"),
        ([mode(1, shapes[0], 1.0, analysis_type=5, freq_step_n=1)], StoreError, "analysis type 5"),
        ([units(5, 10.0, 1.0), mode(1, shapes[0], 1.0)], StoreError, "units code 5 of dataset 164 contradicts"),
        ([mode(1, shapes[0], 1.0), mode(2, shapes[1], 1.0, node_nums=np.arange(2, 7))], StoreError, "different nodes"),
        ([mode(1, shapes[0], -1.0)], StoreError, "dataset 1: the modal mass -1 is below zero"),
        ([mode(1, shapes[0], 1.0, freq=-20.0)], StoreError, "dataset 1: the frequency -20 Hz is below zero"),
        ([mode(1, shapes[0], 1.0, modal_damp_his=-0.01)], StoreError, "dataset 1: the loss factor -0.01 is below zero"),
        ([mode(1, shapes[0], 1.0, spec_data_type=12)], StoreError, "the shape is of data type 12; export shapes of"),
        ([mode(1, shapes[0], 1.0, node_nums=np.array([1, 2, 3, 4, 4]))], StoreError, "a node comes twice"),
        ([mode(1, np.zeros(COUNT), 1.0)], StoreError, "the shapes of all modes are zero at all nodes"),
        ([mode(1, travelling, 1.0)], JointlabError, "out of phase with the rest"),
    ]
    for datasets, error, said in cases:
        with pytest.raises(error, match=said):
            structure_of_uff(write(tmp_path / "a.unv", datasets))


def test_a_mass_that_the_modes_of_a_file_lack_is_named_at_its_place(jointlab: Command, tmp_path: Path) -> None:
    file = write(tmp_path / "chain.unv", [mode(n + 1, shape, 1.0) for n, shape in enumerate(chain().shapes.T)])
    assert simulator_named(str(file)).name == "chain.unv"
    random, curves = np.random.default_rng(2), []
    heavier = ModalStructure(chain(), (Attached("3y", mass=0.3),), parameters=())
    for observable in ("accelerance(2y,4y)", "accelerance(4y,4y)"):
        blank = Curve(observable, observable[-6:-1], np.ones(60, dtype=complex), np.ones(60), {"frequency": FREQUENCY})
        exact = heavier.predict({}, (), blank)
        noise = 0.01 * np.abs(exact) * (random.standard_normal(60) + 1j * random.standard_normal(60))
        curves.append(replace(blank, values=exact + noise, deviation=0.01 * np.abs(exact)))
    write_curves(tmp_path / "curves.csv", curves)
    without = [part for each in ("added_spring", "added_damper", "absorber") for part in ("--without", each)]
    answer = jointlab("gap", "diagnose", "curves.csv", "--model", "chain.unv", "--model-out", "m.json", *without)
    assert answer.returncode == 0, answer.stderr
    assert "EXPLAINED: a mass that the model lacks at 3y (added_mass" in answer.stdout
    assert '"place": "3y"' in (tmp_path / "m.json").read_text(encoding="utf-8")
