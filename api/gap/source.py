"""A measurement as the gap diagnosis has it."""

from __future__ import annotations

import numpy as np

from analysis.dof import Direction, Dof
from analysis.gap import measurement as gap
from analysis.modal.response_variance import smoothed_variance, variance_from_neighbours
from analysis.structure.beam import Beam
from api.identification.measurement import Measurement
from store.bundle_setup import Article

LOWEST_LINE = 5.0
"""Hz. Below, ten blows of two seconds say little, and an accelerometer less."""
NEIGHBOURS = 9
"""Lines over which the variance of ten blows is averaged before it serves as a weight."""


def gap_measurement(measured: Measurement, preset_mm: float = 0.0) -> gap.Measurement:
    """What the diagnosis needs of a measurement.

    Raises:
        AnalysisError: there is nothing to diagnose, or a table contradicts itself.
    """
    article = measured.article
    tolerances = article.tolerances
    return gap.Measurement(
        drawing=drawing_of(article),
        sets=tuple(_hammer_set(measured, index) for index in range(len(measured.sets))),
        points=_points(measured),
        tolerances=gap.StatedTolerances(
            node_position=tolerances.node_position,
            sensor_gain=tolerances.sensor_gain,
            youngs_modulus=tolerances.youngs_modulus,
            density=tolerances.density,
            impact_position=tolerances.impact_position,
            inclination=float(np.radians(tolerances.inclination_deg)),
            tester_gain=tolerances.tester_gain,
        ),
        preset=preset_mm * 1e-3,
    )


def drawing_of(article: Article) -> gap.Drawing:
    """The bench as drawn."""
    beam = article.beam
    return gap.Drawing(
        beam=Beam(
            length=beam.length,
            height=beam.height,
            width=beam.width,
            youngs_modulus=beam.youngs_modulus,
            poisson_ratio=beam.poisson_ratio,
            density=beam.density,
        ),
        node_positions=np.array(article.node_positions),
        damping_ratios=tuple(beam.free_damping_ratios),
        joints=tuple(
            gap.DrawnJoint(
                name=joint.name,
                node=joint.node,
                inclinations=(
                    float(np.radians(joint.inclinations_deg[0])),
                    float(np.radians(joint.inclinations_deg[1])),
                ),
                eccentricity=joint.eccentricity,
                added_mass=joint.added_mass,
            )
            for joint in article.joints
        ),
        accelerometer=Dof(article.accelerometer.node, Direction(article.accelerometer.direction)),
        accelerometer_mass=article.accelerometer.mass,
    )


def _hammer_set(measured: Measurement, index: int) -> gap.HammerSet:
    stored, responses = measured.sets[index], measured.responses(index)
    keep = responses.frequency >= LOWEST_LINE
    variance = responses.variance
    if variance is None:
        variance = variance_from_neighbours(responses.accelerance)
    return gap.HammerSet(
        inputs=responses.inputs,
        frequency=responses.frequency[keep],
        accelerance=responses.accelerance[:, keep],
        deviation=np.sqrt(smoothed_variance(variance, NEIGHBOURS))[:, keep],
        peak_force=stored.peak_force,
        temperature=stored.temperature_c,
    )


def _points(measured: Measurement) -> gap.TesterPoints | None:
    if not measured.points:
        return None
    names = [joint.name for joint in measured.article.joints]
    points, results = measured.points, [point.result for point in measured.points]
    stiffness = np.array([result.complex_stiffness for result in results])
    spread = np.array([np.sqrt(np.trace(result.covariance) / 2) for result in results])
    return gap.TesterPoints(
        order=np.array([point.order_number for point in points], dtype=float),
        specimen=np.array([names.index(point.specimen) for point in points]),
        configuration=np.array([gap.Configuration[point.configuration.upper()] for point in points], dtype=np.intp),
        amplitude=np.array([point.amplitude_pp_mm for point in points]) * 0.5e-3,
        frequency=np.array([result.frequency for result in results]),
        stiffness=stiffness,
        deviation=spread,
        temperature=np.array([np.nan if p.temperature_c is None else p.temperature_c for p in points]),
    )
