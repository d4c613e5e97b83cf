"""Joint matrices k, h and gamma in SI units, as tables that page and report have in common."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from analysis.frequency_response import Real
from jointlab.report.section import Cell, Table, Unknown, ends, number
from store.joint_matrices import JointMatrix

AXES = ("x", "y", "rotation")
UNITS = (("MN/m", "MN/m", "kN"), ("MN/m", "MN/m", "kN"), ("kN", "kN", "N m"))
SCALES = {"MN/m": 1e6, "kN": 1e3, "N m": 1.0, "": 1.0}
NOT_OBSERVABLE = "not observable"  # of what older versions stored without a reason
NEAR_ZERO = "k is near zero"
READING = (
    f"Rows and columns are {', '.join(AXES)} at the joint's node, with 95 % intervals. Greyed elements are not "
    "observable, each for the reason that stands under it."
)


def matrix_tables(joint: JointMatrix, method: str, reasons: Mapping[str, str]) -> tuple[Table, Table, Table]:
    """k, h and gamma of one joint.

    Args:
        joint: by one method.
        method: its name.
        reasons: by term, such as "k11", why it is not observable.
    """
    where = f"joint {joint.joint}, node {joint.node}, {method}"
    return (
        _table(f"k of {where}", joint, joint.stiffness, joint.stiffness_ci95, reasons),
        _table(f"h of {where}", joint, joint.damping, joint.damping_ci95, reasons),
        _table(f"γ of {where}", joint, joint.loss_factor, joint.loss_factor_ci95, reasons, is_ratio=True),
    )


def _table(
    caption: str, joint: JointMatrix, value: Real, interval: Real, reasons: Mapping[str, str], is_ratio: bool = False
) -> Table:
    def cell(row: int, column: int) -> Cell:
        at, why = (row, column), reasons.get(f"k{row + 1}{column + 1}")
        if np.isnan(value[at]):
            return Unknown("–", why or NEAR_ZERO)
        unit = "" if is_ratio else UNITS[row][column]
        scale = SCALES[unit]
        text = f"{number(float(value[at]) / scale)} [{ends(interval[at] / scale)}] {unit}".strip()
        return text if joint.observable[at] else Unknown(text, why or NOT_OBSERVABLE)

    rows = tuple((AXES[row], *(cell(row, column) for column in range(3))) for row in range(3))
    return Table(caption, ("", *AXES), rows)
