"""Identified values beside the true values of the simulated bench, which are read only after the identification."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np

from analysis.direct.corrections import TesterEffect
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.frequency_response import Real
from analysis.interval import Estimate
from analysis.inverse.joint_estimate import IdentifiedJoint
from jointlab.errors import JointlabError
from jointlab.identification.inverse import METHODS
from jointlab.identification.pipeline import Identification
from jointlab.identification.sine_points import IdentifiedSinePoint
from jointlab.report.section import Section, Table, ends, number
from jointlab.report.tables import SCALES, UNITS

SAME_FREQUENCY = 1e-3  # relative difference of recorded and commanded frequency
LEAST_KNOWN = 0.1
"""Truth over the width of the interval below which no relative error is shown."""
ELEMENTS = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))


@dataclass(frozen=True)
class SineTruth:
    """The true k, h and gamma of one sine point, at the amplitude that the bench really made."""

    point: IdentifiedSinePoint
    k: float
    h: float

    @property
    def gamma(self) -> float:
        """Loss factor."""
        return self.h / self.k

    def errors(self) -> tuple[float, float]:
        """Relative errors of the measured k and gamma."""
        result = self.point.result
        return result.stiffness / self.k - 1, result.loss_factor / self.gamma - 1

    def covered(self) -> tuple[bool, bool]:
        """Whether the 95 % intervals of k and gamma hold the truth."""
        result = self.point.result
        return _inside(result.stiffness_estimate, self.k), _inside(result.loss_factor_estimate, self.gamma)


def sine_truths(points: Sequence[IdentifiedSinePoint], dwells: Sequence[Mapping[str, Any]]) -> tuple[SineTruth, ...]:
    """Join sine points with the bench's dwells, both in the order of measuring.

    A specimen is cycled at a frequency several times until the amplitude is reached. The dwell with the amplitude of
    the point was recorded. Dwells on anything but specimens, such as known pieces, are left out.

    Raises:
        JointlabError: the bench cycled other points than were measured.
    """
    specimens = {point.specimen for point in points}
    visits = [list(visit) for _, visit in groupby((d for d in dwells if d["specimen"] in specimens), key=_place)]
    found, at = list[SineTruth](), 0
    for point in points:
        if found and not _is_there(point, visits[at][0]):
            at += 1
        if at == len(visits) or not _is_there(point, visits[at][0]):
            raise JointlabError(f"the bench did not cycle sine point {point.order_number} in its turn")
        found.append(_truth_of(point, visits[at]))
    if at + 1 < len(visits):
        raise JointlabError(f"the bench cycled at {len(visits)} places in turn, {at + 1} were measured")
    return tuple(found)


def _place(dwell: Mapping[str, Any]) -> tuple[str, str, float]:
    return dwell["specimen"], dwell["configuration"], dwell["frequency"]


def _is_there(point: IdentifiedSinePoint, dwell: Mapping[str, Any]) -> bool:
    specimen, configuration, frequency = _place(dwell)
    near = math.isclose(point.result.frequency, frequency, rel_tol=SAME_FREQUENCY)
    return near and (point.specimen, point.configuration) == (specimen, configuration)


def _truth_of(point: IdentifiedSinePoint, dwells: Sequence[Mapping[str, Any]]) -> SineTruth:
    reached = point.result.amplitude_pp
    recorded = min(reversed(dwells), key=lambda dwell: abs(math.log(dwell["amplitude_pp"] / reached)))
    off = math.log(_machine_pp(point.result) / recorded["amplitude_pp"])  # of the mean of a record that wanders
    k, h = (recorded[name] + off * recorded.get(f"{name}_slope", 0.0) for name in ("stiffness", "damping"))
    return SineTruth(point, k, h)


def _machine_pp(result: DynamicStiffness) -> float:
    """Amplitude of the machine, m: that of the specimen, plus the frame's under the specimen's force."""
    known = {each.effect: each.value for each in result.corrections}
    inertia = (2 * math.pi * result.frequency) ** 2 * known.get(TesterEffect.FIXTURE_INERTIA, 0.0)
    compliance = known.get(TesterEffect.FRAME_COMPLIANCE, 0.0)
    return result.amplitude_pp * abs(1 + compliance * (result.complex_stiffness - inertia))


def truth_document(truth: Mapping[str, Any], sines: Sequence[SineTruth]) -> dict[str, Any]:
    """The truth in the shape of the identification document."""
    direct: dict[str, Any] = {}
    for each in sorted(sines, key=lambda sine: sine.point.result.frequency):
        by_amplitude = direct.setdefault(each.point.specimen, {}).setdefault(each.point.configuration, {})
        series = by_amplitude.setdefault(
            f"{each.point.amplitude_pp_mm:g}", {"frequency_hz": [], "k": [], "h": [], "gamma": []}
        )
        series["frequency_hz"].append(round(each.point.result.frequency, 6))
        for name in ("k", "h", "gamma"):
            series[name].append(getattr(each, name))
    inverse = {name: {key: joint[key] for key in ("k", "h", "gamma")} for name, joint in truth["inverse"].items()}
    return {"modes": truth["modes"], "inverse": inverse, "direct": direct}


def truth_section(found: Identification, truth: Mapping[str, Any], sines: Sequence[SineTruth]) -> Section:
    """The report's section on the difference between results and truth."""
    content: list[str | Table] = [
        "The bench is simulated, so what it really is can be asked for. It was asked for after everything below had "
        "been identified and stored."
    ]
    if found.inverse is not None:
        for result in found.inverse.results:
            content.append(
                Table(
                    f"Joints at blow amplitude, {METHODS[result.method]}",
                    ("joint", "element", "identified, 95 %", "truth", "off by (%)", "inside"),
                    tuple(_joint_rows(result.joints, truth["inverse"])),
                )
            )
    head = (
        "amplitude (mm p-p)",
        "points",
        "largest error of k (%)",
        "of gamma (%)",
        "k inside 95 %",
        "gamma inside 95 %",
    )
    rows = []
    for amplitude, errors, covered in by_amplitude(sines):
        worst = 100 * np.max(np.abs(errors), axis=0)
        share = 100 * np.mean(covered, axis=0)
        rows.append(
            (
                f"{amplitude:g}",
                str(len(errors)),
                number(worst[0], 2),
                number(worst[1], 2),
                f"{share[0]:.0f} %",
                f"{share[1]:.0f} %",
            )
        )
    content.append(Table("Sine points in the tester", head, tuple(rows)))
    return Section("Identified against true", tuple(content))


