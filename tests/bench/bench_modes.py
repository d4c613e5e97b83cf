"""Monte Carlo of modal estimation on the simulated beam: bias, variance over Cramer-Rao, coverage of the intervals.

The data are exact accelerances of the simulated bench, which has structural damping and a mesh and a law of its own,
plus noise of known size. Runs come in pairs of opposite noise: what noise does to first order cancels in their mean, so
a bias far below the scatter shows.

True poles and modal constants are those of the exact accelerances themselves, by rational interpolation to 1e-12 (AAA,
Y. Nakatsukasa, O. Sete, L. N. Trefethen, SIAM J. Sci. Comput. 40, 2018). The bench's truth has poles with the joints'
stiffness held at each natural frequency; where the joints still creep, below 100 Hz, the response itself has others.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import AAA

from analysis.dof import Dof
from analysis.frequency_response import FrequencyResponses, Real
from analysis.modal.estimation import ModalEstimate, estimate_modes
from analysis.modes import Modes
from simlab.bench import SimulatedBench, ordinary_bench
from simlab.clock import Clock
from simlab.ordinary import BenchConditions

SENSOR = Dof.parse("3y")
POINTS = tuple(Dof.parse(text) for text in ["1y", "3y", "4y", "5y", "6y", "7y", "8y", "9y", "11y", "1x", "11x"])
FREQUENCY = np.arange(20.0, 1024.25, 0.5)
NOISE = 0.003  # (m/s^2)/N, per real and imaginary part of a line
SEEDS = (1,)
PAIRS = 600
PAIRS_OF_UNKNOWN_NOISE = 100


def main() -> None:
    """Print the table of a bench, and what the intervals do where the noise is not stated."""
    for seed in SEEDS:
        bench = ordinary_bench(seed, Clock(), BenchConditions(gain_error=0.0))
        exact = exact_responses(bench)
        true = true_modes(exact)
        print(f"bench {seed}, {2 * PAIRS} runs, noise {NOISE} (m/s^2)/N a line, noise stated", flush=True)
        print_table(bench, true, outcomes(exact, true, PAIRS), cramer_rao(true))
        unknown = outcomes(replace(exact, variance=None), true, PAIRS_OF_UNKNOWN_NOISE)
        held = 100 * np.mean(unknown.covered, axis=0)
        print(
            f"  noise not stated, {2 * PAIRS_OF_UNKNOWN_NOISE} runs: intervals hold "
            f"{' '.join(f'{share:.0f}' for share in held[:, 0])} % of frequencies, "
            f"{' '.join(f'{share:.0f}' for share in held[:, 1])} % of loss factors",
            flush=True,
        )


@dataclass(frozen=True)
class Outcomes:
    """What the runs gave.

    Attributes:
        error: (pairs, 2, modes, 2) of frequency (Hz) and loss factor; the second axis is the sign of the noise.
        covered: (runs, modes, 2) whether the interval holds the truth.
        shapes_covered: (runs, modes) share of modal constants, by part, that their intervals hold.
    """

    error: Real
    covered: Real
    shapes_covered: Real


def exact_responses(bench: SimulatedBench) -> FrequencyResponses:
    """Accelerances without noise, with the variance that noise is going to have."""
    accelerance = np.array([bench.accelerance(FREQUENCY, point.node, point.direction) for point in POINTS])
    return FrequencyResponses(FREQUENCY, accelerance, SENSOR, POINTS, variance=np.full(accelerance.shape, NOISE**2))


def true_modes(exact: FrequencyResponses) -> Modes:
    """Poles and modal constants of exact accelerances, found row by row."""
    poles, constants = [], []
    for row in exact.accelerance:
        rational = AAA(exact.frequency, row, rtol=1e-12, max_terms=100)
        found = 2j * np.pi * rational.poles()
        square = -(found**2)
        frequency = np.sqrt(np.maximum(square.real, 0)) / (2 * np.pi)
        keep = (frequency > 40) & (frequency < 1024) & (found.imag > 0) & (np.abs(square.imag) < 0.5 * square.real)
        keep &= np.abs(rational.residues()) > 1e-6
        order = np.argsort(frequency[keep])
        poles.append(found[keep][order])
        constants.append((4j * np.pi * rational.residues()[keep] / found[keep])[order])
    disagreement = np.ptp(np.abs(poles), axis=0) / np.abs(poles[0])
    assert np.all(disagreement < 1e-7), f"rows disagree about the poles by {disagreement}"
    return Modes(np.mean(poles, axis=0), np.array(constants).T, POINTS)


def outcomes(exact: FrequencyResponses, true: Modes, pairs: int) -> Outcomes:
    """Estimate the modes of `pairs` pairs of opposite noise."""
    error = np.empty((pairs, 2, true.poles.size, 2))
    covered, shapes_covered = [], []
    for seed in range(pairs):
        rng = np.random.default_rng(seed)
        shape = exact.accelerance.shape
        noise = NOISE * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape))
        for sign in range(2):
            estimate = estimate_modes(replace(exact, accelerance=exact.accelerance + (-1) ** sign * noise))
            assert estimate.modes.poles.size == true.poles.size, f"{estimate.modes.poles.size} modes found"
            error[seed, sign] = values(estimate.modes) - values(true)
            covered.append(holds(estimate, true))
            shapes_covered.append(shape_coverage(estimate.modes, true))
    return Outcomes(error, np.array(covered, dtype=float), np.array(shapes_covered))


def values(modes: Modes) -> Real:
    """(modes, 2) frequency in Hz and loss factor."""
    return np.stack([modes.frequency, modes.loss_factor], axis=1)


def holds(estimate: ModalEstimate, true: Modes) -> Real:
    """(modes, 2) 1 where the 95 % interval holds the truth."""
    intervals = np.stack([estimate.frequency_ci95, estimate.loss_factor_ci95], axis=1)
    inside = (intervals[..., 0] <= values(true)) & (values(true) <= intervals[..., 1])
    return inside.astype(float)


def shape_coverage(modes: Modes, true: Modes) -> Real:
    """(modes,) share of real and imaginary parts of modal constants within 1.96 standard deviations of the truth."""
    assert modes.shape_covariance is not None
    error = modes.shapes - true.shapes
    parts = np.concatenate([error.real, error.imag], axis=1)
    deviation = np.sqrt(np.diagonal(modes.shape_covariance, axis1=1, axis2=2))
    return np.asarray(np.mean(np.abs(parts) < 1.96 * deviation, axis=1))


def cramer_rao(true: Modes) -> Real:
    """(modes, 2) smallest standard deviation of frequency and loss factor that any unbiased estimator can have.

    Unknown are poles, modal constants and one mass line a row; modes beyond the band are taken as known.
    """
    square = (2j * np.pi * FREQUENCY[:, None]) ** 2
    unit = square / (square - true.poles**2)
    linear = np.concatenate([unit, np.ones((FREQUENCY.size, 1))], axis=1)
    count = true.poles.size
    information = np.zeros((count, count), dtype=np.complex128)
    for constants in true.shapes.T:
        slope = unit / (square - true.poles**2) * constants  # by lambda^2
        rest = slope - linear @ np.linalg.lstsq(linear, slope, rcond=None)[0]
        information += rest.conj().T @ rest / (2 * NOISE**2)
    # a complex parameter z = lambda^2 has variance v / 2 in each part
    spread = np.sqrt(np.linalg.inv(information).diagonal().real / 2)
    stiffness = (2 * np.pi * true.frequency) ** 2
    by_frequency = spread / (8 * np.pi**2 * true.frequency)
    return np.stack([by_frequency, spread / stiffness * np.sqrt(1 + true.loss_factor**2)], axis=1)


def print_table(bench: SimulatedBench, true: Modes, found: Outcomes, bound: Real) -> None:
    """One row a mode."""
    mean = np.mean(found.error, axis=1)
    relative = 100 / values(true)
    bias, uncertain = np.mean(mean, axis=0) * relative, np.std(mean, axis=0) * relative / np.sqrt(len(mean))
    variance = np.mean((found.error - np.mean(mean, axis=0)) ** 2, axis=(0, 1)) / bound**2
    covered = 100 * np.mean(found.covered, axis=0)
    shapes = 100 * np.mean(found.shapes_covered, axis=0)
    stated = np.stack([bench.truth()["modes"][name] for name in ("frequency_hz", "loss_factor")], axis=1)
    apart = (values(true) - stated) * relative
    sampling = 100 * np.sqrt(2 / len(mean))
    print(f"  {'true':>17} {'bias, %':>38} {'variance/bound':>16} {'held, %':>15} {'from truth(), %':>18}")
    print(f"  {'Hz':>8} {'eta':>8} {'f':>18} {'eta':>20} {'f':>8} {'eta':>7} {'f':>7} eta   A {'f':>10} {'eta':>8}")
    for r in range(true.poles.size):
        print(
            f"  {true.frequency[r]:8.3f} {true.loss_factor[r]:8.5f} "
            + " ".join(f"{b:+10.5f} +- {u:.5f}" for b, u in zip(bias[r], uncertain[r], strict=True))
            + f" {variance[r, 0]:8.3f} {variance[r, 1]:7.3f} "
            + f"{covered[r, 0]:7.1f} {covered[r, 1]:.1f} {shapes[r]:.1f} "
            + f"{apart[r, 0]:+10.4f} {apart[r, 1]:+8.4f}"
        )
    print(f"  all: variance {np.mean(variance):.3f} of the bound (each of them known to {sampling:.0f} %)", end="")
    print(f", held {np.mean(covered):.1f} %, modal constants {np.mean(shapes):.1f} %", flush=True)


if __name__ == "__main__":
    main()
