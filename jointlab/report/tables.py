"""Tables of stored results: terminal, report and page show the same ones."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from analysis.comparison import unit_factors
from analysis.frequency_response import Real
from jointlab.identification.undetermined_text import INTERVAL_WIDER_THAN_VALUE
from jointlab.report.curves import JointsByMethod
from jointlab.report.section import NO_BREAK, Cell, Notice, Table, Unknown, ends, number, with_ends
from jointlab.report.typography import with_signs
from store.results.comparisons import Comparison
from store.results.joint_matrices import JointMatrix
from store.results.modes import ModeSet

AXES = ("x", "y", "rotation")
UNITS = (("MN/m", "MN/m", "kN"), ("MN/m", "MN/m", "kN"), ("kN", "kN", "N m"))
SCALES = {"MN/m": 1e6, "kN": 1e3, "N m": 1.0, "": 1.0}
NOT_OBSERVABLE = "not observable"  # of results that older versions stored without a reason
NEAR_ZERO = "k is near zero"
VERDICTS = {"agree": "✓ agree", "differ": "✗ differ"}
TRANSLATIONS = ((0, 0), (0, 1), (1, 1))
"""Places of k11, k12 and k22."""
FOLLOWED = ((0, 1), (1, 1))
"""Places of the terms that are shown over frequency."""
LAWS = {"power": "a power law", "zener": "a fractional Zener law"}
READING = (
    f"Rows and columns are {', '.join(AXES)} at the joint's node, with 95 % intervals. Greyed elements are not "
    "observable, each for the reason that stands under it."
)


def modes_table(modes: ModeSet, fit: Mapping[str, float] | None = None) -> Table:
    """Frequencies and loss factors with 95 % intervals, and the predicted frequencies where there are any.

    Args:
        fit: `ModalEstimate.quality`, which the caption tells; modes that older versions stored have none.
    """
    known = modes.predicted_frequency
    predicted = known if known is not None and not np.isnan(known).all() else None
    no_interval = np.full((modes.frequency.size, 2), np.nan)
    frequency_ci95 = no_interval if modes.frequency_ci95 is None else modes.frequency_ci95
    loss_factor_ci95 = no_interval if modes.loss_factor_ci95 is None else modes.loss_factor_ci95
    rows = tuple(
        (
            str(mode + 1),
            number(modes.frequency[mode], 6),
            ends(frequency_ci95[mode], 6),
            *(() if predicted is None else (number(predicted[mode], 6),)),
            number(modes.loss_factor[mode], 4),
            ends(loss_factor_ci95[mode], 4),
        )
        for mode in range(modes.frequency.size)
    )
    middle = () if predicted is None else ("predicted (Hz)",)
    caption = "Modes" if fit is None else f"Modes, {_fit_words(fit)}"
    return Table(caption, ("mode", "frequency (Hz)", "95 %", *middle, "loss factor", "95 %"), rows)


def _fit_words(fit: Mapping[str, float]) -> str:
    return (
        f"which explain {number(100 * fit['explained'], 4)} % of the measured energy and leave "
        f"{number(fit['residual_over_noise'])} times the noise"
    )


def translations_table(joints: JointsByMethod) -> Table:
    """k11, k12 and k22 of every joint: k and h by the first method, and k by the others."""
    first, *others = joints
    rows = []
    for name, joint in joints[first].items():
        for at in TRANSLATIONS:
            element = f"{at[0] + 1}{at[1] + 1}"
            rows.append(
                (
                    name,
                    element if joint.observable[at] else Unknown(element, NOT_OBSERVABLE),
                    number(joint.stiffness[at] / 1e6, 4),
                    ends(joint.stiffness_ci95[at] / 1e6, 4),
                    number(joint.damping[at] / 1e6),
                    ends(joint.damping_ci95[at] / 1e6),
                    *(ends(joints[other][name].stiffness_ci95[at] / 1e6, 4) for other in others),
                )
            )
    head = ("joint", "element", "k (MN/m)", "95 %", "h (MN/m)", "95 %")
    return Table(f"Joints by {first}", (*head, *(f"k by the {other}, 95 %" for other in others)), tuple(rows))


def over_frequency_tables(joints: Mapping[str, Mapping[str, Any]]) -> list[Table]:
    """k12, k22 and their loss factors against frequency, a table for each joint, from `over_frequency`."""
    return [_over_frequency(name, found) for name, found in joints.items()]


def _over_frequency(name: str, found: Mapping[str, Any]) -> Table:
    def cell(row: int, field: str, at: tuple[int, int], scale: float = 1.0) -> Cell:
        value, interval = (np.array(found[each][row], dtype=float)[at] for each in (field, f"{field}_ci95"))
        text = f"{number(float(value) / scale, 4)} [{ends(interval / scale, 4)}]"
        return text if found["observable"][row][at[0]][at[1]] else Unknown(text, NOT_OBSERVABLE)

    rows = tuple(
        (number(frequency), *(cell(row, "k", at, 1e6) for at in FOLLOWED), *(cell(row, "gamma", at) for at in FOLLOWED))
        for row, frequency in enumerate(found["frequency_hz"])
    )
    head = ("Hz", "k12 (MN/m), 95 %", "k22 (MN/m), 95 %", "γ12, 95 %", "γ22, 95 %")
    return Table(f"Joint {name} over frequency, {LAWS[found['law']]}", head, rows)


def matrix_tables(joint: JointMatrix, method: str, reasons: Mapping[str, str]) -> tuple[Table, Table, Table]:
    """k, h and gamma of one joint in SI units.

    Args:
        reasons: by term, such as "k11", why it is not observable.
    """
    where = f"joint {joint.joint}, node {joint.node}, {method}"
    return (
        _matrix_table(f"k of {where}", joint, joint.stiffness, joint.stiffness_ci95, reasons),
        _matrix_table(f"h of {where}", joint, joint.damping, joint.damping_ci95, reasons),
        _matrix_table(f"γ of {where}", joint, joint.loss_factor, joint.loss_factor_ci95, reasons, is_ratio=True),
    )


def _matrix_table(
    caption: str, joint: JointMatrix, value: Real, interval: Real, reasons: Mapping[str, str], is_ratio: bool = False
) -> Table:
    def cell(row: int, column: int) -> Cell:
        unit = "" if is_ratio else UNITS[row][column]
        return term_cell(joint, value, interval, (row, column), unit, reasons)

    rows = tuple((AXES[row], *(cell(row, column) for column in range(3))) for row in range(3))
    return Table(caption, ("", *AXES), rows)


def term_cell(
    joint: JointMatrix,
    value: Real,
    interval: Real,
    at: tuple[int, int],
    unit: str,
    reasons: Mapping[str, str],
    *,
    with_unit: bool = True,
) -> Cell:
    """One term of a matrix of the joint with its 95 % interval, greyed where it is not to be quoted.

    Args:
        joint: that the term is of.
        value, interval: (3, 3) and (3, 3, 2), in SI units.
        at: row and column of the term.
        unit: one of `SCALES`.
        reasons: by term, such as "k11", why it is not observable.
        with_unit: whether the cell tells its unit.
    """
    why = reasons.get(f"k{at[0] + 1}{at[1] + 1}")
    if np.isnan(value[at]):
        return Unknown("–", why or NEAR_ZERO)
    text = with_ends(float(value[at]) / SCALES[unit], interval[at] / SCALES[unit])
    if unit and with_unit:
        text = f"{text}{NO_BREAK}{unit}"
    if joint.observable[at] and np.ptp(interval[at]) > abs(value[at]):
        return Unknown(text, INTERVAL_WIDER_THAN_VALUE)
    return text if joint.observable[at] else Unknown(text, why or NOT_OBSERVABLE)


def comparison_table(compared: Sequence[Comparison], *, reasons: bool = True) -> Table:
    """Both experiments element by element, with the verdict and, in a last column, its reason."""
    head = ("joint", "element", "inverse, 95 %", "direct, 95 %", "verdict", "why")
    shown = len(head) if reasons else len(head) - 1
    return Table("Element by element", head[:shown], tuple(_comparison_row(each)[:shown] for each in compared))


def unit_notices(compared: Sequence[Comparison]) -> list[Notice]:
    """One sentence where the stiffnesses of joints differ by a factor that a wrong unit makes; else none."""
    ratios = defaultdict[str, list[float]](list)
    for each in compared:
        if each.element.startswith("k") and each.inverse is not None and sum(each.direct) != 0:
            ratios[each.joint].append(sum(each.inverse) / sum(each.direct))
    by_factor = defaultdict[float, list[str]](list)
    for name, factor in unit_factors(ratios).items():
        by_factor[factor].append(name)
    return [
        Notice(
            f"The stiffness of joint {', '.join(names)} by the hammer is about {factor:g} times that by the tester: "
            "check the units of the tester's table and of the accelerances; kN for N or mm for m?"
        )
        for factor, names in by_factor.items()
    ]


def _comparison_row(each: Comparison) -> tuple[str, ...]:
    scale, unit = (1.0, "") if each.element.startswith("gamma") else (1e6, f"{NO_BREAK}MN/m")
    inverse, direct = (
        "–" if interval is None else f"{ends([end / scale for end in interval])}{unit}"
        for interval in (each.inverse, each.direct)
    )
    return (
        each.joint,
        each.element,
        inverse,
        direct,
        VERDICTS.get(each.verdict, each.verdict),
        with_signs(each.reason or ""),
    )
