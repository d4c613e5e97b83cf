"""Monte Carlo of the likelihood route on the simulated beam: bias, scatter against the Cramer-Rao bound, coverage.

    python -m tests.bench bench_joint_likelihood                         # 300 runs of each kind of bench
    python -m tests.bench.bench_joint_likelihood --runs 50 --bench drawn  # fewer, of one kind

The beam of the data is the simulation's: a series from each support, and from the sensor, to the next, which shares no
mesh with the model and is exact to a five-hundredth of the noise of a line. It stands on structurally damped joints
whose truth is known exactly. Noise is 0.003 (m/s^2)/N a line, and every fit starts 20 % off.
"""

import argparse
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from analysis.dof import Direction, Dof
from analysis.frequency_response import Complex, FrequencyResponses, Real
from analysis.inverse.frequency_law import FrequencyLaw
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.inverse.regression import TERMS
from analysis.inverse.tolerances import EXACT, Deviations, Tolerances
from analysis.structure.beam import Beam, Mesh
from analysis.structure.converged import assemble_converged
from analysis.structure.joints import Cylinder, Joint, joint_from_cylinders
from analysis.structure.setup import RIGID_MODES
from jointlab.identification.structure import ELEMENTS_BETWEEN_NODES
from simlab.article import NODE_POSITIONS
from simlab.beam import Load, SimulatedBeam, free_modes
from simlab.coupling import CoupledBeam, block_diagonal

BEAM = SimulatedBeam(terms=24)
DRAWN = Beam(BEAM.length, BEAM.height, BEAM.width, BEAM.youngs_modulus, BEAM.poisson_ratio, BEAM.density)
NODES = np.array(NODE_POSITIONS)
SENSOR = Dof.parse("3y")
INPUTS = tuple(map(Dof.parse, ["1y", "3y", "4y", "5y", "6y", "7y", "8y", "9y", "11y", "1x", "11x"]))
FREQUENCY: Real = np.linspace(20.0, 1024.0, 2009)
NOISE = 0.003
RUNS = 300
STATED = Tolerances(0.005, 0.005, 0.003, 0.001, 0.001, 0.0015)
SHOWN = ("k12(I)", "k22(I)", "h12(I)", "h22(I)", "k12(II)", "k22(II)", "h12(II)", "h22(II)", "sum k11", "sum h11")


@dataclass(frozen=True)
class Kind:
    """A kind of bench, and what it deviates by."""

    title: str
    tolerances: Tolerances


KINDS: Mapping[str, Kind] = {
    "drawn": Kind("Bench as drawn", EXACT),
    "loose": Kind("All tolerances loose", STATED),
    "following": Kind("As drawn, joints follow a power of frequency", Tolerances(joint_law=FrequencyLaw.POWER)),
}


@dataclass(frozen=True)
class Held:
    """A joint of the data: `stiffness` (3, 3) at 100 Hz, times a power of frequency."""

    position: float
    stiffness: Complex
    exponent: float

    def dynamic_stiffness(self, frequency: Real) -> Complex:
        """(lines, 3, 3) k + ih."""
        return np.asarray((np.asarray(frequency) / 100.0)[:, None, None] ** self.exponent * self.stiffness)


@dataclass(frozen=True)
class Row:
    """One term over all runs, in per cent of its size (exponents: times 100); `coverage` as a share."""

    term: str
    bias: float
    scatter: float
    bound: float
    variance_ratio: float
    coverage: float


@dataclass(frozen=True)
class Result:
    """What a Monte Carlo gives; `bands` is the coverage of the predicted accelerances' real and imaginary parts."""

    rows: tuple[Row, ...]
    bands: float
    converged: int
    runs: int
    seconds: float  # of processor time a fit, median


