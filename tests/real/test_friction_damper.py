"""The direct method on a real servo-hydraulic machine, against an independent first-harmonic result.

Each record is two cycles of ramp up, three steady cycles and two of ramp down, beginning 31 ms after the record does.
The steady cycles are what is compared.
"""

import csv
import json
import math
import re
from dataclasses import dataclass

import numpy as np
import pytest

from analysis.direct.dynamic_stiffness import DynamicStiffness, dynamic_stiffness
from analysis.frequency_response import Real
from tests.recordings import Recording

INCH, KIP = 0.0254, 4448.2216152605
LATENCY = 0.031  # s, from the first upward crossings of the displacement
RAMP_CYCLES, STEADY_CYCLES = 2.0, 3
NAMES = (
    "0.5Hz36lbtension0.5amplitude",
    "0.5Hz36lbtension1amplitude",
    "0.5Hz36lbtension1.5amplitude",
    "1Hz36lbtension0.5amplitude",
    "1Hz36lbtension1amplitude",
    "1Hz36lbtension1.5amplitude",
)
BEGINS_IN_RAMP = "1Hz36lbtension1.5amplitude"


@dataclass(frozen=True)
class Record:
    frequency: float
    sample_rate: float
    displacement: Real
    force: Real
    reference: dict[str, float]

    def cycles(self, start: float) -> tuple[Real, Real]:
        """Displacement and force of three cycles, `start` in cycles."""
        first = round((start / self.frequency + LATENCY) * self.sample_rate)
        part = slice(first, first + round(STEADY_CYCLES * self.sample_rate / self.frequency))
        return self.displacement[part], self.force[part]

    def point(self, start: float = RAMP_CYCLES) -> DynamicStiffness:
        # force corners are sharp and there are a thousand samples a cycle: seven harmonics, as in the reference
        return dynamic_stiffness(*self.cycles(start), self.sample_rate, self.frequency, harmonics=7)

    def loop_integral(self) -> float:
        """Energy a cycle by the closed polygon through the samples, which knows nothing of harmonics."""
        displacement, force = (np.append(signal, signal[0]) for signal in self.cycles(RAMP_CYCLES))
        return float(np.trapezoid(force, displacement)) / STEADY_CYCLES


def read(recording: Recording, name: str) -> Record:
    folder = recording("data/friction_damper")
    match = re.fullmatch(r"([\d.]+)Hz(\d+)lbtension([\d.]+)amplitude", name)
    assert match is not None
    wanted = tuple(map(float, match.groups()))
    with (folder / "kd_reference.csv").open() as lines:
        rows = [row for row in csv.DictReader(lines) if row.pop("F_source")]
    numbers = [{key: float(value) for key, value in row.items()} for row in rows]
    (reference,) = [row for row in numbers if (row["f_Hz"], row["tension_lb"], row["amp_in"]) == wanted]
    recorded = json.loads((folder / f"{name}.json").read_text())
    columns = np.array(recorded["data"]).T
    return Record(wanted[0], recorded["sampling freq"], columns[1] * INCH, columns[2] * KIP, reference)


def test_every_recorded_file_that_has_a_reference_is_compared(recording: Recording) -> None:
    assert sorted(NAMES) == sorted(path.stem for path in recording("data/friction_damper").glob("*.json"))


@pytest.mark.parametrize("name", NAMES)
def test_dynamic_stiffness_and_loss_angle_are_those_of_the_reference(recording: Recording, name: str) -> None:
    record = read(recording, name)
    point = record.point()
    assert 2 * record.reference["X1_mm"] * 1e-3 == pytest.approx(point.amplitude_pp, rel=0.01)
    assert point.magnitude == pytest.approx(record.reference["kd_kN_per_m"] * 1e3, rel=0.01)
    assert math.degrees(point.loss_angle) == pytest.approx(record.reference["delta_deg"], abs=0.5)


@pytest.mark.parametrize("name", NAMES)
def test_loop_energy_is_that_of_the_loop_integral_of_the_samples(recording: Recording, name: str) -> None:
    record = read(recording, name)
    assert record.point().loop_energy == pytest.approx(record.loop_integral(), rel=0.01)


@pytest.mark.parametrize("name", [name for name in NAMES if name != BEGINS_IN_RAMP])
def test_loop_energy_is_that_of_the_reference(recording: Recording, name: str) -> None:
    record = read(recording, name)
    assert record.point().loop_energy == pytest.approx(record.reference["W_loop_J"], rel=0.01)


@pytest.mark.parametrize("name", NAMES)
def test_a_friction_damper_is_flagged_as_nonlinear(recording: Recording, name: str) -> None:
    point = read(recording, name).point()
    assert not point.first_harmonic_sufficient
    assert any("distortion of the force" in reason for reason in point.shortcomings)


def test_the_reference_that_differs_in_energy_begins_in_the_ramp(recording: Recording) -> None:
    """Its whole row comes out of three cycles begun a quarter of a cycle before the amplitude is steady.

    The loop is not closed then, and the energy of the row is the integral along the open path.
    """
    record = read(recording, BEGINS_IN_RAMP)
    reference = record.reference
    start = RAMP_CYCLES - 0.25
    early = record.point(start)
    displacement, force = record.cycles(start)
    assert early.amplitude_pp == pytest.approx(2e-3 * reference["X1_mm"], rel=0.001)
    assert early.magnitude == pytest.approx(reference["kd_kN_per_m"] * 1e3, rel=0.001)
    assert math.degrees(early.loss_angle) == pytest.approx(reference["delta_deg"], abs=0.25)
    assert early.thd_force == pytest.approx(reference["THD_F_%"] / 100, rel=0.01)
    assert np.trapezoid(force, displacement) / STEADY_CYCLES == pytest.approx(reference["W_loop_J"], rel=0.01)
    # what is steady holds 3 % more
    assert record.loop_integral() > 1.03 * reference["W_loop_J"]
