"""The scatter of a bundle's blows is found at every sample rate, although files round it."""

from pathlib import Path

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.modal.spectra import responses_from_blows
from jointlab.identification.bundle_blows import scatter_of_bundle
from store.dof import StoredDof
from store.exchange.blow_file import BundleBlow, read_blow, write_blow
from store.measurements.frequency_responses import FrequencyResponseSet

SAMPLES, BLOWS = 2048, 5
POINTS = (StoredDof(1, "y"), StoredDof(4, "y"))


def blows(rate: float) -> list[BundleBlow]:
    random, pulse = np.random.default_rng(1), np.zeros(SAMPLES)
    pulse[100:104] = [0.5, 1.0, 1.0, 0.5]
    return [
        BundleBlow(
            f"blow_{point}_set1_{number:02}.unv",
            point,
            StoredDof(3, "y"),
            sample_rate=rate,
            force=pulse + 1e-4 * random.standard_normal(SAMPLES),
            acceleration=np.roll(pulse, 3) * (1 + 0.1 * random.standard_normal())
            + 1e-4 * random.standard_normal(SAMPLES),
            trigger_index=98,
        )
        for point in POINTS
        for number in range(1, BLOWS + 1)
    ]


@pytest.mark.parametrize("rate", [2048.0, 4096.0, 5120.0, 8192.0])
def test_the_scatter_is_that_of_the_blows_before_they_were_written(rate: float, tmp_path: Path) -> None:
    made = blows(rate)
    at = [[each for each in made if each.point == point] for point in POINTS]
    computed = responses_from_blows(
        [np.array([each.force for each in point]) for point in at],
        [np.array([each.acceleration for each in point]) for point in at],
        rate,
        Dof.parse("3y"),
        [Dof.parse(str(point)) for point in POINTS],
        rate / 4,
        pre_trigger=98,
    )
    measured = FrequencyResponseSet(
        number=1, response=StoredDof(3, "y"), inputs=POINTS, frequency=computed.frequency,
        accelerance=computed.accelerance, averages=BLOWS, peak_force=1.0, temperature_c=23.0, window="none",
        sample_rate=rate, block_seconds=SAMPLES / rate, estimator="H1",
    )  # fmt: skip
    for each in made:
        write_blow(tmp_path, each)
    read = [read_blow(tmp_path / each.file) for each in made]
    found = scatter_of_bundle((measured,), read)
    assert computed.scatter is not None
    np.testing.assert_allclose(found[1], computed.scatter, rtol=1e-3, atol=1e-6)
