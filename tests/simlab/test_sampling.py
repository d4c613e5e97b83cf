import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simlab.beam import Real
from simlab.hammer_operator import BlowKind, HammerOperator, SimulatedBlow
from simlab.ordinary import draw_article
from simlab.sampling import MEMORY, Sampler, white_noise
from simlab.stand import Stand
from tests.simlab.specimens import built_of

BUILT = built_of(draw_article(1))


def stand_at(frequency: Real) -> Stand:
    return Stand(BUILT, frequency)


SAMPLER = Sampler(stand_at, lambda _: 23.0)


def blow(number: int = 0, time: float = 1.0, kind: BlowKind = BlowKind.CLEAN, node: int = 5) -> SimulatedBlow:
    return HammerOperator(seed=1).strike(number, node, "y", time, 100.0, kind)


@pytest.mark.parametrize("kind", [BlowKind.CLEAN, BlowKind.DOUBLE, BlowKind.SOFT])
@pytest.mark.parametrize("rate", [5120.0, 51200.0 / 7])
def test_the_spectrum_ratio_of_a_recorded_blow_is_the_accelerance(kind: BlowKind, rate: float) -> None:
    struck = blow(kind=kind)
    block = Sampler(stand_at, lambda _: 23.0).read([struck], 0.9, rate, int(3.0 * rate))
    frequency = np.asarray(np.fft.rfftfreq(block.shape[1], 1 / rate), dtype=np.float64)
    lines = (frequency > 20.0) & (frequency < 1024.0)
    force, acceleration = np.fft.rfft(block)[:, lines]
    exact = stand_at(frequency[lines]).blow(struck.row, 0, struck.peak_force, struck.load)
    # where the double or soft blow has no force there is nothing to divide by
    loud = np.abs(force) > 1e-3 * np.abs(force).max()
    np.testing.assert_allclose((acceleration / force)[loud], exact[loud], rtol=1e-3, atol=1e-5 * np.abs(exact).max())


def test_at_a_high_rate_the_force_samples_are_those_of_the_pulses() -> None:
    struck = blow(kind=BlowKind.DOUBLE)
    start, rate = 0.9937, 51200.0
    block = SAMPLER.read([struck], start, rate, 4000)
    force = struck.force(start + np.arange(4000) / rate)
    np.testing.assert_allclose(block[0], force, atol=1e-4 * struck.peak_force)


@given(st.floats(-0.5, 0.5), st.sampled_from([5120.0, 10240.0, 51200.0 / 9]))
@settings(max_examples=15)
def test_a_record_that_starts_a_fraction_of_a_sample_later_is_the_same_signal_shifted(
    delay: float, rate: float
) -> None:
    struck, samples = blow(), int(3.05 * rate)
    frequency = np.fft.rfftfreq(samples, 1 / rate)
    lines = frequency < 1024.0
    here, later = (
        np.fft.rfft(SAMPLER.read([struck], start, rate, samples))[:, lines] for start in (0.9, 0.9 + delay / rate)
    )
    shifted = here * np.exp(2j * np.pi * frequency[lines] * delay / rate)
    scale = np.abs(here).max(axis=1, keepdims=True)
    np.testing.assert_array_less(np.abs(later - shifted) / scale, 1e-4)


def test_the_anti_alias_filter_leaves_both_channels_alone_to_0_45_of_the_rate() -> None:
    struck, rate = blow(), 5120.0
    block = SAMPLER.read([struck], 0.9, rate, 16384)
    frequency = np.asarray(np.fft.rfftfreq(16384, 1 / rate), dtype=np.float64)
    force = np.abs(np.fft.rfft(block[0])) / rate
    sent = np.abs(struck.spectrum(frequency, 0.0))
    flat = frequency < 0.45 * rate
    np.testing.assert_allclose(force[flat], sent[flat], rtol=1e-4)
    assert np.all(force[frequency > 0.499 * rate] < 0.01 * sent[frequency > 0.499 * rate])


def test_blows_that_overlap_add_up_and_blocks_of_any_length_join() -> None:
    first, second = blow(0, 1.0), blow(1, 1.8, node=9)
    rate = 5120.0
    both = SAMPLER.read([first, second], 0.5, rate, 15000)
    np.testing.assert_allclose(both, sum(SAMPLER.read([b], 0.5, rate, 15000) for b in (first, second)), atol=1e-12)
    parts = [SAMPLER.read([first, second], 0.5 + begin / rate, rate, 3000) for begin in range(0, 15000, 3000)]
    np.testing.assert_allclose(np.hstack(parts), both, atol=1e-9)


def test_a_response_dies_out_within_the_time_remembered() -> None:
    block = SAMPLER.read([blow(node=1)], 0.9, 5120.0, int((MEMORY + 1.0) * 5120))
    peak = np.abs(block[1]).max()
    assert np.abs(block[1, int(2.9 * 5120) : int(3.1 * 5120)]).max() < 1e-6 * peak
    assert not block[:, int(3.4 * 5120) :].any()


def test_nothing_is_heard_before_a_blow() -> None:
    struck = blow(time=2.0)
    block = SAMPLER.read([struck], 0.0, 5120.0, int(1.94 * 5120))
    assert not block.any()


def test_noise_is_the_same_for_a_sample_in_whatever_block_it_is_read() -> None:
    whole = white_noise(5, 0, -5000, 20000)
    np.testing.assert_array_equal(whole[777:9000], white_noise(5, 0, -5000 + 777, 9000 - 777))
    assert white_noise(5, 0, 10, 0).shape == (0,)


def test_noise_is_white_of_unit_size_and_its_own_in_every_channel() -> None:
    first, second, other_seed = (
        white_noise(5, 0, 0, 100_000),
        white_noise(5, 1, 0, 100_000),
        white_noise(6, 0, 0, 100_000),
    )
    assert first.std() == pytest.approx(1.0, rel=0.01)
    for shifted in (second, other_seed, np.roll(first, 1), np.roll(first, 4096)):
        assert abs(np.mean(first * shifted)) < 4 / np.sqrt(100_000)
