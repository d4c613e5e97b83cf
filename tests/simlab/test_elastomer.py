import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simlab.bench import SimulatedBench, ordinary_bench
from simlab.case.campaign import CONFIGURATIONS
from simlab.clock import Clock
from simlab.elastomer import BLOW_AMPLITUDE, scattered
from simlab.ordinary import CYLINDERS, BenchConditions, draw_article
from tests.simlab.specimens import built_of, stiffness_of

NOMINAL = built_of(draw_article(1, tolerances=0.0))
LARGE, SMALL = 50e-6, 5e-6  # 0.1 and 0.01 mm peak to peak
SINE = np.arange(5.0, 201.0, 5.0)


@pytest.mark.parametrize("specimen", ["I", "II"])
@pytest.mark.parametrize(
    ("configuration", "factor", "tolerance"), [("compression", 2.1, 0.01), ("shear", 1.5, 0.01), ("angled", 2.0, 0.03)]
)
def test_stiffness_rises_and_loss_halves_from_a_tenth_to_a_hundredth_of_a_millimetre(
    specimen: str, configuration: str, factor: float, tolerance: float
) -> None:
    large, small = (stiffness_of(NOMINAL, specimen, configuration, x, SINE) for x in (LARGE, SMALL))
    np.testing.assert_allclose(np.abs(small) / np.abs(large), factor, rtol=tolerance)
    np.testing.assert_allclose(large.imag / large.real, 0.2, rtol=0.05)
    np.testing.assert_allclose(small.imag / small.real, 0.1, rtol=0.05)


@pytest.mark.parametrize("specimen", ["I", "II"])
def test_small_blows_meet_the_named_stiffness(specimen: str) -> None:
    cylinder = CYLINDERS[specimen]
    band = np.linspace(77.0, 900.0, 50)
    for configuration, value in (("compression", cylinder.compression), ("shear", 2 * cylinder.shear)):
        stiffness = stiffness_of(NOMINAL, specimen, configuration, BLOW_AMPLITUDE, band)
        np.testing.assert_allclose(stiffness.real, value, rtol=2e-3)


@pytest.mark.parametrize("configuration", CONFIGURATIONS)
def test_frequency_matters_below_50_hz_and_hardly_above_77(configuration: str) -> None:
    low, corner, from_77 = (
        stiffness_of(NOMINAL, "I", configuration, SMALL, np.linspace(*band, 100))
        for band in ((5.0, 50.0), (50.0, 77.0), (77.0, 900.0))
    )
    assert np.ptp(low.real) > 5 * np.ptp(corner.real) > 0
    assert np.ptp(from_77.real) < 0.01 * from_77.real.mean()
    every = np.concatenate([low, corner, from_77])
    loss = every.imag / every.real
    assert np.ptp(loss) < 0.05 * loss.mean()


@given(st.floats(1e-7, 1e-3), st.floats(0.0, 1000.0), st.sampled_from(["I", "II"]))
def test_an_angled_pair_is_the_sum_of_shear_and_compression(amplitude: float, frequency: float, specimen: str) -> None:
    shear, compression, angled = (
        complex(stiffness_of(NOMINAL, specimen, c, amplitude, frequency)) for c in ("shear", "compression", "angled")
    )
    assert angled == pytest.approx(shear / 2 + compression, rel=1e-12)


@given(st.floats(1e-8, 1e-3), st.floats(1.01, 10.0), st.floats(0.0, 2000.0), st.floats(10.0, 35.0))
def test_every_cylinder_softens_with_amplitude_and_always_takes_energy(
    amplitude: float, ratio: float, frequency: float, temperature: float
) -> None:
    cylinder = CYLINDERS["I"]
    small = cylinder.dynamic_stiffness(amplitude, frequency, temperature)
    large = cylinder.dynamic_stiffness(amplitude * ratio, frequency, temperature)
    assert np.all(large.real <= small.real)
    assert np.all(small.real > 0)
    assert np.all(small.imag > 0)


def test_the_harder_hammer_meets_a_softer_joint_and_a_tenth_of_force_changes_little() -> None:
    at = [CYLINDERS["I"].dynamic_stiffness(BLOW_AMPLITUDE * level, 200.0)[1].real for level in (0.9, 1.0, 1.1, 4.0)]
    assert at[3] < 0.95 * at[1]
    assert 0.0 < at[0] - at[2] < 0.01 * at[1]


def test_temperature_changes_the_stiffness_by_a_little() -> None:
    cold, warm = (stiffness_of(NOMINAL, "I", "shear", SMALL, 100.0, t).real for t in (22.0, 24.0))
    assert 0.002 < cold / warm - 1 < 0.02


def bench_with(specimen: str, configuration: str) -> SimulatedBench:
    bench = ordinary_bench(1, Clock(), BenchConditions(tolerances=0.0))
    bench.mount(specimen, configuration)
    return bench


def test_the_third_harmonic_grows_with_amplitude_from_a_tenth_of_a_per_cent_to_below_one() -> None:
    for configuration in CONFIGURATIONS:
        small, large = (bench_with("I", configuration).third_harmonic(x) for x in (SMALL, LARGE))
        assert 0.0005 < small < 0.002
        assert 0.003 < large < 0.01


def test_the_preset_is_held_by_a_force_that_is_odd_in_it() -> None:
    bench = bench_with("I", "compression")
    force = bench.static_force(0.5e-3)
    assert 100.0 < force < 1000.0
    assert bench.static_force(-0.5e-3) == pytest.approx(-force)
    assert bench.static_force(0.0) == 0.0


def test_samples_of_one_make_scatter_by_about_one_and_a_half_per_cent() -> None:
    rng = np.random.default_rng(1)
    sample = np.array([scattered(CYLINDERS["I"], rng, 1.0).compression for _ in range(400)]) / 2.30e6
    assert sample.mean() == pytest.approx(1.0, abs=0.003)
    assert sample.std() == pytest.approx(0.0135, rel=0.15)  # 1.5 % cut off at two standard deviations
    assert scattered(CYLINDERS["I"], rng, 0.0) == CYLINDERS["I"]


def test_unknown_specimens_and_configurations_and_no_amplitude_are_refused() -> None:
    with pytest.raises(ValueError, match="no specimen 'III'"):
        bench_with("III", "shear")
    with pytest.raises(ValueError, match="no configuration 'torsion'"):
        bench_with("I", "torsion")
    with pytest.raises(ValueError, match="amplitude"):
        bench_with("I", "shear").own_stiffness(0.0, 10.0)