def by_amplitude(sines: Sequence[SineTruth]) -> list[tuple[float, Real, Real]]:
    """For each commanded amplitude, largest first: (points, 2) errors of k and gamma, and whether they are covered."""
    amplitudes = sorted({each.point.amplitude_pp_mm for each in sines}, reverse=True)
    sorted_sines = {amplitude: [s for s in sines if s.point.amplitude_pp_mm == amplitude] for amplitude in amplitudes}
    return [
        (amplitude, np.array([s.errors() for s in chosen]), np.array([s.covered() for s in chosen], dtype=float))
        for amplitude, chosen in sorted_sines.items()
    ]


def joint_errors(joints: Mapping[str, IdentifiedJoint], truth: Mapping[str, Any]) -> dict[str, Real]:
    """(3, 3) relative error of each joint's stiffness."""
    return {name: np.asarray(joint.stiffness / np.array(truth[name]["k"]) - 1) for name, joint in joints.items()}


def _joint_rows(joints: Mapping[str, IdentifiedJoint], truth: Mapping[str, Any]) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for name, joint in joints.items():
        for symbol, value, limits in (("k", joint.stiffness, joint.k_ci95), ("h", joint.damping, joint.h_ci95)):
            for p, q in ELEMENTS:
                true = float(truth[name][symbol][p][q])
                low, high = limits[p, q].tolist()
                # couplings that are zero by design have no relative error, nor has what was not identified
                off = f"{100 * (value[p, q] / true - 1):+.1f}" if abs(true) > LEAST_KNOWN * abs(high - low) else "–"
                unit = UNITS[p][q]
                scale = SCALES[unit]
                observable = "" if joint.observable[p, q] else " (not observable)"
                rows.append(
                    (
                        name,
                        f"{symbol}{p + 1}{q + 1}{observable}",
                        f"{ends((low / scale, high / scale))} {unit}",
                        f"{number(true / scale)} {unit}",
                        off,
                        "yes" if low <= true <= high else "no",
                    )
                )
    return rows


def _inside(estimate: Estimate, true: float) -> bool:
    low, high = estimate.interval()
    return low <= true <= high
