"""The report's sections on the tester, and on both methods together: Figs. 11 to 14."""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.interval import Estimate
from jointlab.identification.direct import Direct
from jointlab.identification.inverse import Inverse
from jointlab.identification.pipeline import Identification
from jointlab.identification.save import stored_comparison
from jointlab.report import figures
from jointlab.report.curves import (
    CurveValue,
    PlottedCurve,
    curves,
    joints_by_method,
    loss_factor,
    loss_factor_panels,
    magnitude,
    stiffness_panels,
    superposition_curves,
)
from jointlab.report.section import Item, Picture, Section, Table, ends, number
from jointlab.report.summary import (
    corrections_section,
    not_compared,
    superposition_texts,
    tester_notices,
)
from jointlab.report.tables import comparison_table, unit_notices

READ_AS = "points by the tester, bands by the hammer test with the method that the legend names; 95 % intervals"


def direct_sections(found: Identification) -> list[Section]:
    """The tester's results, and the comparison where there is one."""
    sections = [corrections_section(found.corrections)] if found.direct else []
    sections += [_cylinders(name, direct) for name, direct in found.direct.items()]
    if found.inverse is not None and found.comparison:
        compared = [stored_comparison(each) for each in found.comparison]
        content: tuple[Item, ...] = (
            *_both_methods(found.inverse, found.direct),
            *unit_notices(compared),
            comparison_table(compared),
        )
        sections.append(Section("Direct against inverse", content))
    elif found.inverse is not None and found.not_compared:
        said = not_compared(found.not_compared)
        sections.append(Section("Direct against inverse", (*_both_methods(found.inverse, found.direct), said)))
    return sections


def _claims(direct: Direct) -> list[str]:
    """Standards that the points meet; a sentence that holds for every configuration appears once."""
    by_sentence: dict[str, list[str]] = {}
    for configuration, sentences in direct.claims.items():
        for sentence in sentences:
            by_sentence.setdefault(sentence, []).append(configuration)
    every = len(direct.claims)
    return [
        sentence if len(configurations) == every else f"In {', '.join(configurations)}: {sentence}"
        for sentence, configurations in by_sentence.items()
    ]


def _cylinders(name: str, direct: Direct) -> Section:
    content: list[Item] = [
        Picture(
            f"Fig. 11: cylinders of joint {name} in the tester, with 95 % intervals",
            figures.dynamic_stiffness(name, *(_curves(direct, of) for of in (magnitude, loss_factor))),
        ),
        _ratios(name, direct),
    ]
    insufficient, count = direct.insufficient
    if not insufficient:
        content.append(f"The first harmonic describes all {count} points.")
    content.append(_first_harmonic(name, direct))
    content += tester_notices(name, direct)
    content += _claims(direct)
    if direct.superposition:
        content.append(
            Picture(
                f"Fig. 12: joint {name}, superposition of the cylinders at 45 degrees",
                figures.superposition(name, *superposition_curves(direct.superposition)),
            )
        )
        content += superposition_texts(direct)
    return Section(f"Direct method, joint {name}", tuple(content))


def _ratios(name: str, direct: Direct) -> Table:
    """How far stiffness and loss change between the smallest and the largest amplitude."""
    rows = []
    for configuration, by_amplitude in direct.series.items():
        smallest, largest = min(by_amplitude), max(by_amplitude)
        stiffness, loss = (
            np.mean([quantity(point).value for point in by_amplitude[smallest]])
            / np.mean([quantity(point).value for point in by_amplitude[largest]])
            for quantity in (magnitude, loss_factor)
        )
        rows.append((configuration, number(float(stiffness)), number(float(loss))))
    caption = f"Joint {name}: smallest over largest amplitude, mean over frequency"
    return Table(caption, ("configuration", "|k|", "loss factor"), tuple(rows))


def _first_harmonic(name: str, direct: Direct) -> Table:
    """Reached amplitudes, and the worst deviation of each series from sines and ellipses."""
    rows = []
    for configuration, by_amplitude in direct.series.items():
        for amplitude, points in by_amplitude.items():
            reached = [1e3 * point.amplitude_pp for point in points]
            rows.append(
                (
                    configuration,
                    f"{amplitude:g}",
                    ends((min(reached), max(reached))),
                    _worst(points, lambda point: _with_error(point.thd_force, point.thd_force_standard_error)),
                    _worst(
                        points, lambda point: _with_error(point.thd_displacement, point.thd_displacement_standard_error)
                    ),
                    _worst(points, _loop_excess),
                )
            )
    return Table(
        f"Joint {name}: reached amplitude, and the worst of total harmonic distortion and of loop energy against "
        "π X² h in each series, with standard errors",
        ("configuration", "asked, mm p-p", "reached, mm p-p", "force, %", "displacement, %", "loop less π X² h, %"),
        tuple(rows),
    )


def _worst(points: Sequence[DynamicStiffness], share: Callable[[DynamicStiffness], Estimate | None]) -> str:
    """The largest known value of the points, in percent; a dash where none is known."""
    known = [found for point in points if (found := share(point)) is not None]
    if not known:
        return "–"
    worst = max(known, key=lambda found: abs(found.value))
    error = f" ± {number(100 * worst.standard_error, 2)}" if math.isfinite(worst.standard_error) else ""
    return f"{number(100 * worst.value)}{error}"


def _with_error(value: float | None, standard_error: float | None) -> Estimate | None:
    return None if value is None else Estimate(value, math.nan if standard_error is None else standard_error)


def _loop_excess(point: DynamicStiffness) -> Estimate | None:
    """Excess of the loop energy, as a share of the energy of the first harmonic's ellipse."""
    excess, ellipse = point.loop_energy_excess, point.first_harmonic_energy
    return None if excess is None else Estimate(excess.value / ellipse, excess.standard_error / abs(ellipse))


def _both_methods(inverse: Inverse, direct: Mapping[str, Direct]) -> tuple[Picture, ...]:
    """Figs. 13 and 14; none where the tester lacks a joint's terms."""
    if not all(name in direct and direct[name].joint for name in inverse.likelihood.joints):
        return ()
    joints = joints_by_method(inverse)
    stiffness, loss = stiffness_panels(joints, direct), loss_factor_panels(joints, direct)
    return (
        Picture(
            f"Fig. 13: stiffness, {READ_AS}",
            figures.direct_against_inverse("Fig. 13: stiffness", "k (MN/m)", stiffness, 1e6),
        ),
        Picture(
            f"Fig. 14: loss factor, {READ_AS}",
            figures.direct_against_inverse("Fig. 14: loss factor", "loss factor", loss),
        ),
    )


def _curves(direct: Direct, quantity: CurveValue) -> dict[str, dict[float, PlottedCurve]]:
    return {configuration: curves(by_amplitude, quantity) for configuration, by_amplitude in direct.series.items()}
