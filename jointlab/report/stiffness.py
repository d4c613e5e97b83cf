"""The fitted law at one amplitude and frequency, as a section: each specimen, and the range of another one."""

from analysis.direct.specimen_scatter import Scatter, SpecimenScatter
from analysis.interval import Estimate
from jointlab.identification.law import StiffnessAt
from jointlab.report.section import Item, Notice, Section, Table, ends, number

KILO = 1e3


def stiffness_section(found: StiffnessAt) -> Section:
    """k and h in kN/m, and gamma, with 95 % intervals."""
    content: list[Item] = [
        "k and h are in kN/m; a is the shear, b the compressive stiffness of one cylinder, k11, k22, k12 are of the "
        "joint.",
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
            *_value_and_ends(term.stiffness_estimate, KILO),
            *_value_and_ends(term.damping_estimate, KILO),
            *_value_and_ends(term.loss_factor_estimate),
        )
        for each in found.specimens
        for name, term in each.terms.items()
    ]
    return Table("By specimen", ("joint", "term", "k", "95 %", "h", "95 %", "γ", "95 %"), tuple(rows))


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
