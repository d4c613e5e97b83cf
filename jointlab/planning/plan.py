"""Expectations before a hammer test: expected intervals, remedies, design quantities, studies of Figs. 3 and 4."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from analysis.dof import Direction, Dof
from analysis.frequency_response import Real
from analysis.inverse.experiment_information import ExpectedAccuracy, PlannedExperiment, PlannedSet, expected
from analysis.inverse.experiment_remedies import Remedy, remedies
from analysis.structure.bench_design import (
    BenchDesign,
    EigenvalueStudy,
    Support,
    bench_design,
    condition_numbers,
    eigenvalue_study,
)
from analysis.structure.joints import Cylinder, Joint, joint_from_cylinders
from jointlab.errors import JointlabError
from jointlab.identification.inverse import LOWEST_LINE, cylinder_parameters_of, tolerances_of
from jointlab.identification.structure import free_beam_of
from rig.sequences.sequence import HammerStep, Sequence
from store.exchange.bundle_setup import Article

STIFFNESS_RATIOS = np.geomspace(0.1, 1000.0, 41)
"""k-bar of the studies, as in Figs. 3 and 4."""
FEW, MORE = 3, 6
"""Modes of Fig. 3a and of Fig. 3b."""


@dataclass(frozen=True)
class ExpectedCylinder:
    """Expected properties of the cylinders of every joint: N/m, N/m, N m and the loss factor of all three."""

    shear: float
    compression: float
    rotation: float
    loss_factor: float


@dataclass(frozen=True, eq=False)
class Plan:
    """Expectations before a hammer test.

    Attributes:
        title: of the sequence.
        joints: as expected.
        points: that are to be struck.
        noise: of an averaged accelerance, per real and imaginary part, (m/s^2)/N.
        expectation: standard deviations and weak directions.
        remedies: of the weakest direction, the best first.
        design: R, k-bar and theta, and objections to the bench.
        stiffness_ratios: (points,) k-bar of both studies.
        conditions: by number of modes, (points, joints) of Eq. (45), Fig. 3.
        eigenvalues: Fig. 4.
    """

    title: str
    joints: tuple[Joint, ...]
    points: tuple[Dof, ...]
    noise: float
    expectation: ExpectedAccuracy
    remedies: tuple[Remedy, ...]
    design: BenchDesign
    stiffness_ratios: Real
    conditions: Mapping[int, Real]
    eigenvalues: EigenvalueStudy


def plan_of(sequence: Sequence, cylinder: ExpectedCylinder, noise: float, elements: int | None = None) -> Plan:
    """Plan the hammer test on the supported beam of a sequence.

    Args:
        sequence: whose first hammer step on the supported beam counts.
        cylinder: expected properties of the cylinders; the information depends little on them.
        noise: standard deviation of the averaged accelerances, per real and imaginary part, (m/s^2)/N.
        elements: of the beam between neighbouring nodes; 1 is the paper's mesh.

    Raises:
        JointlabError: the sequence does not strike the supported beam, or keeps no line that is evaluated.
        AnalysisError: the bench is not possible as described.
    """
    step = next((step for step in sequence.hammer_steps if step.beam == "supported"), None)
    if step is None:
        raise JointlabError(f"{sequence.title}: no hammer step on the supported beam to plan")
    article = sequence.article
    free_beam = free_beam_of(article, elements=elements)
    joints = _joints(article, cylinder)
    planned = _planned_set(article, step, noise)
    experiment = PlannedExperiment(free_beam, joints, (planned,), tolerances_of(article, by_hand=True))
    design = bench_design(free_beam, joints, step.highest_frequency)
    supports = [
        Support(
            name=joint.name,
            node=joint.node,
            aspect_ratio=designed.aspect_ratio,
            inclination=designed.inclination,
            loss_factor=cylinder.loss_factor,
            rotation_ratio=designed.rotation_ratio,
        )
        for joint, designed in zip(joints, design.joints, strict=True)
    ]
    return Plan(
        title=sequence.title,
        joints=joints,
        points=planned.inputs,
        noise=noise,
        expectation=expected(experiment),
        remedies=remedies(experiment, cylinder_parameters_of(article).pairs),
        design=design,
        stiffness_ratios=STIFFNESS_RATIOS,
        conditions={modes: condition_numbers(free_beam, STIFFNESS_RATIOS, modes, supports) for modes in (FEW, MORE)},
        eigenvalues=eigenvalue_study(free_beam, STIFFNESS_RATIOS, MORE, supports),
    )


def _joints(article: Article, cylinder: ExpectedCylinder) -> tuple[Joint, ...]:
    lossy = 1 + 1j * cylinder.loss_factor
    alike = Cylinder(lossy * cylinder.shear, lossy * cylinder.compression, lossy * cylinder.rotation)
    return tuple(
        joint_from_cylinders(
            drawn.name,
            drawn.node,
            (alike, alike),
            [math.radians(angle) for angle in drawn.inclinations_deg],
            drawn.eccentricity,
        )
        for drawn in article.joints
    )


def _planned_set(article: Article, step: HammerStep, noise: float) -> PlannedSet:
    lowest = math.ceil(LOWEST_LINE * step.block_seconds)
    highest = math.floor(step.highest_frequency * step.block_seconds)
    if highest < lowest:
        raise JointlabError(
            f"the hammer step has no line from {LOWEST_LINE:g} to {step.highest_frequency:g} Hz; raise "
            "highest_frequency, or block_seconds for a finer spacing"
        )
    return PlannedSet(
        response=Dof(article.accelerometer.node, Direction(article.accelerometer.direction)),
        inputs=tuple(Dof.parse(point) for point in step.points),
        frequency=np.arange(lowest, highest + 1) / step.block_seconds,
        noise=noise,
    )
