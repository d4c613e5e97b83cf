"""The master curve of a specimen, from the sine points of its runs in the catalogue."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.direct.master_curve import MasterCurve, MasterPoint, Range
from analysis.direct.master_fit import APART, checked_shift, fit_master_curve, temperature_groups
from analysis.direct.temperature import EFFECT as TEMPERATURE_SHIFT
from analysis.errors import AnalysisError
from analysis.inverse.frequency_law import FrequencyLaw
from jointlab.documents.master import Cause, MasterQuestion, runs_text
from jointlab.errors import JointlabError
from jointlab.identification.inverse import LIKELIHOOD
from jointlab.identification.law import points_of_run
from jointlab.identification.read import article_of, newest_joints
from jointlab.identification.save import OVER_FREQUENCY
from jointlab.identification.sine_points import IdentifiedSinePoint, sine_point
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.exchange.bundle_setup import Article
from store.measurements.runs import Run, get_run, list_runs
from store.results.analyses import get_analysis
from store.results.dynamic_stiffness import list_dynamic_stiffness
from store.results.specimen_history import runs_of_specimen, unidentified_runs

ANGLED, UPRIGHT_TERM = "angled", 1
"""The configuration that measures a + b, and the index (row and column) of k22, which equals a + b at 45 degrees."""
OF_A_PAIR = 45.0
"""Inclination of the cylinders of an angled pair, degrees; k22 of a joint that is drawn otherwise is not a + b."""
Series = tuple[str, float]
"""Configuration, and amplitude in mm peak to peak."""


@dataclass(frozen=True)
class SweptPoint:
    """A sine point of a specimen, with the run and the analysis that it is from."""

    run: int
    analysis: int
    point: IdentifiedSinePoint

    @property
    def series(self) -> Series:
        """Configuration and commanded amplitude."""
        return self.point.configuration, self.point.amplitude_pp_mm


@dataclass(frozen=True)
class LeftOut:
    """Points of one series of the specimen that are not in its master curve."""

    cause: Cause
    series: Series
    points: tuple[SweptPoint, ...]

    @property
    def runs(self) -> list[int]:
        """Their runs."""
        return sorted({each.run for each in self.points})

    @property
    def temperatures(self) -> list[float]:
        """Mean temperatures of their sweeps, degrees Celsius."""
        return _sweep_temperatures(self.points)


@dataclass(frozen=True)
class SpecimenSweeps:
    """What a master curve of a specimen is made from.

    Attributes:
        swept: the points, of one series, each with a temperature.
        left_out: the specimen's other points.
        unidentified: runs with sine records of the specimen that were not identified.
    """

    swept: tuple[SweptPoint, ...]
    left_out: tuple[LeftOut, ...]
    unidentified: tuple[int, ...]

    @property
    def temperatures(self) -> list[float]:
        """Of each point, degrees Celsius."""
        return [each.point.temperature_c for each in self.swept if each.point.temperature_c is not None]


@dataclass(frozen=True)
class HammerStiffness:
    """k22 of the joint by the hammer at `frequency` Hz, N/m, with a 95 % interval; `law` of the joints there."""

    run: int
    frequency: float
    law: str
    stiffness: Range


@dataclass(frozen=True, eq=False)
class SpecimenMaster:
    """A specimen's master curve and what it was asked.

    Attributes:
        question: that is answered.
        sweeps: the points behind the curve.
        curve: through them.
        asked: predictions.
        hammer: k22 of the same joint by the hammer at the frequencies asked for; of the angled configuration alone.
    """

    question: MasterQuestion
    sweeps: SpecimenSweeps
    curve: MasterCurve
    asked: tuple[MasterPoint, ...]
    hammer: tuple[HammerStiffness, ...]


def specimen_master(catalogue: Catalogue, question: MasterQuestion) -> SpecimenMaster:
    """Fit the curve to the newest points of each run, and ask it.

    Raises:
        JointlabError, NotFoundError, AnalysisError: what `specimen_sweeps`, `fit_master_curve` and `MasterCurve.at`
            raise.
    """
    sweeps = specimen_sweeps(catalogue, question)
    curve = fit_master_curve(
        [each.point.result for each in sweeps.swept],
        sweeps.temperatures,
        question.shift,
        question.reference,
        question.constants,
        question.vertical_shift,
    )
    configuration, _ = sweeps.swept[0].series
    return SpecimenMaster(
        question=question,
        sweeps=sweeps,
        curve=curve,
        asked=tuple(curve.at(frequency, question.temperature_c) for frequency in question.frequencies),
        hammer=tuple(_hammer(catalogue, question)) if configuration == ANGLED else (),
    )


def specimen_sweeps(catalogue: Catalogue, question: MasterQuestion) -> SpecimenSweeps:
    """The points that a master curve is fitted to; all that can be known before the fit is checked.

    Raises:
        NotFoundError: there is no run that the question names.
        JointlabError: there are no such points, too few temperatures, or points that were corrected to one temperature;
            the message says what there is.
        AnalysisError: numbers do not belong together, or a stiffness is not positive.
    """
    with catalogue.reading() as session:
        for run in question.runs:
            get_run(session, run)
        waiting = tuple(unidentified_runs(session, question.article, question.specimen))
    every = specimen_points(catalogue, question.article, question.specimen)
    named = [each for each in every if not question.runs or each.run in question.runs]
    chosen = _chosen(every, named, waiting, question)
    swept = tuple(each for each in named if each.series == chosen and each.point.temperature_c is not None)
    found = SpecimenSweeps(swept, tuple(_left_out(every, named, chosen)), waiting)
    if not swept:
        raise JointlabError(
            f"{_about(question, chosen)}: no point has a temperature; connect a thermometer{_besides(found)}"
        )
    if moved := _at_reference_temperature(catalogue, swept):
        raise JointlabError(
            f"{_about(question, chosen)}: the points of {runs_text(moved)} were corrected to the reference temperature "
            "of their compound, but a master curve needs them at the temperatures of the sweeps. Identify again: "
            f"jointlab identify {moved[0]} --without {TEMPERATURE_SHIFT}"
        )
    try:
        checked_shift(
            [each.point.result for each in swept],
            found.temperatures,
            question.shift,
            question.reference,
            question.constants,
        )
    except AnalysisError as error:
        raise JointlabError(f"{_about(question, chosen)}: {error}{_besides(found)}") from error
    return found


def _at_reference_temperature(catalogue: Catalogue, swept: Sequence[SweptPoint]) -> list[int]:
    """Runs whose points are not at the temperature that they were measured at."""
    with catalogue.reading() as session:
        settings = {each.analysis: get_analysis(session, each.analysis).settings for each in swept}
    applied = {
        number: {correction["effect"] for correction in found.get("corrections", ())}
        for number, found in settings.items()
    }
    return sorted({each.run for each in swept if TEMPERATURE_SHIFT in applied[each.analysis]})


def specimen_points(catalogue: Catalogue, article: str, specimen: str) -> list[SweptPoint]:
    """The newest sine points of a specimen, run by run."""
    found = []
    for run in catalogue.read(runs_of_specimen, article, specimen):
        analysis = points_of_run(catalogue, run)
        stored = catalogue.read(list_dynamic_stiffness, analysis)
        found += [SweptPoint(run, analysis, sine_point(each)) for each in stored if each.specimen == specimen]
    return found


def offered_series(catalogue: Catalogue, article: str, specimen: str) -> dict[Series, list[float]]:
    """The series of a specimen, each with the mean temperatures of its sweeps in degrees Celsius.

    Those of most temperatures come first, then those of most points: of the first one a master curve says most.
    """
    found: dict[Series, list[SweptPoint]] = {}
    for each in specimen_points(catalogue, article, specimen):
        found.setdefault(each.series, []).append(each)
    temperatures = {series: _sweep_temperatures(points) for series, points in found.items()}
    order = sorted(found, key=lambda series: (-len(temperatures[series]), -len(found[series]), series))
    return {series: temperatures[series] for series in order}


def _chosen(
    every: Sequence[SweptPoint], named: Sequence[SweptPoint], waiting: Sequence[int], question: MasterQuestion
) -> Series:
    """The series that is asked for, or else the one of most points."""
    wanted = (question.configuration, question.amplitude_pp_mm)
    count = Counter(each.series for each in named)
    fitting = [key for key in count if all(w in (None, k) for w, k in zip(wanted, key, strict=True))]
    if not fitting:
        known = "; ".join(map(_series_text, sorted({each.series for each in every}))) or "nothing"
        runs = f" of {runs_text(question.runs)}" if question.runs else ""
        raise JointlabError(
            f"{question.article}, {question.specimen}: no sine points{runs} as asked for; there are: {known}"
            f"{_to_identify(waiting) or '. Identify the runs of the tester first: jointlab identify RUN'}"
        )
    return max(fitting, key=lambda key: count[key])


def _left_out(every: Sequence[SweptPoint], named: Sequence[SweptPoint], chosen: Series) -> list[LeftOut]:
    of_runs = {each.run for each in named}
    found: dict[tuple[Cause, Series], list[SweptPoint]] = {}
    for each in every:
        if each.run not in of_runs:
            cause = Cause.OTHER_RUN
        elif each.series != chosen:
            cause = Cause.OTHER_SERIES
        elif each.point.temperature_c is None:
            cause = Cause.NO_TEMPERATURE
        else:
            continue
        found.setdefault((cause, each.series), []).append(each)
    return [LeftOut(cause, series, tuple(points)) for (cause, series), points in sorted(found.items())]


def _sweep_temperatures(points: Sequence[SweptPoint]) -> list[float]:
    known = [each.point.temperature_c for each in points if each.point.temperature_c is not None]
    return temperature_groups(np.array(known)).tolist() if known else []


def _about(question: MasterQuestion, chosen: Series) -> str:
    return f"{question.article}, {question.specimen} in {_series_text(chosen)}"


def _series_text(series: Series) -> str:
    configuration, amplitude = series
    return f"{configuration}, {amplitude:g} mm p-p"


def _besides(found: SpecimenSweeps) -> str:
    """What else there is of the specimen, of which a master curve could be made."""
    said = []
    own = _sweep_temperatures(found.swept)
    for each in found.left_out:
        if own and each.temperatures and not _has_another(each.temperatures, own):
            continue
        at = ", ".join(f"{temperature:.1f}" for temperature in each.temperatures)
        where = f"{_series_text(each.series)}, {runs_text(each.runs)}"
        match each.cause:
            case Cause.NO_TEMPERATURE:
                said.append(f"{len(each.points)} points of {where} have no temperature")
            case Cause.OTHER_RUN:
                said.append(f"{where} at {at or 'no known'} degrees Celsius is not among the runs asked for")
            case Cause.OTHER_SERIES:
                said.append(f"{where} at {at or 'no known'} degrees Celsius is another series")
    others = f". A master curve is of one configuration and amplitude: {'; '.join(said)}" if said else ""
    return others + _to_identify(found.unidentified)


def _has_another(temperatures: Sequence[float], own: Sequence[float]) -> bool:
    """Whether one of the temperatures is none of `own`."""
    return any(min(abs(each - known) for known in own) > APART for each in temperatures)


def _to_identify(runs: Sequence[int]) -> str:
    if not runs:
        return ""
    verb = "is" if len(runs) == 1 else "are"
    return f". {runs_text(runs).capitalize()} {verb} not identified: jointlab identify {runs[0]}"


def _hammer(catalogue: Catalogue, question: MasterQuestion) -> list[HammerStiffness]:
    """The newest k22 by maximum likelihood whose checks passed, of a joint of cylinders at 45 degrees.

    It is empty where no run has one.
    """
    for run in every_run(catalogue, question.article):
        try:
            if not _is_drawn_as_a_pair(article_of(run), question.specimen):
                continue
            analysis, joints = newest_joints(catalogue, run).get(LIKELIHOOD, (None, {}))
        except NotFoundError:
            continue
        if analysis is not None and analysis.settings.get("passed") and question.specimen in joints:
            followed = (analysis.settings.get(OVER_FREQUENCY) or {}).get(question.specimen)
            each = joints[question.specimen]
            at = UPRIGHT_TERM, UPRIGHT_TERM
            low, high = each.stiffness_ci95[at].tolist()
            constant = Range(float(each.stiffness[at]), low, high)
            found = ((asked, _followed(followed, asked) if followed else constant) for asked in question.frequencies)
            law = str(followed["law"]) if followed else FrequencyLaw.CONSTANT.value
            return [HammerStiffness(run.id, asked, law, value) for asked, value in found if value is not None]
    return []


def every_run(catalogue: Catalogue, article: str) -> Iterator[Run]:
    """All runs of an article, the newest first."""
    before: int | None = None
    while page := catalogue.read(list_runs, article=article, before=before):
        yield from page
        before = page[-1].id


def _is_drawn_as_a_pair(article: Article, specimen: str) -> bool:
    own = (joint for joint in article.joints if joint.name == specimen)
    return any(all(abs(each) == OF_A_PAIR for each in joint.inclinations_deg) for joint in own)


def _followed(stored: Mapping[str, Any], frequency: float) -> Range | None:
    """k22 of a joint that follows frequency, between the stored frequencies; None outside of them."""
    known = np.array(stored["frequency_hz"])
    if not known[0] <= frequency <= known[-1]:
        return None
    value = np.array([each[UPRIGHT_TERM][UPRIGHT_TERM] for each in stored["k"]], dtype=np.float64)
    ends = np.array([each[UPRIGHT_TERM][UPRIGHT_TERM] for each in stored["k_ci95"]], dtype=np.float64)
    columns = (value, ends[:, 0], ends[:, 1])
    return Range(*(float(np.interp(np.log(frequency), np.log(known), each)) for each in columns))
