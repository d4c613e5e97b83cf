"""The first page of a report, a summary: what was measured, how, and the results."""

from collections.abc import Sequence

from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.interval import Estimate
from jointlab.identification.inverse import Inverse
from jointlab.identification.pipeline import Identification
from jointlab.identification.save import joint_matrix, stored_comparison
from jointlab.identification.undetermined_text import not_observable_text
from jointlab.report.facts import Facts
from jointlab.report.headline import comparison_sentence, gap_sentence
from jointlab.report.run_record import RunRecord
from jointlab.report.section import NO_BREAK, Item, Notice, Section, Table, with_ends
from jointlab.report.summary import failed_checks, no_joints
from jointlab.report.tables import TRANSLATIONS, comparison_table, term_cell, unit_notices
from store.instrument import Instrument

MEGA = 1e6
FACT_LABELS = {
    "article": "test article",
    "run": "run",
    "amended": "set-up",
    "beam": "beam",
    "specimens": "specimens",
    "dates": "measured",
    "operator": "by",
    "temperature": "temperature",
    "excitation": "hammer test",
    "sines": "tester",
    "amplitudes": "amplitudes",
    "preset": "preset",
    "examination": "rig examined",
}
"""Label of each fact on the first page, in their order there."""


def front_sections(found: Identification, facts: Facts, record: RunRecord | None) -> list[Section]:
    """What was measured, results, verdicts, instruments."""
    known = tuple((words, facts[name]) for name, words in FACT_LABELS.items() if name in facts)
    sections = [
        Section("What was measured", (Table("", (), known),)),
        Section("Results, with 95 % intervals", tuple(_results(found))),
        Section("Verdicts", tuple(_verdicts(found, record))),
    ]
    if record is not None and record.calibrated:
        sections.append(Section("Instruments", tuple(_instruments(record))))
    return sections


def _results(found: Identification) -> list[Item]:
    content: list[Item] = [Notice(f"Found wrong: {text}.") for text in found.measurement.faults]
    if found.inverse is not None:
        content += [*failed_checks(found.inverse), _joints(found.inverse)]
    elif found.inverse_left_out:
        content.append(no_joints(found.inverse_left_out))
    if found.direct:
        content.append(_cylinders(found))
    return content


def _joints(inverse: Inverse) -> Table:
    rows = []
    for name, joint in inverse.likelihood.joints.items():
        stored, reasons = joint_matrix(joint), not_observable_text(joint)
        for at in TRANSLATIONS:
            cells = (
                term_cell(stored, value, interval, at, unit, reasons)
                for value, interval, unit in (
                    (stored.stiffness, stored.stiffness_ci95, "MN/m"),
                    (stored.damping, stored.damping_ci95, "MN/m"),
                    (stored.loss_factor, stored.loss_factor_ci95, ""),
                )
            )
            rows.append((f"{name}, {at[0] + 1}{at[1] + 1}", *cells))
    return Table("Joints by the hammer test, maximum likelihood", ("joint, term", "k", "h", "γ (1)"), tuple(rows))


def _cylinders(found: Identification) -> Table:
    """The smallest and the largest amplitude of each series, at the frequency in its middle."""
    rows = []
    for name, direct in found.direct.items():
        for configuration, by_amplitude in direct.series.items():
            for amplitude in dict.fromkeys((max(by_amplitude), min(by_amplitude))):
                point = _middle(by_amplitude[amplitude])
                rows.append(
                    (
                        f"{name}, {configuration}",
                        f"{amplitude:g}{NO_BREAK}mm, {point.frequency:.4g}{NO_BREAK}Hz",
                        _value(point.stiffness_estimate, MEGA),
                        _value(point.damping_estimate, MEGA),
                        _value(point.loss_factor_estimate),
                    )
                )
    caption = "Cylinders in the tester, peak to peak, at the middle frequency of each series"
    return Table(caption, ("specimen", "at", "k (MN/m)", "h (MN/m)", "γ (1)"), tuple(rows))


def _middle(points: Sequence[DynamicStiffness]) -> DynamicStiffness:
    return points[(len(points) - 1) // 2]


def _value(estimate: Estimate, scale: float = 1.0) -> str:
    low, high = estimate.interval()
    return with_ends(estimate.value / scale, (low / scale, high / scale))


def _verdicts(found: Identification, record: RunRecord | None) -> list[Item]:
    compared = [stored_comparison(each) for each in found.comparison]
    differ = [each for each in compared if each.verdict == "differ"]
    said = comparison_sentence(compared, found.not_compared)
    content: list[Item] = [Notice(said) if found.not_compared else said]
    content += unit_notices(compared)
    if differ:
        content.append(comparison_table(differ, reasons=False))
    return [*content, gap_sentence(None if record is None else record.diagnosis)]


def _instruments(record: RunRecord) -> list[Item]:
    measured = record.run.started_at.date()
    over = [
        f"the calibration of {use} {each.serial} was valid until {each.due_on}, before the measurement"
        for use, each in record.calibrated
        if each.due_on is not None and each.due_on < measured
    ]
    models = dict[tuple[str, ...], list[str]]()  # instruments of one use that are calibrated alike share a row
    for use, each in record.calibrated:
        models.setdefault((use, *_calibration(each)), []).append(f"{each.model} {each.serial}")
    rows = tuple((use, ", ".join(names), *calibration) for (use, *calibration), names in models.items())
    head = ("used for", "model, serial number", "calibrated", "valid until", "certificate", "uncertainty, k = 2")
    return [*(Notice(f"{text}.") for text in over), Table("", head, rows)]


def _calibration(each: Instrument) -> tuple[str, str, str, str]:
    return (
        str(each.calibrated_on or "–"),
        str(each.due_on or "–"),
        each.certificate or "–",
        "–" if each.uncertainty is None else f"{100 * each.uncertainty:.2g} %",
    )
