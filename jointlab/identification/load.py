"""Loading of a measurement: from a bundle, an imported run, or the raw records of a run measured here."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from analysis.direct.dynamic_stiffness import dynamic_stiffness
from analysis.direct.mains_hum import MAINS, hum_of, mains_beside, tones_beside, with_hum
from analysis.direct.rig_calibration import CalibrationRun, KnownSpecimen
from analysis.direct.temperature import TemperatureCoefficients
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex
from analysis.interval import Estimate
from analysis.modal.spectra import Windows, responses_from_blows
from analysis.suspended.free_modes import BeamSuspension
from jointlab.errors import JointlabError
from jointlab.identification.bundle_blows import forces_of_bundle, scatter_of_bundle
from jointlab.identification.measurement import MeasuredArticle, PointForces, SuspendedTest, dof, responses_of
from jointlab.identification.options import AS_MEASURED, Options
from jointlab.identification.sine_points import IdentifiedSinePoint, sine_point
from jointlab.identification.tester_corrections import ReferenceTemperature
from jointlab.sequences import sequence_of
from rig.hammer.blow_comparison import inconsistent_blows
from rig.operator import SUPPORTED, SUSPENDED
from rig.sequences.sequence import DISPLACEMENT, FORCE, BlankStep, Compound, HammerStep
from rig.sequences.sequence import Sequence as RigSequence
from store.catalogue import Catalogue
from store.dof import StoredDof
from store.exchange.blow_file import BundleBlow
from store.exchange.bundle import Bundle
from store.exchange.bundle_exchange import stored_blows
from store.exchange.bundle_setup import Article, article_from
from store.exchange.direct_table import to_dynamic_stiffness
from store.measurements.blows import Blow, list_blows
from store.measurements.frequency_responses import FrequencyResponseSet, list_frequency_responses
from store.measurements.runs import Run, get_run
from store.measurements.sine_records import SineRecord, list_sine_records
from store.progress import Advance, Progress, silent
from store.results.analyses import latest_analysis
from store.results.dynamic_stiffness import StoredStiffness, list_dynamic_stiffness
from store.states import BLANK, AnalysisKind

DIMENSIONS = ("length", "height", "width")


def measurement_of_bundle(bundle: Bundle, options: Options = AS_MEASURED) -> MeasuredArticle:
    """The measurement that a bundle holds; of the options, estimator and windows act here.

    Raises:
        JointlabError: another average is asked for than the bundle has.
    """
    _check_as_averaged(options, bundle.setup.title)
    points = map(to_dynamic_stiffness, bundle.direct)
    return _of_averages(bundle.setup.title, bundle.setup, bundle.inverse, points, bundle.blows)


def measurement_of_run(
    catalogue: Catalogue, run_id: int, options: Options = AS_MEASURED, progress: Progress = silent
) -> MeasuredArticle:
    """The measurement of a run: computed from its raw records where it was measured here, else as it was imported.

    Args:
        options: estimator, windows and the run on the suspended beam act here.
        progress: is told how far the records are read.

    Raises:
        StoreError: there is no such run, or a record is damaged.
        AnalysisError: a record cannot be evaluated; the message names it.
        JointlabError: the run holds nothing to identify from, or was imported and another average is asked for; or the
            run on the suspended beam does not fit.
    """
    measurement = _own_measurement(catalogue, run_id, options, progress)
    if options.free_beam is None:
        return measurement
    return with_free_beam(measurement, catalogue, options, progress)


def _own_measurement(catalogue: Catalogue, run_id: int, options: Options, progress: Progress) -> MeasuredArticle:
    run = catalogue.read(get_run, run_id)
    if run.kind == "import":
        _check_as_averaged(options, f"run {run_id}")
        return _imported_measurement(catalogue, run)
    return _recorded_measurement(catalogue, run, options, progress)


def _imported_measurement(catalogue: Catalogue, run: Run) -> MeasuredArticle:
    with catalogue.reading() as session:
        points = list[StoredStiffness]()
        if run.setup.get("direct"):
            newest = latest_analysis(session, run.id, AnalysisKind.DYNAMIC_STIFFNESS)
            points = list_dynamic_stiffness(session, newest.id)
        sets = tuple(list_frequency_responses(session, run.id)) if run.setup.get("inverse") else ()
    found = _of_averages(run.title, article_from(run.setup), sets, points, stored_blows(catalogue, run.id))
    return replace(found, setup_version=run.setup_version)


def _of_averages(
    title: str,
    article: Article,
    sets: tuple[FrequencyResponseSet, ...],
    points: Iterable[StoredStiffness],
    blows: tuple[BundleBlow, ...],
) -> MeasuredArticle:
    """A measurement that came as averages and numbers, with the single blows that came with it."""
    return MeasuredArticle(
        title,
        article,
        sets,
        tuple(map(sine_point, points)),
        raw=False,
        scatter=scatter_of_bundle(sets, blows),
        forces=forces_of_bundle(sets, blows),
    )


def _recorded_measurement(catalogue: Catalogue, run: Run, options: Options, progress: Progress) -> MeasuredArticle:
    run_id, article = run.id, article_from(run.setup)
    with catalogue.reading() as session:
        blows = [blow for blow in list_blows(session, run_id) if blow.accepted]
        every_record = list_sine_records(session, run_id)
    records = [record for record in every_record if record.configuration != BLANK]
    blanks = [record for record in every_record if record.configuration == BLANK]
    if not blows and not records:
        raise JointlabError(
            f"run {run_id} ({run.state}) has neither accepted blows nor sine records: nothing to identify"
        )
    sequence = sequence_of(run)
    assert sequence is not None, "it was measured by one"
    with progress("accelerances", len(blows)) as advance:
        every_set = [
            (step, _accelerances(catalogue, article, own, step, options, advance))
            for number, step in enumerate(sequence.hammer_steps, start=1)
            if (own := [blow for blow in blows if blow.set_number == number])
        ]
    struck = [found for step, found in every_set if step.beam == SUPPORTED]
    points = _sine_points(catalogue, records, sequence, progress) if records else ()
    return MeasuredArticle(
        title=run.title,
        article=article,
        sets=tuple(each.measured for each in struck),
        points=points,
        raw=True,
        calibration=_calibration(catalogue, blanks, sequence, progress),
        reference=_reference(sequence.compound),
        forces={each.measured.number: each.forces for each in struck},
        scatter={each.measured.number: each.scatter for each in struck if each.scatter is not None},
        suspended=next((_suspended(run_id, step, found) for step, found in every_set if step.beam == SUSPENDED), None),
        left_out=tuple(text for _, each in every_set for text in each.left_out),
        setup_version=run.setup_version,
    )


def with_free_beam(
    measurement: MeasuredArticle, catalogue: Catalogue, options: Options, progress: Progress = silent
) -> MeasuredArticle:
    """The measurement with the suspended test of the run `options.free_beam` in place of its own.

    Raises:
        StoreError: there is no such run.
        JointlabError: that run has none, or its beam is another one.
    """
    assert options.free_beam is not None
    run_id = options.free_beam
    lending = _own_measurement(catalogue, run_id, options, progress)
    if lending.suspended is None:
        raise JointlabError(f"run {run_id} has no hammer step on the suspended beam")
    ours, theirs = (each.article.beam.model_dump(include=set(DIMENSIONS)) for each in (measurement, lending))
    if ours != theirs:
        raise JointlabError(f"run {run_id} is on a beam of other dimensions: {theirs}, here {ours}")
    return replace(measurement, suspended=lending.suspended)


def _check_as_averaged(options: Options, what: str) -> None:
    if options.averages_otherwise:
        raise JointlabError(
            f"{what} holds accelerances, not blows; their estimator and window cannot be changed: leave out these "
            "options"
        )


@dataclass(frozen=True, eq=False)
class _Struck:
    """A set from raw blows, their forces and scatter, and the blows that were left out, with reasons."""

    measured: FrequencyResponseSet
    forces: tuple[PointForces, ...]
    scatter: Complex | None
    left_out: tuple[str, ...]


def _suspended(run_id: int, step: HammerStep, struck: _Struck) -> SuspendedTest:
    """The set on the beam in its cords, with cords and weight as the step states them."""
    cords, weight = step.suspension, step.weight
    return SuspendedTest(
        replace(responses_of(struck.measured), scatter=struck.scatter),
        BeamSuspension(cords.bounce, cords.bounce_standard_error, cords.positions, cords.loss_factor)
        if cords
        else None,
        Estimate(weight.mass, weight.standard_error) if weight else None,
        run_id,
    )


def _accelerances(
    catalogue: Catalogue, article: Article, blows: list[Blow], step: HammerStep, options: Options, advance: Advance
) -> _Struck:
    """One set from the raw blows of a hammer step, without those that contradict the others at their point."""
    response = StoredDof(article.accelerometer.node, article.accelerometer.direction)
    forces, accelerations, points, rate = [], [], [], 0.0
    left_out = list[str]()
    struck_at = dict[StoredDof, list[Blow]]()
    for blow in blows:  # in the order of striking: a point that was repeated comes back after others
        struck_at.setdefault(blow.point, []).append(blow)
    for point, struck in struck_at.items():
        force, acceleration, numbers = [], [], []
        for blow in struck:
            if blow.waveform is None:
                raise JointlabError(f"blow {blow.number} at {point} has no record; measure the point again")
            waveform = catalogue.waveforms.read(blow.waveform)
            force.append(waveform.value(step.hammer))
            acceleration.append(waveform.value(step.accelerometer))
            numbers.append(blow.number)
            rate = waveform.sample_rate
            advance(1)
        together = np.array(force), np.array(acceleration)
        reasons = inconsistent_blows(*together, rate, step.highest_frequency)
        counts = [reason is None for reason in reasons]
        forces.append(together[0][counts])
        accelerations.append(together[1][counts])
        points.append(point)
        left_out += [
            f"set {blows[0].set_number}, blow {number} at {point}: {reason}"
            for number, reason in zip(numbers, reasons, strict=True)
            if reason is not None
        ]
    computed = responses_from_blows(
        forces,
        accelerations,
        rate,
        dof(response),
        [dof(point) for point in points],
        step.highest_frequency,
        options.estimator,
        pre_trigger=round(step.pretrigger_seconds * rate),
        windows=Windows(options.force_window, options.window.decay),
    )
    peaks = [blow.peak_force for blow in blows if blow.peak_force is not None]
    temperatures = [blow.temperature_c for blow in blows if blow.temperature_c is not None]
    measured = FrequencyResponseSet(
        number=blows[0].set_number,
        response=response,
        inputs=tuple(points),
        frequency=computed.frequency,
        accelerance=computed.accelerance,
        coherence=computed.coherence,
        variance=computed.variance,
        averages=min(map(len, forces)),
        peak_force=float(np.mean(peaks)),
        temperature_c=float(np.mean(temperatures)),
        window=str(options.window),
        sample_rate=rate,
        block_seconds=step.block_seconds,
        estimator=options.estimator.value,
    )
    records = tuple(PointForces(dof(point), force, rate) for point, force in zip(points, forces, strict=True))
    return _Struck(measured, records, computed.scatter, tuple(left_out))


def _calibration(
    catalogue: Catalogue, records: list[SineRecord], sequence: RigSequence, progress: Progress
) -> tuple[CalibrationRun, ...]:
    """Sine points on known pieces, each with its properties in the sequence."""
    if not records:
        return ()
    points = _sine_points(catalogue, records, sequence, progress)
    runs = []
    for step, _ in sequence.sine_steps:
        if isinstance(step, BlankStep):
            piece = KnownSpecimen(
                math.inf if step.stiffness is None else step.stiffness, step.mass, step.stiffness_standard_error
            )
            runs.append(CalibrationRun(piece, tuple(p.result for p in points if p.specimen == step.piece)))
    return tuple(run for run in runs if run.points)


def _reference(compound: Compound | None) -> ReferenceTemperature | None:
    if compound is None:
        return None
    return ReferenceTemperature(
        compound.reference_celsius,
        TemperatureCoefficients(
            stiffness=Estimate(compound.stiffness_per_kelvin, compound.stiffness_per_kelvin_error),
            loss_factor=Estimate(compound.loss_factor_per_kelvin, compound.loss_factor_per_kelvin_error),
            source="compound",
        ),
        compound.thermometer_error,
    )


def _sine_points(
    catalogue: Catalogue, records: list[SineRecord], sequence: RigSequence, progress: Progress
) -> tuple[IdentifiedSinePoint, ...]:
    """k, h and gamma of every sine record, with what the mains adds to those at its multiples.

    If the sequence states the mains frequency, only points at its multiples get a remark that their hum is not known.
    """
    points, durations, beside = [], [], []
    with progress("dynamic stiffness", len(records)) as advance:
        for record in records:
            where = (
                f"{record.specimen}, {record.configuration}, {record.commanded_pp_mm:g} mm, {record.frequency:g} Hz "
                f"(sine record {record.order_number})"
            )
            if record.waveform is None:
                raise JointlabError(f"{where}: there is no record of it; measure the point again")
            waveform = catalogue.waveforms.read(record.waveform)
            signals, rate = np.stack([waveform.value(DISPLACEMENT), waveform.value(FORCE)]), waveform.sample_rate
            try:
                tones = () if record.driven_frequency is None else mains_beside(record.driven_frequency)
                result = dynamic_stiffness(signals[0], signals[1], rate, record.true_frequency, tones=tones)
            except AnalysisError as error:
                raise AnalysisError(f"{where}: {error}") from error
            points.append(
                IdentifiedSinePoint(
                    specimen=record.specimen,
                    configuration=record.configuration,
                    amplitude_pp_mm=record.commanded_pp_mm,
                    frequency=record.frequency,
                    result=result,
                    order_number=record.order_number,
                    elapsed=record.elapsed,
                    temperature_c=record.temperature_c,
                    sine_record_id=record.id,
                )
            )
            durations.append(signals.shape[1] / rate)
            beside.append(tones_beside(signals, rate, record.true_frequency))
            advance(1)
    mains = {mains_beside(record.driven_frequency)[0] for record in records if record.driven_frequency} or MAINS
    hum = {tone: found for tone, found in hum_of(beside).items() if any(tone % each == 0 for each in mains)}
    stated = {float(step.mains_frequency) for step, _ in sequence.sine_steps if step.mains_frequency} or MAINS
    return tuple(
        point if record.driven_frequency else replace(point, result=with_hum(point.result, duration, hum, stated))
        for record, point, duration in zip(records, points, durations, strict=True)
    )