def joints() -> tuple[Joint, Joint]:
    """Those of the paper's Table 2, about."""
    found = []
    for name, node, shear, compression, lean in (("I", 2, 0.36e6, 2.30e6, -45.0), ("II", 10, 0.49e6, 2.70e6, 45.0)):
        cylinder = Cylinder(shear * (1 + 0.12j), compression * (1 + 0.11j), 20.0 * (1 + 0.1j))
        angles = np.radians([lean, lean - np.sign(lean) * 180])
        found.append(joint_from_cylinders(name, node, (cylinder, cylinder), angles, 0.006))
    return found[0], found[1]


def monte_carlo(runs: int, kind: Kind) -> Result:
    """Fit `runs` simulated measurements; with tolerances each bench deviates from the drawing by a draw of its own."""
    mesh = Mesh.through(NODES, ELEMENTS_BETWEEN_NODES)
    ratios = np.full(mesh.degrees - RIGID_MODES, BEAM.damping_ratios[-1])  # as the simulation has it
    ratios[: len(BEAM.damping_ratios)] = BEAM.damping_ratios
    model = assemble_converged(DRAWN, mesh, ratios.tolist())
    exact = joints()
    truth = _shown(np.array([joint.dynamic_stiffness for joint in exact]))
    sizes = kind.tolerances.deviations(SENSOR, INPUTS, len(exact))
    errors, deviations, bands, seconds, converged = [], [], [], [], 0
    for run in range(runs):
        rng = np.random.default_rng([run, 11])
        off = Deviations(sizes * np.clip(rng.standard_normal(sizes.size), -3, 3), len(exact))
        without_noise = measured(off, exact)
        parts = rng.standard_normal((2, *without_noise.shape))
        noisy = without_noise + NOISE * (parts[0] + 1j * parts[1])
        variance = np.full(noisy.shape, NOISE**2)
        responses = FrequencyResponses(FREQUENCY, noisy, SENSOR, INPUTS, variance=variance)
        started = time.process_time()
        starts = [_off(joint, rng) for joint in exact]
        fit = identify_from_responses(model, responses, starts, tolerances=kind.tolerances)
        seconds.append(time.process_time() - started)
        converged += fit.checks[-1].passed
        of_joints = _shown(np.array([found.joint.dynamic_stiffness for found in fit.joints.values()])) - truth
        exponents = [law["exponent"] for law in fit.law_parameters.values()]
        of_exponents = [each.value - true for each, true in zip(exponents, off.joint_laws[0], strict=False)]
        errors.append([*of_joints, *of_exponents])
        deviations.append([*_deviations(fit), *(each.standard_error for each in exponents)])
        band = fit.predicted
        left = without_noise - band.responses.accelerance
        for part, deviation in ((left.real, band.real_deviation), (left.imag, band.imaginary_deviation)):
            bands.append(np.mean(np.abs(part) <= 1.959964 * deviation))
    names = (*SHOWN, "exponent(I)", "exponent(II)")
    error, bound = np.array(errors), np.array(deviations)
    unit = np.append(np.abs(truth), [1.0, 1.0])
    inside = np.mean(np.abs(error) < 1.959964 * bound, axis=0)
    rows = tuple(
        Row(
            term=names[n],
            bias=float(100 * np.mean(error[:, n]) / unit[n]),
            scatter=float(100 * np.std(error[:, n], ddof=1) / unit[n]),
            bound=float(100 * np.sqrt(np.mean(bound[:, n] ** 2)) / unit[n]),
            variance_ratio=float(np.var(error[:, n], ddof=1) / np.mean(bound[:, n] ** 2)),
            coverage=float(inside[n]),
        )
        for n in range(error.shape[1])
    )
    return Result(rows, float(np.mean(bands)), converged, runs, float(np.median(seconds)))


def table(result: Result) -> str:
    """The result as text."""
    lines = [f"{'term':13}{'bias %':>10}{'scatter %':>11}{'bound %':>10}{'var ratio':>11}{'coverage':>10}"]
    lines += [
        f"{row.term:13}{row.bias:10.4f}{row.scatter:11.4f}{row.bound:10.4f}{row.variance_ratio:11.2f}{row.coverage:10.3f}"
        for row in result.rows
    ]
    lines.append(
        f"a ratio is known to {np.sqrt(2 / result.runs):.2f}, a coverage to {np.sqrt(0.0475 / result.runs):.3f}; "
        f"{result.converged} of {result.runs} converged from 20 % off; predicted accelerances covered "
        f"{result.bands:.3f}; {result.seconds:.2f} s of processor time a fit of {len(INPUTS)} x {FREQUENCY.size} lines"
    )
    return "\n".join(lines)


