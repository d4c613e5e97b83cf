"""Right rows of exact benches stay as they are, although a rough fit may end in a minimum that is not the lowest."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from analysis.frequency_response import Complex
from analysis.gap.faults.rough_fit import rough_fit
from analysis.structure.beam import Beam, Mesh
from analysis.structure.converged import assemble_converged
from analysis.structure.joints import Cylinder, joint_from_cylinders
from analysis.structure.setup import RIGID_MODES
from api.commands.sequences import named_sequence
from jointlab.diagnosis.load import gap_measurement
from jointlab.identification.fault_correction import correct_faults
from jointlab.identification.inverse import inverse_of
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.options import Options
from jointlab.identification.validity_text import check_text
from store.dof import StoredDof
from store.measurements.frequency_responses import FrequencyResponseSet
from tests.bench.exact_beam import Attached, Blow, exact_accelerance

CYLINDERS = (Cylinder(0.36e6 + 0.0432e6j, 2.3e6 + 0.276e6j, 20.0), Cylinder(0.49e6 + 0.0441e6j, 2.7e6 + 0.243e6j, 20.0))
NOISE = 0.002
"""(m/s^2)/N, standard deviation of real and imaginary parts."""
LOSS_TIME = 7e-7
"""s: the modulus is E (1 + i w times this)."""


def measured(
    points: str,
    seed: int,
    nodes: Sequence[float],
    joints: Sequence[tuple[int, float]],
    *,
    scale: float = 1.0,
    height: float = 0.0254,
    material: tuple[float, float] = (207e9, 7850.0),
    sensor: int = 3,
    lines: tuple[float, float, float] = (20.0, 1024.0, 2.0),
) -> MeasuredArticle:
    """A beam on two joints, by node and inclination in degrees, struck at `points`; `lines` by arange, Hz."""
    paper = named_sequence("paper").article
    bar = Beam(nodes[-1], height, 0.0507874, material[0], 0.3, material[1])
    placed = [
        joint.model_copy(update={"node": node, "inclinations_deg": (lean, lean - 180.0), "added_mass": 0.0})
        for joint, (node, lean) in zip(paper.joints, joints, strict=True)
    ]
    natural = 2 * np.pi * assemble_converged(bar, Mesh.through(np.array(nodes), 8)).frequency[RIGID_MODES:]
    beam = paper.beam.model_copy(
        update={
            "length": bar.length, "height": height, "youngs_modulus": material[0], "density": material[1],
            "free_damping_ratios": tuple(np.minimum(natural * LOSS_TIME / 2, 0.99)[:12].tolist()),
        }
    )  # fmt: skip
    article = paper.model_copy(
        update={
            "beam": beam,
            "node_positions": tuple(nodes),
            "joints": tuple(placed),
            "accelerometer": paper.accelerometer.model_copy(update={"node": sensor, "mass": 0.0}),
        }
    )
    frequency, inputs = np.arange(*lines), tuple(map(StoredDof.parse, points.split()))
    attached = []
    for own, drawn in zip(CYLINDERS, placed, strict=True):
        softer = Cylinder(scale * own.shear, scale * own.compression, scale * own.rotation)
        angles = np.radians(drawn.inclinations_deg)
        joint = joint_from_cylinders(drawn.name, drawn.node, (softer, softer), angles, drawn.eccentricity)
        stiffness = np.broadcast_to(joint.dynamic_stiffness, (frequency.size, 3, 3))
        attached.append(Attached(nodes[drawn.node - 1], stiffness))
    blows = [Blow(nodes[dof.node - 1], **{dof.direction: 1.0}) for dof in inputs]
    modulus: Complex = np.asarray(bar.youngs_modulus * (1 + 2j * np.pi * frequency * LOSS_TIME))
    exact = exact_accelerance(bar, modulus, frequency, nodes[sensor - 1], blows, attached)
    parts = np.random.default_rng(seed).standard_normal((2, *exact.shape))
    found = FrequencyResponseSet(
        number=1, response=StoredDof(sensor, "y"), inputs=inputs, frequency=frequency,
        accelerance=exact + NOISE * (parts[0] + 1j * parts[1]), averages=10, peak_force=100.0, temperature_c=23.0,
        window="none", sample_rate=5120.0, block_seconds=1.0, estimator="H1",
        variance=np.full(exact.shape, NOISE**2),
    )  # fmt: skip
    return MeasuredArticle("an exact beam", article, (found,), (), raw=False)


PAPER_NODES = (0.0, *np.linspace(0.055, 0.859, 9).tolist(), 0.914)
PAPER_POINTS = "1y 3y 4y 5y 6y 7y 8y 9y 11y 1x 11x"


def test_rows_near_joints_that_lean_alike_are_not_swapped() -> None:
    right = measured(PAPER_POINTS, 1, PAPER_NODES, ((4, 45.0), (8, 45.0)), scale=0.3)
    assert correct_faults(right) is right


@pytest.mark.parametrize("seed", [1, 2, 6, 8])
def test_rows_along_the_beam_are_not_turned(seed: int) -> None:
    nodes = (0.0, *np.linspace(0.137, 1.346, 9).tolist(), 1.4)
    points = "1y 2y 4y 5y 6y 7y 9y 11y 1x 11x"
    right = measured(
        points, seed, nodes, ((3, 45.0), (8, -45.0)), scale=4.0, height=0.04, material=(70e9, 2700.0), sensor=1
    )
    assert correct_faults(right) is right


def test_lines_that_begin_high_are_fitted() -> None:
    lines = (200.0, 1024.0, 4.0)
    right = measured(PAPER_POINTS, 3, PAPER_NODES, ((2, -45.0), (10, 45.0)), lines=lines)
    assert rough_fit(gap_measurement(right)).holds
    assert correct_faults(right) is right


@pytest.mark.parametrize("turned", [False, True])
def test_rows_along_the_beam_that_are_all_turned_fail_a_check(turned: bool) -> None:
    right = measured(PAPER_POINTS, 3, PAPER_NODES, ((2, -45.0), (10, 45.0)))
    (rows,) = right.sets
    along = np.array([dof.direction == "x" for dof in rows.inputs])
    given = np.where(turned & along[:, None], -rows.accelerance, rows.accelerance)
    fit = inverse_of(replace(right, sets=(replace(rows, accelerance=given),)), options=Options(elements=2)).fit
    failed = {check.name: check_text(check) for check in fit.all_checks if not check.passed}
    assert set(failed) == ({"coupling as drawn"} if turned else set())
    assert not turned or "against the drawing: either all rows along" in failed["coupling as drawn"]
