"""The report's section on levels of excitation: joints against amplitude."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlab.identification.levels import Level
from jointlab.report import figures
from jointlab.report.section import Item, Notice, Picture, Section
from jointlab.report.summary import levels_table


def levels_section(levels: Sequence[Level]) -> Section:
    """Each set's joints at the amplitude that its blows or its sine caused, as a table and a picture."""
    content: list[Item] = [
        "Every set by itself. What sets have in common, such as gain, density and modulus, moves all alike: "
        "differences between sets are known better than each of them.",
        levels_table(levels),
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
    content += [Notice(f"Set {level.number} fails a check; do not rely on it.", failed=True) for level in failed]
    return Section("Levels of excitation", tuple(content))


def _curve(levels: Sequence[Level], name: str) -> figures.LevelCurve:
    order = sorted(levels, key=lambda level: float(level.amplitudes[name].amplitude_pp[0]))
    return figures.LevelCurve(
        amplitude_pp=np.array([float(level.amplitudes[name].amplitude_pp[0]) for level in order]),
        stiffness=np.array([level.fit.joints[name].stiffness[1, 1] for level in order]),
        interval=np.array([level.fit.joints[name].k_ci95[1, 1] for level in order]),
    )
