"""Misfit is found where it was put, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.frequency_response import Complex, Real
from analysis.gap.evidence.residual_structure import energy_of
from analysis.gap.findings.location import (
    BANDS,
    LEAST_LINES,
    LOWEST_BAND,
    SIGNIFICANT,
    band_edges,
    map_of,
    maps,
    places,
)
from analysis.gap.fitting.fit import evaluated
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.measurement import Measurement, Rig
from tests.analysis.gap.conftest import simulation_of

FREQUENCY = np.arange(10.0, 1000.0, 1.0)
BAND = 300.0, 420.0
ROWS = ("1y", "3y", "7y")


def noise(seed: int, shape: tuple[int, ...]) -> Complex:
    random = np.random.default_rng(seed)
    return np.asarray(random.standard_normal(shape) + 1j * random.standard_normal(shape), dtype=np.complex128)


def response() -> Complex:
    """(rows, lines) with resonances, so that the phase is nowhere the same."""
    peaks = np.array([80.0, 250.0, 700.0])[:, None] / FREQUENCY
    return np.asarray(40 / (peaks**2 - 1 + 0.1j), dtype=np.complex128)


def inside() -> Real:
    return ((BAND[0] <= FREQUENCY) & (BAND[1] > FREQUENCY)).astype(float)


def map_with(factor: Complex, row: int) -> tuple[Complex, list[tuple[Complex, Complex, Real, Real]]]:
    """A measurement that is `factor` times what is simulated, in one row."""
    simulated = response()
    measured = simulated + noise(5, simulated.shape)
    measured[row] += (factor - 1) * simulated[row]
    return measured, [(measured[r], simulated[r], np.ones(FREQUENCY.size), FREQUENCY) for r in range(len(ROWS))]


@pytest.mark.parametrize(("off", "part"), [(0.3, "magnitude"), (0.3j, "phase")])
@pytest.mark.parametrize("row", [0, 2])
def test_misfit_of_one_row_and_band_is_found_there_alone(off: complex, part: str, row: int) -> None:
    _, rows = map_with(np.asarray(np.exp(off * inside()), dtype=np.complex128), row)
    wheres: tuple[dict[str, str | float], ...] = tuple({"input": name} for name in ROWS)
    found = map_of("beam", Rig.BEAM, ROWS, wheres, rows)
    (place,) = places([found])
    assert place.where == {"input": ROWS[row]}
    width = found.edges[-1] / found.edges[-2]
    assert BAND[0] / width < place.band[0] < BAND[0] * width
    assert BAND[1] / width < place.band[1] < BAND[1] * width
    assert place.part == part
    assert place.significance > 10
    others = np.arange(len(ROWS)) != row
    assert np.max(np.abs(found.significance[others])) < 4.5


def test_energy_of_a_map_is_the_misfit_in_it() -> None:
    factor = np.asarray(np.exp(0.3 * inside()), dtype=np.complex128)
    _, rows = map_with(factor, 1)
    found = map_of("beam", Rig.BEAM, ROWS, ({}, {}, {}), rows)
    put = float(np.sum(np.abs((factor - 1) * response()[1]) ** 2))
    assert np.sum(found.energy[1]) == pytest.approx(put, rel=0.1)


def test_noise_alone_has_no_place() -> None:
    _, rows = map_with(np.ones(FREQUENCY.size, dtype=np.complex128), 0)
    found = map_of("beam", Rig.BEAM, ROWS, ({}, {}, {}), rows)
    assert all(place.significance < 6 for place in places([found]))
    assert np.std(found.significance) < 1.6


def test_a_band_has_at_least_as_many_lines_as_show_a_pattern() -> None:
    def significance(lines: int) -> float:
        frequency, ones = np.linspace(20.0, 30.0, lines), np.ones(lines)
        whole = np.ones(lines, dtype=np.complex128)
        found = map_of("tester", Rig.TESTER, ["I"], ({},), [(9 * whole, 0 * whole, ones, frequency)])
        return float(np.max(found.significance))

    assert all(significance(lines) == 0.0 for lines in range(1, LEAST_LINES))
    assert SIGNIFICANT < significance(LEAST_LINES) < 6
    energy, deviation = energy_of(np.full(LEAST_LINES - 1, 9 + 0j))
    assert energy < SIGNIFICANT * deviation


def test_bands_are_one_below_and_evenly_spread_above() -> None:
    edges = band_edges(FREQUENCY, FREQUENCY.size)
    assert edges.size == BANDS + 2
    assert edges[:2] == pytest.approx([10.0, LOWEST_BAND])
    ratio = edges[2:] / edges[1:-1]
    assert np.allclose(ratio, ratio[0])
    assert edges[-1] > FREQUENCY[-1]


def test_few_points_are_shared_out_evenly_among_bands() -> None:
    frequency = np.arange(5.0, 201.0, 5.0)
    edges = band_edges(frequency, frequency.size)
    inside = np.histogram(frequency, edges)[0]
    assert edges.size > 3
    assert inside.min() >= 4
    assert inside.sum() == frequency.size


@pytest.mark.parametrize(
    "band",
    [
        (150.0, 200.0),
        (40.0, 80.0),
    ],
)
def test_misfit_in_the_tester_is_found_in_its_band(band: tuple[float, float]) -> None:
    frequency = np.arange(5.0, 201.0, 5.0)
    simulated = np.full(frequency.size, 1000 + 100j)
    measured = simulated + noise(2, frequency.shape)
    measured += 20.0 * ((frequency >= band[0]) & (frequency <= band[1]))
    found = map_of("tester", Rig.TESTER, ["I"], ({},), [(measured, simulated, np.ones(frequency.size), frequency)])
    put = 400.0 * np.count_nonzero((frequency >= band[0]) & (frequency <= band[1]))
    assert np.sum(found.energy) == pytest.approx(put, rel=0.25)


def test_every_set_and_the_tester_have_a_map_and_misfit_shows_in_that_of_its_set(empty: Measurement) -> None:
    simulation = simulation_of(empty)
    scores = np.zeros(Likelihood(simulation).unknowns)
    predicted = Likelihood(simulation).predict(scores, derivatives=())
    sets = []
    for number, (each, accelerance) in enumerate(zip(empty.sets, predicted.accelerances, strict=True)):
        measured = accelerance + each.deviation * noise(number, accelerance.shape)
        if number == 1:
            measured[4] *= 1.05
        sets.append(replace(each, accelerance=measured))
    measurement = replace(empty, sets=tuple(sets))
    likelihood = Likelihood(simulation.of(measurement))
    found = maps(evaluated(likelihood, scores))
    assert [each.rig for each in found] == [Rig.BEAM, Rig.BEAM, Rig.TESTER]
    assert [len(each.rows) for each in found] == [6, 6, 18]
    largest = places(found[:2])[0]
    assert largest.where == {"input": "11y", "response": "3y", "level": 2}
    assert largest.part == "magnitude"
    assert found[2].wheres[0] == {"specimen": "I", "configuration": "compression", "amplitude_pp_mm": 0.01}
    assert found[2].wheres[-1] == {"specimen": "II", "configuration": "angled", "amplitude_pp_mm": 0.1}