def measured(off: Deviations, exact: tuple[Joint, Joint]) -> Complex:
    """(rows, lines) accelerances of a deviating bench without noise, by the simulation's own beam."""
    supports = {
        joint.name: Held(float(NODES[joint.node - 1] + place), joint.dynamic_stiffness, float(exponent))
        for joint, place, exponent in zip(exact, off.joint_positions, off.joint_laws[0], strict=True)
    }
    sensor = float(NODES[SENSOR.node - 1] + off.sensor_position)
    beam = replace(
        BEAM,
        youngs_modulus=BEAM.youngs_modulus * (1 + off.youngs_modulus),
        density=BEAM.density * (1 + off.density),
        kinks=tuple(sorted({sensor, *(support.position for support in supports.values())})),
    )
    modes = free_modes(beam)
    places = np.array([modes.shape(d, each.position) for each in supports.values() for d in "xyr"])
    coupled = CoupledBeam(modes, places, np.asarray(2 * np.pi * FREQUENCY, dtype=complex))
    held = block_diagonal([each.dynamic_stiffness(FREQUENCY) for each in supports.values()], FREQUENCY.size)
    rows = []
    for point, beside in zip(INPUTS, off.blow_positions, strict=True):
        node = float(NODES[point.node - 1])
        if point.direction is Direction.X:
            load = Load(node, x=1.0, r=-float(beside))
        else:
            place = abs(node + float(beside))
            load = Load(min(place, 2 * BEAM.length - place), y=1.0)  # no blow lands beside the beam
        rows.append(coupled.accelerance(modes.shape("y", sensor), load.in_plane(modes)[None], held)[0])
    return np.asarray(np.array(rows) * (1 + off.gain))


def _shown(stiffness: Complex) -> Real:
    """(10,) the terms of `SHOWN` of both joints' z (2, 3, 3)."""
    each = [part for z in stiffness for part in (z[0, 1].real, z[1, 1].real, z[0, 1].imag, z[1, 1].imag)]
    total = complex(np.sum(stiffness[:, 0, 0]))
    return np.array([*each, total.real, total.imag])


def _deviations(fit: JointFit) -> Real:
    """(10,) standard deviations of the terms of `SHOWN`."""
    deviation = np.sqrt(np.diag(fit.terms_covariance)).reshape(2, len(TERMS))
    places = [TERMS.index(term) for term in ("k12", "k22", "h12", "h22")]
    return np.array([*deviation[:, places].ravel(), *np.sqrt(np.diag(fit.sum_of(0, 0)[1]))])


def _off(joint: Joint, rng: np.random.Generator) -> Joint:
    """Each term of k and of h 20 % up or down."""
    up, down = (1 + 0.2 * np.sign(np.triu(rng.uniform(-1, 1, (3, 3)))) for _ in range(2))
    up, down = (np.triu(each) + np.triu(each, 1).T for each in (up, down))
    z = joint.dynamic_stiffness
    return replace(joint, dynamic_stiffness=z.real * up + 1j * z.imag * down)


def main(runs: int = RUNS, kinds: tuple[str, ...] = tuple(KINDS)) -> None:
    """Print a table for each kind of bench."""
    with threadpool_limits(limits=1):
        for name in kinds:
            print(f"{KINDS[name].title}, {runs} runs\n{table(monte_carlo(runs, KINDS[name]))}\n", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=RUNS)
    parser.add_argument("--bench", choices=tuple(KINDS), nargs="+", default=list(KINDS))
    given = parser.parse_args()
    main(given.runs, tuple(given.bench))
