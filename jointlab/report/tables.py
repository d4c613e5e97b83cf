"""Tables of stored results: terminal, report and page show the same ones."""

from collections.abc import Mapping, Sequence

import numpy as np

from analysis.frequency_response import Real
from analysis.inverse.joint_estimate import TOO_WIDE
from jointlab.report.curves import JointsByMethod
from jointlab.report.section import Cell, Table, Unknown, ends, number
from store.comparisons import Comparison
from store.joint_matrices import JointMatrix
from store.modes import ModeSet

AXES = ("x", "y", "rotation")
UNITS = (("MN/m", "MN/m", "kN"), ("MN/m", "MN/m", "kN"), ("kN", "kN", "N m"))
SCALES = {"MN/m": 1e6, "kN": 1e3, "N m": 1.0, "": 1.0}
NOT_OBSERVABLE = "not observable"  # of results that older versions stored without a reason
NEAR_ZERO = "k is near zero"
VERDICTS = {"agree": "✓ agree", "differ": "✗ differ"}
TRANSLATIONS = ((0, 0), (0, 1), (1, 1))
"""Places of k11, k12 and k22."""
READING = (
    f"Rows and columns are {', '.join(AXES)} at the joint's node, with 95 % intervals. Greyed elements are not "
    "observable, each for the reason that stands under it."
)


def modes_table(modes: ModeSet, fit: Mapping[str, float] | None = None) -> Table:
    """Frequencies and loss factors with 95 % intervals, and the predicted frequencies where there are any.

    Args:
        modes: what is shown.
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


def matrix_tables(joint: JointMatrix, method: str, reasons: Mapping[str, str]) -> tuple[Table, Table, Table]:
    """k, h and gamma of one joint in SI units.

    Args:
        joint: by one method.
        method: its name.
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
        at, why = (row, column), reasons.get(f"k{row + 1}{column + 1}")
        if np.isnan(value[at]):
            return Unknown("–", why or NEAR_ZERO)
        unit = "" if is_ratio else UNITS[row][column]
        scale = SCALES[unit]
        text = f"{number(float(value[at]) / scale)} [{ends(interval[at] / scale)}] {unit}".strip()
        if joint.observable[at] and np.ptp(interval[at]) > abs(value[at]):
            return Unknown(text, TOO_WIDE)
        return text if joint.observable[at] else Unknown(text, why or NOT_OBSERVABLE)

    rows = tuple((AXES[row], *(cell(row, column) for column in range(3))) for row in range(3))
    return Table(caption, ("", *AXES), rows)


def comparison_table(compared: Sequence[Comparison], *, reasons: bool = True) -> Table:
    """Both experiments element by element, with the verdict and, in a last column, its reason."""
    head = ("joint", "element", "inverse, 95 %", "direct, 95 %", "verdict", "why")
    shown = len(head) if reasons else len(head) - 1
    return Table("Element by element", head[:shown], tuple(_comparison_row(each)[:shown] for each in compared))


def _comparison_row(each: Comparison) -> tuple[str, ...]:
    scale, unit = (1.0, "") if each.element.startswith("gamma") else (1e6, " MN/m")
    inverse, direct = (
        "–" if interval is None else f"{ends([end / scale for end in interval])}{unit}"
        for interval in (each.inverse, each.direct)
    )
    return each.joint, each.element, inverse, direct, VERDICTS.get(each.verdict, each.verdict), each.reason or ""
