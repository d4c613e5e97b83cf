"""The baseline of a bench, its modes, and a joint, to which an effect is added."""

import numpy as np
import pytest

from analysis.gap.bench import BeamBench, Cylinders, Mounting, Setting
from analysis.gap.measurement import Measurement
from analysis.gap.simulation.baseline import Baseline, baseline_of
from analysis.gap.simulation.free_beam_modes import BeamModes, beam_modes_of
from tests.analysis.gap.conftest import at_centre

SHEAR, COMPRESSION, ROTATION = 4e5 * (1 + 0.1j), 2.4e6 * (1 + 0.12j), 20.0 * (1 + 0.12j)


@pytest.fixture
def baseline(empty: Measurement) -> Baseline:
    return baseline_of(empty)


@pytest.fixture(scope="session")
def modes(empty: Measurement) -> BeamModes:
    return beam_modes_of(empty.drawing)


@pytest.fixture
def setting(empty: Measurement) -> Setting:
    each = empty.sets[0]
    first = np.zeros(len(each.inputs), dtype=np.intp)
    return Setting(each.inputs, each.frequency, np.array([each.peak_force]), first, first)


@pytest.fixture
def cylinders(empty: Measurement) -> Cylinders:
    of_one = np.array([SHEAR, COMPRESSION, ROTATION])[:, None, None]
    both = np.stack([of_one] * len(empty.drawing.joints))
    return Cylinders(both.real, both.imag)


@pytest.fixture
def mounting(baseline: Baseline) -> Mounting:
    return baseline.mounting(at_centre(baseline))


@pytest.fixture
def bench(baseline: Baseline, setting: Setting, mounting: Mounting) -> BeamBench:
    return baseline.beam(at_centre(baseline), setting, mounting)
