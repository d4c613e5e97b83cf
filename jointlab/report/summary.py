"""Sections without pictures: all that the terminal shows of an identification, and parts of the report."""

from collections.abc import Mapping, Sequence

from analysis.interval import Estimate
from analysis.joint_amplitude import JointAmplitude
from analysis.suspended.beam_update import PARAMETERS
from jointlab.identification.direct import Direct
from jointlab.identification.direct_notices import direct_notices
from jointlab.identification.inverse import Inverse
from jointlab.identification.levels import Level, Levels
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.over_frequency import over_frequency
from jointlab.identification.pipeline import Identification
from jointlab.identification.save import mode_set, stored_comparison
from jointlab.identification.statements import fit_statements, regularisation_statements
from jointlab.identification.suspended import SuspendedBeam
from jointlab.identification.tester_corrections import TesterCorrections
from jointlab.identification.undetermined_text import remedy_text
from jointlab.identification.validity_text import check_text
from jointlab.report.curves import ELEMENTS, joints_by_method
from jointlab.report.section import Item, Notice, Section, Table, ends, number
from jointlab.report.tables import (
    comparison_table,
    modes_table,
    over_frequency_tables,
    translations_table,
    unit_notices,
)
from jointlab.report.typography import with_signs

UNITS = {"youngs_modulus": "Pa", "density": "kg/m³", "length": "m", "height": "m", "width": "m"}
DO_NOT_RELY = "Do not rely on these joints."
NEXT_STEP = "A diagnosis (`jointlab gap diagnose`) looks for the cause."
"""Advice if the fit of an identification fails a check."""


def summary_sections(found: Identification) -> list[Section]:
    """An identification on a screen or two."""
    sections = [] if found.suspended is None else [suspended_section(found.suspended)]
    if found.inverse is not None:
        modes = modes_table(mode_set(found.inverse.modal, found.inverse.likelihood.errors), found.inverse.modal.quality)
        sections.append(Section("Modes of the supported beam", (*fault_notices(found.measurement), modes)))
        sections.append(_joints(found.inverse))
    elif found.inverse_left_out:
        sections.append(inverse_left_out_section(found))
    if found.levels.found:
        content: list[Item] = [levels_table(found.levels.found), *levels_left_out(found.levels)]
        sections.append(Section("Levels of excitation", tuple(content)))
    if found.direct:
        sections += [corrections_section(found.corrections), _direct(found.direct)]
    if found.comparison:
        compared = [stored_comparison(each) for each in found.comparison]
        table = comparison_table(compared, reasons=False)
        sections.append(Section("Direct against inverse", (*unit_notices(compared), table)))
    elif found.not_compared:
        sections.append(Section("Direct against inverse", (not_compared(found.not_compared),)))
    return sections


def inverse_left_out_section(found: Identification) -> Section:
    """In place of modes and joints, why there are none although the hammer struck."""
    content = (*fault_notices(found.measurement), no_joints(found.inverse_left_out))
    return Section("Modes of the supported beam", content)


def no_joints(reason: str) -> Notice:
    """Why the hammer gives no joints."""
    return Notice(f"No joints from the hammer: {with_signs(reason)}.", failed=True)


def not_compared(reason: str) -> Notice:
    """Why there is no comparison although both experiments were made."""
    return Notice(f"Not compared: {with_signs(reason)}.")


def fault_notices(measurement: MeasuredArticle) -> list[Notice]:
    """Faults of the measurement that were corrected, and blows that are in no average."""
    return [
        *(Notice(f"Found wrong: {text}.") for text in measurement.faults),
        *(Notice(f"In no average: {text}.") for text in measurement.left_out),
    ]


def _joints(inverse: Inverse) -> Section:
    content: list[Item] = [translations_table(joints_by_method(inverse)), *fit_statements(inverse.fit)]
    content += over_frequency_tables(over_frequency(inverse))
    if inverse.paper_left_out:
        content.append(f"{inverse.paper_left_out}.")
    return Section("Joints", (*content, *regularisation_notices(inverse), *failed_checks(inverse), *remedies(inverse)))


def regularisation_notices(inverse: Inverse) -> list[Notice]:
    """The prior of the terms and its effect; empty where they were free."""
    if inverse.regularised is None:
        return []
    return [Notice(f"{text}.") for text in regularisation_statements(inverse.fit, inverse.regularised)]


def failed_checks(inverse: Inverse) -> list[Notice]:
    """The checks that the fit does not pass."""
    return [
        Notice(f"FAILED: {check.name}: {with_signs(check_text(check))}. {DO_NOT_RELY} {NEXT_STEP}", failed=True)
        for check in inverse.fit.all_checks
        if not check.passed
    ]


