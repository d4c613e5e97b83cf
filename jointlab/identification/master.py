"""The master curve of a specimen, from the sine points of all of its runs in the catalogue."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.direct.master_curve import MasterCurve, MasterPoint, Range
from analysis.direct.master_fit import fit_master_curve
from analysis.direct.time_temperature import ShiftLaw
from analysis.inverse.frequency_law import FrequencyLaw
from jointlab.errors import JointlabError
from jointlab.identification.inverse import LIKELIHOOD
from jointlab.identification.law import points_of_run
from jointlab.identification.read import newest_joints
from jointlab.identification.save import OVER_FREQUENCY
from jointlab.identification.sine_points import IdentifiedSinePoint, sine_point
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.measurements.runs import list_runs
from store.results.dynamic_stiffness import list_dynamic_stiffness
from store.results.specimen_history import runs_of_specimen

ANGLED, UPRIGHT_TERM = "angled", 1
"""The configuration that measures a + b, which is k22 of a joint of cylinders at 45 degrees: its row and column."""


@dataclass(frozen=True)
class SweptPoint:
    """A sine point of a specimen with the run that it is from."""

    run: int
    point: IdentifiedSinePoint


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
        specimen, configuration, amplitude_pp_mm: of all points.
        swept: the points, each with a temperature.
        curve: through them.
        asked: predictions.
        hammer: k22 of the same joint by the hammer at the frequencies asked for; of the angled configuration alone.
        without_temperature: number of points that were left out, as no temperature was recorded.
    """

    specimen: str
    configuration: str
    amplitude_pp_mm: float
    swept: tuple[SweptPoint, ...]
    curve: MasterCurve
    asked: tuple[MasterPoint, ...]
    hammer: tuple[HammerStiffness, ...]
    without_temperature: int


@dataclass(frozen=True)
class MasterQuestion:
    """What is asked of a specimen.

    Attributes:
        article, specimen: as in the catalogue.
        configuration, amplitude_pp_mm: of the points; where None, that of most points.
        frequencies: Hz.
        temperature: degrees Celsius; the law refers to `reference`.
        shift, constants, vertical: see `fit_master_curve`.
    """

    article: str
    specimen: str
    frequencies: tuple[float, ...]
    temperature: float
    reference: float
    configuration: str | None = None
    amplitude_pp_mm: float | None = None
    shift: ShiftLaw = ShiftLaw.WLF
    constants: tuple[float, float] | None = None
    vertical: bool = True


def specimen_master(catalogue: Catalogue, question: MasterQuestion) -> SpecimenMaster:
    """Fit the curve to the newest points of each run, and ask it.

    Raises:
        JointlabError: there are no such points, or none has a temperature.
        AnalysisError: what `fit_master_curve` and `MasterCurve.at` raise.
    """
    found = _chosen(_points(catalogue, question.article, question.specimen), question)
    warm = tuple(each for each in found if each.point.temperature_c is not None)
    first = found[0].point
    if not warm:
        raise JointlabError(
            f"{question.article}, {question.specimen}: no point has a temperature; connect a thermometer"
        )
    curve = fit_master_curve(
        [each.point.result for each in warm],
        [each.point.temperature_c for each in warm if each.point.temperature_c is not None],
        question.shift,
        question.reference,
        question.constants,
        question.vertical,
    )
    return SpecimenMaster(
        specimen=question.specimen,
        configuration=first.configuration,
        amplitude_pp_mm=first.amplitude_pp_mm,
        swept=warm,
        curve=curve,
        asked=tuple(curve.at(frequency, question.temperature) for frequency in question.frequencies),
        hammer=tuple(_hammer(catalogue, question)) if first.configuration == ANGLED else (),
        without_temperature=len(found) - len(warm),
    )


def _points(catalogue: Catalogue, article: str, specimen: str) -> list[SweptPoint]:
    found = []
    for run in catalogue.read(runs_of_specimen, article, specimen):
        stored = catalogue.read(list_dynamic_stiffness, points_of_run(catalogue, run))
        found += [SweptPoint(run, sine_point(each)) for each in stored if each.specimen == specimen]
    return found


def _chosen(points: Sequence[SweptPoint], question: MasterQuestion) -> list[SweptPoint]:
    """The points of one configuration and amplitude: those asked for, or else those of most points."""
    wanted = (question.configuration, question.amplitude_pp_mm)
    series = Counter((each.point.configuration, each.point.amplitude_pp_mm) for each in points)
    fitting = [key for key in series if all(w in (None, k) for w, k in zip(wanted, key, strict=True))]
    if not fitting:
        known = "; ".join(f"{name}, {amplitude:g} mm p-p" for name, amplitude in sorted(series)) or "nothing"
        raise JointlabError(
            f"{question.article}, {question.specimen}: no sine points as asked for; there are: {known}. Identify the "
            "runs of the tester first: jointlab identify RUN"
        )
    most = max(fitting, key=lambda key: series[key])
    return [each for each in points if (each.point.configuration, each.point.amplitude_pp_mm) == most]


def _hammer(catalogue: Catalogue, question: MasterQuestion) -> list[HammerStiffness]:
    """The newest k22 of the joint by maximum likelihood whose checks passed; empty where no run has one."""
    for run in catalogue.read(list_runs, article=question.article):
        try:
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


def _followed(stored: Mapping[str, Any], frequency: float) -> Range | None:
    """k22 of a joint that follows frequency, between the stored frequencies; None outside of them."""
    known = np.array(stored["frequency_hz"])
    if not known[0] <= frequency <= known[-1]:
        return None
    value = np.array([each[UPRIGHT_TERM][UPRIGHT_TERM] for each in stored["k"]], dtype=np.float64)
    ends = np.array([each[UPRIGHT_TERM][UPRIGHT_TERM] for each in stored["k_ci95"]], dtype=np.float64)
    columns = (value, ends[:, 0], ends[:, 1])
    return Range(*(float(np.interp(np.log(frequency), np.log(known), each)) for each in columns))
