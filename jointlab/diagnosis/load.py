"""The subject of a diagnosis, from a bundle or a run."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from analysis.dof import Direction, Dof
from analysis.gap import measurement as gap
from analysis.modal.response_variance import smoothed_variance, variance_from_neighbours, weighed_over_more
from jointlab.identification.load import measurement_of_bundle, measurement_of_run
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.structure import beam_of
from store.catalogue import Catalogue
from store.exchange.blow_file import BundleBlow
from store.exchange.bundle import Bundle
from store.exchange.bundle_exchange import stored_blows
from store.exchange.bundle_setup import Article
from store.measurements.frequency_responses import FrequencyResponseSet
from store.measurements.runs import get_run
from store.progress import Progress, silent
from store.states import HAMMER

LOWEST_LINE = 5.0
"""Hz. At lower frequencies ten blows of two seconds are too short, and an accelerometer is too noisy."""
FINEST = 1e-6
"""Least standard deviation, over the rms of a set's accelerances."""
NEIGHBOURS = 9
"""Lines over which a variance is averaged once more before it serves as a weight."""


@dataclass(frozen=True, eq=False)
class Subject:
    """A measurement to diagnose.

    Attributes:
        title: of the bundle or the run.
        measurement: of both rigs, or of one.
        left_out: measurements that a diagnosis does not use, a sentence each.
    """

    title: str
    measurement: gap.Measurement
    left_out: tuple[str, ...] = ()


def subject_of_bundle(bundle: Bundle) -> Subject:
    """The subject in a bundle.

    Raises:
        AnalysisError: there is nothing to diagnose, or a table contradicts itself.
    """
    return _subject(measurement_of_bundle(bundle), bundle.setup.model_dump(mode="json"), bundle.blows)


def subject_of_run(catalogue: Catalogue, run_id: int, progress: Progress = silent) -> Subject:
    """The subject in a run: computed from its raw records where it was measured here, else as it was imported.

    Raises:
        StoreError: there is no such run, or a record is damaged.
        AnalysisError, JointlabError: there is nothing to diagnose.
    """
    measured = measurement_of_run(catalogue, run_id, progress=progress)
    with catalogue.reading() as session:
        setup = get_run(session, run_id).setup
    return _subject(measured, setup, stored_blows(catalogue, run_id))


def _subject(measured: MeasuredArticle, setup: Mapping[str, Any], blows: tuple[BundleBlow, ...]) -> Subject:
    """`setup` is in the form of setup.json; a run that was measured here has no ``predict`` in it."""
    asked = tuple((_dof(each["response"]), _dof(each["input"])) for each in setup.get("predict", ()))
    preset_mm = (setup.get("direct") or {}).get("preset_mm", 0.0)
    struck = tuple(each for each in measured.sets if each.excitation == HAMMER)
    return Subject(
        measured.title,
        gap_measurement(replace(measured, sets=struck), preset_mm, asked, tuple(map(_raw_blow, blows))),
        tuple(
            f"set {each.number} is of a shaker at {each.response}: a diagnosis takes hammer sets only"
            for each in measured.sets
            if each.excitation != HAMMER
        ),
    )


def _raw_blow(blow: BundleBlow) -> gap.RawBlow:
    """The record with a force that is positive when the hammer pushes; in the file it is along a positive direction."""
    sign = np.sign(blow.force[np.argmax(np.abs(blow.force))]) or 1.0
    return gap.RawBlow(
        name=blow.file.removesuffix(".unv"),
        point=Dof(blow.point.node, Direction(blow.point.direction)),
        force=sign * blow.force,
        acceleration=sign * blow.acceleration,
        sample_rate=blow.sample_rate,
    )


def _dof(written: tuple[int, str]) -> Dof:
    node, direction = written
    return Dof(node, Direction(direction))


def gap_measurement(
    measured: MeasuredArticle,
    preset_mm: float = 0.0,
    predict: tuple[tuple[Dof, Dof], ...] = (),
    blows: tuple[gap.RawBlow, ...] = (),
) -> gap.Measurement:
    """A measurement in the form that the diagnosis takes.

    Args:
        measured: accelerances and sine points of one article.
        preset_mm: mean displacement in the tester.
        predict: responses and inputs of the accelerances to predict.
        blows: records that were kept.

    Raises:
        AnalysisError: there is nothing to diagnose, or a table contradicts itself.
    """
    article = measured.article
    tolerances = article.tolerances.model_dump()
    inclination_deg = tolerances.pop("inclination_deg")
    return gap.Measurement(
        drawing=drawing_of(article),
        sets=tuple(_hammer_set(measured, index) for index in range(len(measured.sets))),
        points=_points(measured),
        tolerances=gap.SetUpTolerances(**tolerances, inclination=float(np.radians(inclination_deg))),
        preset=preset_mm * 1e-3,
        predict=predict,
        blows=blows,
    )


def drawing_of(article: Article) -> gap.Drawing:
    """The bench as drawn."""
    return gap.Drawing(
        beam=beam_of(article),
        node_positions=np.array(article.node_positions),
        damping_ratios=tuple(article.beam.free_damping_ratios),
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


def _hammer_set(measured: MeasuredArticle, index: int) -> gap.HammerSet:
    stored, responses = measured.sets[index], measured.responses(index)
    keep = responses.frequency >= LOWEST_LINE
    variance = responses.variance
    if variance is None:
        variance = smoothed_variance(variance_from_neighbours(responses.accelerance), NEIGHBOURS)
    else:
        variance = weighed_over_more(variance, _blows_behind(measured, stored), NEIGHBOURS)
    # a row without signal, or a coherence of exactly one, does not tell the noise
    finest = max(FINEST * float(np.sqrt(np.mean(np.abs(responses.accelerance) ** 2))), float(np.finfo(float).tiny))
    return gap.HammerSet(
        inputs=responses.inputs,
        frequency=responses.frequency[keep],
        accelerance=responses.accelerance[:, keep],
        deviation=np.maximum(np.sqrt(variance), finest)[:, keep],
        peak_force=stored.peak_force,
        temperature=stored.temperature_c,
        coherence=None if responses.coherence is None else responses.coherence[:, keep],
        decay=responses.decay,
    )


def _blows_behind(measured: MeasuredArticle, stored: FrequencyResponseSet) -> tuple[int, ...]:
    """The number of blows behind the variance of each row: of its records, if they are there, or as stated."""
    records = measured.forces.get(stored.number)
    if measured.raw and records is not None:
        return tuple(len(each.force) for each in records)
    return (stored.averages,) * len(stored.inputs)


def _points(measured: MeasuredArticle) -> gap.TesterPoints | None:
    if not measured.points:
        return None
    names = [joint.name for joint in measured.article.joints]
    points, results = measured.points, [point.result for point in measured.points]
    planned, elapsed = [point.order_number for point in points], [point.elapsed for point in points]
    return gap.TesterPoints(
        order=np.argsort(np.lexsort((planned, elapsed))).astype(np.float64) + 1,  # when each was measured
        specimen=np.array([names.index(point.specimen) for point in points]),
        configuration=np.array([gap.Configuration[point.configuration.upper()] for point in points], dtype=np.intp),
        amplitude=np.array([point.amplitude_pp_mm for point in points]) * 0.5e-3,
        frequency=np.array([result.frequency for result in results]),
        stiffness=np.array([result.complex_stiffness for result in results]),
        deviation=np.array([np.sqrt(np.trace(result.covariance_about_amplitude) / 2) for result in results]),
        temperature=np.array([np.nan if p.temperature_c is None else p.temperature_c for p in points]),
    )
