"""The fitted law at one amplitude and frequency, as a section: each specimen, and the range of another one."""

from analysis.direct.specimen_scatter import Scatter, SpecimenScatter
from analysis.interval import Estimate
from jointlab.identification.direct_notices import CONTRADICTED
from jointlab.identification.law import SpecimenAt, StiffnessAt
from jointlab.report.section import Cell, Item, Notice, Section, Table, Unknown, ends, number
from jointlab.report.typography import with_signs

KILO = 1e3


def stiffness_section(found: StiffnessAt) -> Section:
    """k and h in kN/m, and gamma, with 95 % intervals."""
    content: list[Item] = [
        "k and h are in kN/m; a is the shear, b the compressive stiffness of one cylinder, k11, k22, k12 are of the "
        "joint.",
        *(Notice(with_signs(text), failed=each.contradicted) for each in found.specimens for text in each.notices),
        _specimens(found),
        *(
            Notice(f"extrapolated, joint {each.specimen}: {phrase}.")
            for each in found.specimens
            for phrase in each.beyond
        ),
    ]
    content += _negative_loss(found)
    if found.scatter is None:
        content.append("One specimen alone does not show where another one of its kind lies.")
    else:
        content.append(_scatter(found.scatter))
    return Section(
        f"Stiffness at {1e3 * found.amplitude_pp:g} mm peak to peak and {found.frequency:g} Hz", tuple(content)
    )


def _negative_loss(found: StiffnessAt) -> list[Notice]:
    """The specimens whose loss factor lies below zero with its whole interval."""
    notices = []
    for each in found.specimens:
        below = [name for name, term in each.terms.items() if term.loss_factor_estimate.interval()[1] < 0]
        if below:
            notices.append(
                Notice(
                    f"joint {each.specimen}: γ of {', '.join(below)} is below zero, and no specimen feeds energy; "
                    "check the sign of the phase in the sine points: force leads displacement."
                )
            )
    return notices


def _specimens(found: StiffnessAt) -> Table:
    rows = [
        (
            each.specimen,
            name,
            *_cells(each, term.stiffness_estimate, KILO),
            *_cells(each, term.damping_estimate, KILO),
            *_cells(each, term.loss_factor_estimate),
        )
        for each in found.specimens
        for name, term in each.terms.items()
    ]
    return Table("By specimen", ("joint", "term", "k", "95 %", "h", "95 %", "γ", "95 %"), tuple(rows))


def _cells(specimen: SpecimenAt, estimate: Estimate, unit: float = 1.0) -> tuple[Cell, Cell]:
    """Value and interval; the interval is greyed where the configurations contradict each other."""
    value, interval = _value_and_ends(estimate, unit)
    return value, Unknown(interval, CONTRADICTED) if specimen.contradicted else interval


def _scatter(scatter: SpecimenScatter) -> Table:
    quantities: tuple[tuple[str, str, Scatter, float], ...] = (
        ("a", "k", scatter.shear, KILO),
        ("a", "h", scatter.shear_damping, KILO),
        ("a", "γ", scatter.shear_loss_factor, 1.0),
        ("b", "k", scatter.compression, KILO),
        ("b", "h", scatter.compression_damping, KILO),
        ("b", "γ", scatter.compression_loss_factor, 1.0),
    )
    rows = []
    for term, quantity, each, unit in quantities:
        mean, single = _value_and_ends(each.mean, unit)[0], _value_and_ends(each.next_specimen, unit)[1]
        rows.append((term, quantity, mean, number(each.deviation / unit), single))
    title = f"Where a single specimen lies, if {', '.join(scatter.specimens)} are of one kind"
    return Table(title, ("term", "", "mean", "between specimens", "a single one, 95 %"), tuple(rows))


def _value_and_ends(estimate: Estimate, unit: float = 1.0) -> tuple[str, str]:
    low, high = estimate.interval()
    return number(estimate.value / unit, 4), ends((low / unit, high / unit))