def remedies(inverse: Inverse) -> list[Table]:
    """Changes of the experiment that would repair its weakest direction; nothing where there is none."""
    if not inverse.remedies:
        return []
    title = "Remedies for the weakest direction of the stiffnesses (noise of the lines alone), the best first"
    return [Table(title, ("remedy",), tuple((with_signs(remedy_text(remedy)),) for remedy in inverse.remedies))]


def suspended_section(suspended: SuspendedBeam) -> Section:
    """Table 1, the beam after the update, and statements about both."""
    result = suspended.result
    modes = tuple(
        (
            str(row.mode),
            _interval(row.experiment, 6),
            number(row.timoshenko, 6),
            number(row.euler_bernoulli, 6),
            number(row.updated, 6),
            _interval(row.damping_ratio, 3),
        )
        for row in result.table
    )
    update = result.update
    beam = tuple(
        (
            name.replace("_", " ").replace("youngs", "Young's"),
            f"{number(getattr(update.drawn, name), 5)} {UNITS[name]}",
            f"{_interval(update.parameter(name), 5)} {UNITS[name]}",
        )
        for name in PARAMETERS
    )
    head = (
        "mode",
        "measured, 95 % (Hz)",
        "Timoshenko (Hz)",
        "Euler-Bernoulli (Hz)",
        "updated (Hz)",
        "damping ratio, 95 %",
    )
    return Section(
        "The beam without joints",
        (
            Table("Table 1: the suspended beam, the cords taken out", head, modes),
            Table("The beam after the update", ("", "as drawn", "updated, 95 %"), beam),
            *(f"{with_signs(text)}." for text in result.statements),
        ),
    )


def levels_left_out(levels: Levels) -> list[Notice]:
    """Sets that tell no joints, with the reason."""
    return [Notice(f"Left out: {with_signs(text)}.") for text in levels.left_out]


def levels_table(levels: Sequence[Level]) -> Table:
    """Each set's joints at the amplitude that its blows or its sine caused."""
    head = (
        "set",
        "peak force (N)",
        "joint",
        "amplitude (µm p-p), 95 %",
        "k22 (MN/m), 95 %",
        "k12 (MN/m), 95 %",
        "γ22",
    )
    rows = tuple(
        (
            str(level.number),
            number(level.peak_force),
            name,
            _amplitude(level.amplitudes.get(name)),
            *(ends(joint.k_ci95[at] / 1e6, 4) for _, at in ELEMENTS),
            ends(joint.loss_factor_ci95[1, 1]),
        )
        for level in levels
        for name, joint in level.fit.joints.items()
    )
    return Table("Joints against amplitude", head, rows)


def corrections_section(corrections: TesterCorrections) -> Section:
    """Effects of the tester on sine points, and what was corrected."""
    content: list[Item] = []
    calibration = corrections.calibration
    if calibration is None:
        content.append(
            "No known piece was measured in this tester: frame, fixture and channels are taken to be rigid, massless "
            "and on time."
        )
    else:
        content.append(
            f"Known pieces in place of specimens were measured; chi-square is {number(calibration.chi_square)} on "
            f"{calibration.degrees_of_freedom} degrees of freedom."
        )
        content += [Notice(f"{warning}.") for warning in calibration.warnings]
    if corrections.applied:
        rows = tuple(
            (each.effect.replace("_", " "), each.parameter, f"{each.value:.4g} ± {each.standard_error:.2g} {each.unit}")
            for each in corrections.applied
        )
        content.append(Table("Applied to every sine point", ("correction", "symbol", "value, standard error"), rows))
    if corrections.switched_off:
        names = ", ".join(name.replace("_", " ") for name in corrections.switched_off)
        content.append(f"Switched off by hand: {names}.")
    return Section("Corrections of the tester", tuple(content))


def superposition_texts(direct: Direct) -> list[str]:
    """The check of Fig. 12 by amplitude, one sentence each."""
    return [f"{amplitude:g} mm: {check.text}." for amplitude, check in direct.superposition.items()]


def tester_notices(name: str, direct: Direct) -> list[Notice]:
    """What speaks against the points of joint `name`, such as a loss below zero."""
    return [Notice(with_signs(text), failed=direct.contradicted) for text in direct_notices(name, direct)]


def _direct(direct: Mapping[str, Direct]) -> Section:
    content: list[Item] = []
    for name, own in direct.items():
        count = sum(len(points) for by_amplitude in own.series.values() for points in by_amplitude.values())
        content += [f"Joint {name}: {count} sine points.", *tester_notices(name, own)]
        content += superposition_texts(own)
    return Section("Direct method", tuple(content))


def _amplitude(amplitude: JointAmplitude | None) -> str:
    if amplitude is None:
        return "–"
    value, interval = number(1e6 * float(amplitude.amplitude_pp[0])), amplitude.ci95
    return value if interval is None else f"{value} ({ends(1e6 * interval[0])})"


def _interval(estimate: Estimate | None, digits: int) -> str:
    return "–" if estimate is None else ends(estimate.interval(), digits)
