"""Joints of labelled bundles, from their accelerances alone; the benches are off the drawing by what they state."""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.dof import Direction, Dof
from analysis.frequency_response import FrequencyResponses
from analysis.inverse.cylinder_parameters import CylinderPair, CylinderParameters
from analysis.inverse.identification import PAPER_DOFS, identify_joints
from analysis.inverse.joint_estimate import JointEstimate
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.modal.estimation import estimate_modes
from analysis.modal.response_variance import smoothed_variance, variance_from_coherence
from analysis.structure.beam import Mesh, assemble
from jointlab.identification.inverse import tolerances_of
from jointlab.identification.structure import beam_of
from store.exchange.bundle import read_bundle
from tests.recordings import Recording


@dataclass(frozen=True)
class Example:
    truth: dict[str, Any]
    by_modes: dict[str, JointEstimate]
    by_terms: JointFit
    by_cylinders: JointFit


@pytest.fixture(scope="module", params=["none", "frame"])
def example(recording: Recording, request: pytest.FixtureRequest) -> Example:
    """Bundles with nothing but tolerances between bench and drawing; what is wrong in `frame` concerns the tester."""
    bundle = read_bundle(recording(f"examples/{request.param}"))
    setup, first = bundle.setup, bundle.inverse[0]
    tolerances = tolerances_of(setup, by_hand=False)
    free = assemble(
        beam_of(setup),
        Mesh.through(setup.node_positions, elements_between=16),
        damping_ratios=setup.beam.free_damping_ratios,
    )
    accelerance = first.accelerance.astype(np.complex128)
    assert first.coherence is not None
    responses = FrequencyResponses(
        frequency=first.frequency,
        accelerance=accelerance,
        response=Dof(first.response.node, Direction(first.response.direction)),
        inputs=tuple(Dof(point.node, Direction(point.direction)) for point in first.inputs),
        variance=smoothed_variance(variance_from_coherence(accelerance, first.coherence, first.averages)),
    )
    measured = tuple(point for point in PAPER_DOFS if point in responses.inputs)
    nodes = {joint.name: joint.node for joint in setup.joints}
    start = identify_joints(free, estimate_modes(responses).modes, nodes, measured)
    joints = [found.joint for found in start.values()]
    pairs = tuple(
        CylinderPair(
            joint.name,
            (float(np.radians(joint.inclinations_deg[0])), float(np.radians(joint.inclinations_deg[1]))),
            joint.eccentricity,
        )
        for joint in setup.joints
    )
    return Example(
        truth=json.loads(recording(f"examples/truth/{request.param}.json").read_text(encoding="utf-8"))["joints"],
        by_modes=start,
        by_terms=identify_from_responses(free, responses, joints, tolerances=tolerances),
        by_cylinders=identify_from_responses(
            free,
            responses,
            joints,
            tolerances=tolerances,
            parameters=CylinderParameters(pairs, tolerances.inclination),
        ),
    )


ROUTES = ["by_terms", "by_cylinders"]


def deviations_off(value: float, interval: NDArray[np.float64], truth: float) -> float:
    return abs(value - truth) / (float(np.ptp(interval)) / 2 / 1.96)


@pytest.mark.parametrize("route", ROUTES)
def test_dominant_terms_come_out_within_half_a_percent_and_as_uncertain_as_stated(example: Example, route: str) -> None:
    fit: JointFit = getattr(example, route)
    off = []
    for name, exact in example.truth.items():
        found = fit.joints[name]
        for p, q in ((0, 1), (1, 1)):
            assert found.stiffness[p, q] == pytest.approx(exact["k"][p][q], rel=0.005)
            assert found.damping[p, q] == pytest.approx(exact["h"][p][q], rel=0.01)
            off.append(deviations_off(found.stiffness[p, q], found.k_ci95[p, q], exact["k"][p][q]))
            off.append(deviations_off(found.damping[p, q], found.h_ci95[p, q], exact["h"][p][q]))
    total, covariance, _ = fit.sum_of(0, 0)
    truth = sum(exact["k"][0][0] for exact in example.truth.values())
    assert total.real == pytest.approx(truth, rel=0.005)
    off.append(abs(total.real - truth) / np.sqrt(covariance[0, 0]))
    assert max(off) < 3.0
    assert sum(each > 1.96 for each in off) <= 1  # of nine, at 95 %


@pytest.mark.parametrize("route", ROUTES)
def test_the_fit_passes_its_checks(example: Example, route: str) -> None:
    fit: JointFit = getattr(example, route)
    assert fit.passed
    assert fit.noise_scale == pytest.approx(1.0, abs=0.1)


def test_only_the_cylinders_give_k11_of_each_joint(example: Example) -> None:
    for name, exact in example.truth.items():
        wide, narrow = (fit.joints[name] for fit in (example.by_terms, example.by_cylinders))
        for found in (wide, narrow):
            assert deviations_off(found.stiffness[0, 0], found.k_ci95[0, 0], exact["k"][0][0]) < 3.0
            assert not found.observable[0, 0]
        assert np.ptp(narrow.k_ci95[0, 0]) < 0.25 * np.ptp(wide.k_ci95[0, 0])


def test_modes_alone_are_further_off(example: Example) -> None:
    exact = example.truth["I"]["k"][0][1]
    error = abs(example.by_modes["I"].stiffness[0, 1] - exact)
    assert error > 10 * abs(example.by_terms.joints["I"].stiffness[0, 1] - exact)
    assert error > 0.03 * exact
