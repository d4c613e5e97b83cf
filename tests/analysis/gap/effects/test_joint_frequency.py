"""Effects of frequency on joints, by their laws: what each makes of the cylinders."""

import numpy as np
import pytest
from hypothesis import given as examples
from hypothesis import strategies as st

from analysis.gap.bench import Cylinders
from analysis.gap.effect import Effect, Given
from analysis.gap.effects.joint_frequency import (
    REFERENCE,
    FewRelaxations,
    FractionalZener,
    FrequencyDependence,
    LossCurve,
    LossLaw,
    LossLawOfEach,
    PartViscous,
    SpringPot,
)
from tests.analysis.gap.conftest import at_centre
from tests.analysis.gap.effects.cylinders import STORAGE, in_tester, ratios, struck

FREQUENCIES = np.geomspace(1.0, 2000.0, 60)


CAUSAL = (FrequencyDependence(), FewRelaxations(), FractionalZener(), SpringPot())


@pytest.mark.parametrize("effect", CAUSAL, ids=lambda each: each.law)
@examples(scores=st.lists(st.floats(-1.0, 1.0), min_size=7, max_size=7))
def test_stiffness_rises_with_frequency_and_loses(effect: FrequencyDependence, scores: list[float]) -> None:
    """What relaxes is stiffer when fast, and takes energy out at every frequency (Kramers, Kronig)."""
    given = {
        parameter.name: abs(parameter.value(score)) if parameter.name == "g" else parameter.value(score)
        for parameter, score in zip(effect.parameters, scores, strict=False)
    }
    if "ratio" in given:
        given["ratio"] = max(given["ratio"], 1.01)
    elastic = Cylinders(STORAGE, np.zeros_like(STORAGE))
    found = effect.cylinders(given, elastic, in_tester(frequency=FREQUENCIES))
    assert np.all(np.diff(found.storage, axis=-1) >= 0)
    assert np.all(found.loss >= 0)


@pytest.mark.parametrize("effect", CAUSAL, ids=lambda each: each.law)
def test_loss_is_the_slope_of_stiffness_over_the_logarithm_of_frequency(effect: FrequencyDependence) -> None:
    """Kramers' and Kronig's relation, local for smooth laws: k'' = (pi / 2) dk' / d log w, roughly."""
    given = at_centre(effect, g=0.2) if isinstance(effect, SpringPot) else at_centre(effect)
    elastic = Cylinders(STORAGE, np.zeros_like(STORAGE))
    found = effect.cylinders(given, elastic, in_tester(frequency=np.geomspace(20.0, 400.0, 80)))
    slope = np.gradient(found.storage[0, 1, 0], np.log(np.geomspace(20.0, 400.0, 80)))
    assert np.allclose(found.loss[0, 1, 0], np.pi / 2 * slope, rtol=0.25)


@pytest.mark.parametrize("effect", CAUSAL, ids=lambda each: each.law)
def test_stiffness_keeps_the_baseline_at_the_reference(effect: FrequencyDependence) -> None:
    elastic = Cylinders(STORAGE, np.zeros_like(STORAGE))
    found = effect.cylinders(at_centre(effect), elastic, in_tester(frequency=REFERENCE))
    assert np.allclose(found.storage, STORAGE)


def test_frequency_acts_in_both_rigs_alike() -> None:
    for effect in CAUSAL:
        direct, inverse = (
            ratios(effect, at_centre(effect), at) for at in (in_tester(frequency=180.0), struck(frequency=180.0))
        )
        assert np.array_equal(direct, inverse)


def test_a_loss_law_changes_the_imaginary_part_alone() -> None:
    frequency = np.array([25.0, 100.0, 400.0])
    cases: tuple[tuple[Effect, Given, list[list[float]]], ...] = (
        (LossLaw(), {"p": 0.5}, [[0.5, 1, 2]] * 3),
        (LossLaw(), {"p": 1.0}, [[0.25, 1, 4]] * 3),
        (LossLawOfEach(), {"p_shear": 0.5, "p_compression": -0.5}, [[0.5, 1, 2], [2, 1, 0.5], [2, 1, 0.5]]),
        (PartViscous(), {"q_shear": 0.4, "q_compression": 0.0}, [[0.7, 1, 2.2], [1, 1, 1], [1, 1, 1]]),
    )
    for effect, given, expected in cases:
        storage, loss = ratios(effect, given, in_tester(frequency=frequency))
        assert np.allclose(storage, 1.0)
        assert np.allclose(loss, expected, rtol=1e-12), effect.law


def test_loss_may_follow_a_smooth_curve_of_each_way_of_loading() -> None:
    effect, frequency = LossCurve(), np.array([30.0, 100.0, 300.0])
    given = at_centre(effect, p_compression=0.5, shear_300=0.4, compression_30=-0.2)
    storage, loss = ratios(effect, given, in_tester(frequency=frequency))
    assert np.allclose(storage, 1.0)
    assert loss[0] == pytest.approx([1.0, 1.0, np.exp(0.4)])
    assert loss[1] == pytest.approx([np.sqrt(0.3) * np.exp(-0.2), 1.0, np.sqrt(3.0)])
