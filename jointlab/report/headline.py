"""The results of a run in short: each joint by hammer test and tester, what disagrees, and the verdict on the gap."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from analysis.direct.cylinder_terms import JointTerms
from jointlab.diagnosis import wording
from jointlab.diagnosis.document import probability
from jointlab.identification.direct import Direct
from jointlab.identification.inverse import LIKELIHOOD
from jointlab.identification.read import newest_joints, read_direct, why_not_compared
from jointlab.report.section import NO_BREAK, Cell, Table, Unknown, with_ends
from jointlab.report.tables import SCALES, TRANSLATIONS, VERDICTS, term_cell
from jointlab.report.typography import with_signs
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.measurements.runs import Run
from store.results.analyses import latest_analysis
from store.results.comparisons import Comparison, list_comparisons
from store.results.diagnoses import StoredDiagnosis, get_diagnosis, list_diagnoses
from store.results.joint_matrices import JointMatrix
from store.states import AnalysisKind

Bounds = tuple[float, float, float]
"""A value, and both ends of its 95 % interval."""
TermsAt = tuple[float, JointTerms]
"""A commanded amplitude, mm peak to peak, and the terms that were measured there."""
UNMEASURED = Unknown("–", "compression, shear and angled are needed")
SIGNS = {verdict: words[0] for verdict, words in VERDICTS.items()}
QUANTITIES = (("k", "k", "MN/m"), ("h", "h", "MN/m"), ("gamma", "γ", ""))
"""Each with its symbol and its unit."""


@dataclass(frozen=True, eq=False)
class Headline:
    """The newest results of a run, as far as there are any.

    Attributes:
        inverse: joints by maximum likelihood from the hammer, by name.
        failed: whether their fit does not pass its checks, so that nobody should rely on them.
        direct: by joint, the smallest commanded amplitude (mm peak to peak) and the tester's terms there, in the middle
            of its frequencies.
        compared: both experiments, element by element.
        not_compared: why they are not compared although both were made, a phrase; empty where nothing forbids it.
        diagnosis: the newest one of this run alone, or None.
    """

    inverse: Mapping[str, JointMatrix]
    failed: bool
    direct: Mapping[str, TermsAt]
    compared: Sequence[Comparison]
    not_compared: str
    diagnosis: StoredDiagnosis | None

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints that one of the experiments knows."""
        return tuple(dict.fromkeys((*self.inverse, *self.direct)))


def read_headline(catalogue: Catalogue, run: Run) -> Headline:
    """Read the newest results of a run in short."""
    try:
        analysis, inverse = newest_joints(catalogue, run)[LIKELIHOOD]
        failed = not analysis.settings.get("passed", True)
    except (NotFoundError, KeyError):
        inverse, failed = {}, False
    try:
        direct = read_direct(catalogue, run)
    except NotFoundError:
        direct = {}
    with catalogue.reading() as session:
        why = why_not_compared(session, run.id)
        newest = list_diagnoses(session, run_id=run.id, alone=True, limit=1)
        diagnosis = get_diagnosis(session, newest[0].analysis_id) if newest else None
        compared: list[Comparison] = []
        if not why:  # an older comparison is not of these joints
            try:
                latest = latest_analysis(session, run.id, AnalysisKind.COMPARISONS)
                compared = list_comparisons(session, latest.id)
            except NotFoundError:
                compared = []
    return Headline(inverse, failed, tester_terms(direct), compared, why, diagnosis)


