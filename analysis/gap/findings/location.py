"""Where the gap lies: misfit beyond noise by row and band, and by configuration, amplitude and band.

A map shows where a model fails, not why: a mass at the accelerometer shows in every row, and errors of the beam look
like errors of joints. It is evidence for people, and no cause is derived from it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.evidence.residual_structure import energy_of, series
from analysis.gap.fitting.fit import Fit
from analysis.gap.measurement import Configuration, Rig

BANDS = 20
LOWEST_BAND = 20.0
"""Hz; all lines below are one band."""
LINES_PER_BAND = 5
"""Lines that the shortest row has in each band, in the mean, where lines are few."""
LEAST_LINES = 5
"""Lines of a row in a band below which its misfit is not computed: fewer cannot be `SIGNIFICANT`, even if all agree."""
NAMED = 8
"""Number of places that are reported."""
SIGNIFICANT = 4.0
"""Standard deviations above which a band is part of a place."""


@dataclass(frozen=True)
class GapPlace:
    """Where a part of the gap lies.

    Attributes:
        rig: that it is read on.
        where: coordinates of the place: input, response and level (number of the hammer set, from 1), or specimen,
            configuration and amplitude_pp_mm.
        band: from and to, Hz.
        part: "magnitude" or "phase", whichever holds the larger part of the misfit.
        share: of all misfit beyond noise.
        significance: in standard deviations of what noise alone would show.
    """

    rig: Rig
    where: dict[str, str | float]
    band: tuple[float, float]
    part: str
    share: float
    significance: float


@dataclass(frozen=True, eq=False)
class GapMap:
    """Misfit beyond noise over rows and bands, of one rig at one level.

    Attributes:
        title: for the picture.
        rig: that it is read on.
        rows: names.
        wheres: (rows,) as in `GapPlace.where`.
        edges: (bands + 1,) Hz.
        energy: (rows, bands) sum of squares in units of the noise; scatters about zero where there is no misfit.
        significance: (rows, bands) in standard deviations of what noise alone would show.
        in_phase: (rows, bands) share of the energy that is in phase with the response, which is its magnitude.
    """

    title: str
    rig: Rig
    rows: tuple[str, ...]
    wheres: tuple[dict[str, str | float], ...]
    edges: Real
    energy: Real
    significance: Real
    in_phase: Real


def maps(found: Fit) -> tuple[GapMap, ...]:
    """A map of each hammer set, and one of the tester."""
    likelihood = found.likelihood
    measurement = likelihood.measurement
    predicted = found.readings
    result = []
    for number, each in enumerate(measurement.sets):
        wheres: tuple[dict[str, str | float], ...] = tuple(
            {"input": str(dof), "response": str(measurement.drawing.accelerometer), "level": number + 1}
            for dof in each.inputs
        )
        title = f"beam, set {number + 1}, blows of {each.peak_force:.3g} N"
        rows = [
            (each.accelerance[row], predicted.accelerances[number][row], each.deviation[row], each.frequency)
            for row in range(len(each.inputs))
        ]
        result.append(map_of(title, Rig.BEAM, [str(dof) for dof in each.inputs], wheres, rows))
    points = measurement.points
    if points is not None:
        names, wheres_of, rows = [], [], []
        for (specimen, configuration, _), members in series(points).items():
            where: dict[str, str | float] = {
                "specimen": measurement.drawing.joints[specimen].name,
                "configuration": Configuration(configuration).name.lower(),
                "amplitude_pp_mm": round(2e3 * float(points.amplitude[members[0]]), 6),
            }
            wheres_of.append(where)
            names.append(f"{where['specimen']} {where['configuration']} {where['amplitude_pp_mm']:g} mm")
            stiffness = points.stiffness[members], predicted.stiffness[members]
            rows.append((*stiffness, points.deviation[members], points.frequency[members]))
        result.append(map_of("tester", Rig.TESTER, names, tuple(wheres_of), rows))
    return tuple(result)


def map_of(
    title: str,
    rig: Rig,
    names: Sequence[str],
    wheres: tuple[dict[str, str | float], ...],
    rows: Sequence[tuple[Complex, Complex, Real, Real]],
) -> GapMap:
    """A map of rows, each of (lines,) measured, simulated, standard deviation per part, and frequency in Hz."""
    edges = band_edges(
        np.concatenate([frequency for *_, frequency in rows]), min(frequency.size for *_, frequency in rows)
    )
    energy, significance, in_phase = np.zeros((3, len(rows), edges.size - 1))
    for row, (measured, simulated, deviation, frequency) in enumerate(rows):
        left = (measured - simulated) / deviation
        # turned so that the response is real: then misfit in its magnitude is real, and in its phase imaginary;
        # the phase is the simulated one: noise that is turned by its own phase would all point one way
        turned = left * np.exp(-1j * np.angle(simulated))
        for band in range(edges.size - 1):
            inside = (frequency >= edges[band]) & (frequency < edges[band + 1])
            if np.count_nonzero(inside) < LEAST_LINES:
                continue
            total, spread = energy_of(left[inside])
            real, _ = energy_of(turned[inside].real.astype(complex))
            energy[row, band], significance[row, band] = total, total / spread
            in_phase[row, band] = np.clip(real / total, 0.0, 1.0) if total > 0 else 0.5
    return GapMap(title, rig, tuple(names), wheres, edges, energy, significance, in_phase)


def places(found: Sequence[GapMap]) -> tuple[GapPlace, ...]:
    """The places with most of the misfit, neighbouring bands of a row together, the largest first."""
    whole = sum(float(np.sum(np.maximum(each.energy, 0.0))) for each in found)
    result = [place for each in found for row in range(len(each.rows)) for place in _places_of_row(each, row, whole)]
    return tuple(sorted(result, key=lambda place: -place.share)[:NAMED])


def band_edges(frequency: Real, lines: int) -> Real:
    """(bands + 1,) Hz: evenly spread in the logarithm, or with equal numbers of lines where a row has few of them.

    Args:
        frequency: (n,) of all rows, Hz.
        lines: that the shortest row has.
    """
    low, high = float(np.min(frequency)), float(np.max(frequency)) * (1 + 1e-9)
    if lines < LINES_PER_BAND * BANDS or high <= 2 * LOWEST_BAND:
        bands = max(1, min(BANDS, lines // LINES_PER_BAND))
        return np.concatenate([np.quantile(frequency, np.arange(bands) / bands), [high]])
    start = max(low, LOWEST_BAND)
    above = np.geomspace(start, high, BANDS + 1)
    return np.concatenate([[low], above]) if low < start else above


def _places_of_row(each: GapMap, row: int, whole: float) -> list[GapPlace]:
    result, started = [], None
    strong = (each.significance[row] > SIGNIFICANT) & (each.energy[row] > 0.01 * np.max(each.energy, initial=0.0))
    for band in range(strong.size + 1):
        inside = band < strong.size and strong[band]
        if inside and started is None:
            started = band
        elif not inside and started is not None:
            bands = slice(started, band)
            energy = each.energy[row, bands]
            magnitude = float(np.sum(energy * each.in_phase[row, bands]) / np.sum(energy)) >= 0.5
            result.append(
                GapPlace(
                    rig=each.rig,
                    where=each.wheres[row],
                    band=(float(each.edges[started]), float(each.edges[band])),
                    part="magnitude" if magnitude else "phase",
                    share=float(np.sum(energy)) / whole,
                    significance=float(np.sqrt(np.sum(each.significance[row, bands] ** 2))),
                )
            )
            started = None
    return result
