"""The report's section on levels of excitation: joints against amplitude."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.joint_amplitude import JointAmplitude
from jointlab.identification.levels import Level
from jointlab.report import figures
from jointlab.report.curves import ELEMENTS
from jointlab.report.section import Picture, Section, Table, ends, number


def levels_section(levels: Sequence[Level]) -> Section:
    """Each set's joints at the amplitude that its blows or its sine caused, as a table and a picture."""
    rows = tuple(_row(level, name) for level in levels for name in level.fit.joints)
    head = (
        "set",
        "peak force (N)",
        "joint",
        "amplitude (um p-p), 95 %",
        "k22 (MN/m), 95 %",
        "k12 (MN/m), 95 %",
        "gamma22",
    )
    content: list[str | Table | Picture] = [
        "Every set by itself. What sets have in common, such as gain, density and modulus, moves all alike: "
        "differences between sets are known better than each of them.",
        Table("Joints against amplitude", head, rows),
    ]
    names = list(levels[0].fit.joints)
    curves = {name: _curve(levels, name) for name in names if all(name in level.amplitudes for level in levels)}
    if curves:
        content.append(Picture("Stiffness k22 against amplitude", figures.against_amplitude(curves)))
    content += [
        f"The amplitudes of set {level.number} are {next(iter(level.amplitudes.values())).source}."
        for level in levels
        if level.amplitudes
    ]
    failed = [level for level in levels if not level.fit.passed]
    content += [f"Set {level.number} fails a check; do not rely on it." for level in failed]
    return Section("Levels of excitation", tuple(content))


def _row(level: Level, name: str) -> tuple[str, ...]:
    joint = level.fit.joints[name]
    stiffness = (ends(joint.k_ci95[at] / 1e6, 4) for _, at in ELEMENTS)
    return (
        str(level.number),
        number(level.peak_force),
        name,
        _written(level.amplitudes.get(name)),
        *stiffness,
        ends(joint.loss_factor_ci95[1, 1]),
    )


def _written(amplitude: JointAmplitude | None) -> str:
    if amplitude is None:
        return "–"
    value, interval = number(1e6 * float(amplitude.amplitude_pp[0])), amplitude.ci95
    return value if interval is None else f"{value} ({ends(1e6 * interval[0])})"


def _amplitude(level: Level, name: str) -> float:
    return float(level.amplitudes[name].amplitude_pp[0])


def _curve(levels: Sequence[Level], name: str) -> figures.LevelCurve:
    order = sorted(levels, key=lambda level: _amplitude(level, name))
    return figures.LevelCurve(
        amplitude_pp=np.array([_amplitude(level, name) for level in order]),
        stiffness=np.array([level.fit.joints[name].stiffness[1, 1] for level in order]),
        interval=np.array([level.fit.joints[name].k_ci95[1, 1] for level in order]),
    )