def tester_terms(direct: Mapping[str, Direct]) -> dict[str, TermsAt]:
    """By joint, its terms at the smallest amplitude of the tester, at the frequency in the middle of those measured."""
    smallest = {name: min(found.joint.items()) for name, found in direct.items() if found.joint}
    return {name: (amplitude, terms[(len(terms) - 1) // 2]) for name, (amplitude, terms) in smallest.items() if terms}


def joint_table(found: Headline, name: str) -> Table:
    """k, h and gamma of one joint by both experiments, with 95 % intervals, and the sign of the verdict."""
    matrix = found.inverse.get(name)
    own = {each.element: each for each in found.compared if each.joint == name}
    values, condition = _compared_values(own) if own else _measured_values(found.direct.get(name))
    rows = []
    for quantity, symbol, unit in QUANTITIES:
        for at in TRANSLATIONS:
            element = f"{quantity}{at[0] + 1}{at[1] + 1}"
            sign = SIGNS.get(own[element].verdict, "") if element in own else ""
            tester: Cell = UNMEASURED
            if element in values:
                value, low, high = (each / SCALES[unit] for each in values[element])
                tester = f"{sign}{NO_BREAK if sign else ''}{with_ends(value, (low, high))}"
            title = f"{symbol}{element[-2:]}{f' ({unit})' if unit else ''}"
            hammer = "–" if matrix is None else _by_hammer(matrix, quantity, at, unit)
            rows.append((title, _breaking(hammer), _breaking(tester)))
    return Table(f"Joint {name}{condition}", ("", "hammer test", "tester"), tuple(rows))


def _breaking(cell: Cell) -> Cell:
    """The cell with an interval that may break behind its sign, as two of them stand beside each other on a phone."""
    match cell:
        case str():
            return cell.replace(f"…{NO_BREAK}", "… ")
        case Unknown(text, why):
            return Unknown(text.replace(f"…{NO_BREAK}", "… "), why)
        case _:
            return cell


def _compared_values(own: Mapping[str, Comparison]) -> tuple[dict[str, Bounds], str]:
    """The tester's values as they were compared, and at which amplitude; h is k times gamma."""
    values = {element: (sum(each.direct) / 2, *each.direct) for element, each in own.items()}
    for place in {element[-2:] for element in own}:
        if f"k{place}" in values and f"gamma{place}" in values:
            values[f"h{place}"] = _product(values[f"k{place}"], values[f"gamma{place}"])
    amplitude = next(iter(own.values())).amplitude_pp_mm
    return values, "" if amplitude is None else f"; tester carried to {amplitude:.2g} mm peak to peak"


def _product(one: Bounds, other: Bounds) -> Bounds:
    """The product of two values, between the smallest and the largest that their intervals allow."""
    ends = [a * b for a in one[1:] for b in other[1:]]
    return one[0] * other[0], min(ends), max(ends)


def _measured_values(measured: TermsAt | None) -> tuple[dict[str, Bounds], str]:
    """The tester's values as they were measured, and where."""
    if measured is None:
        return {}, ""
    amplitude, terms = measured
    values: dict[str, Bounds] = {}
    for place, point in (("11", terms.k11), ("12", terms.k12), ("22", terms.k22)):
        for quantity, estimate in (
            ("k", point.stiffness_estimate),
            ("h", point.damping_estimate),
            ("gamma", point.loss_factor_estimate),
        ):
            values[f"{quantity}{place}"] = (estimate.value, *estimate.interval())
    return values, f"; tester at {amplitude:.2g} mm peak to peak, {terms.frequency:.4g} Hz"


def _by_hammer(matrix: JointMatrix, quantity: str, at: tuple[int, int], unit: str) -> Cell:
    value, interval = {
        "k": (matrix.stiffness, matrix.stiffness_ci95),
        "h": (matrix.damping, matrix.damping_ci95),
        "gamma": (matrix.loss_factor, matrix.loss_factor_ci95),
    }[quantity]
    return term_cell(matrix, value, interval, at, unit, {}, with_unit=False)


def comparison_sentence(compared: Sequence[Comparison], not_compared: str) -> str:
    """Whether tester and hammer test agree, or why that is not known."""
    differ = [f"{each.element} of {each.joint}" for each in compared if each.verdict == "differ"]
    if differ:
        return (
            f"Tester and hammer test disagree in {len(differ)} of {len(compared)} compared quantities: "
            f"{', '.join(differ)}."
        )
    if compared:
        agree = sum(each.verdict == "agree" for each in compared)
        return f"Tester and hammer test agree in {agree} of {len(compared)} compared quantities; none differs."
    if not_compared:
        return f"Not compared: {with_signs(not_compared)}."
    return "Tester and hammer test are not compared: that takes both of them on every joint."


def gap_sentence(diagnosis: Mapping[str, Any] | None) -> str:
    """The verdict of a diagnosis, by its document, with its probability."""
    if diagnosis is None:
        return "The gap between simulation and measurement was not diagnosed."
    likely = wording.probability_text(probability(diagnosis))
    return f"Gap between simulation and measurement: {wording.verdict_sentence(diagnosis)}; probability {likely}."
