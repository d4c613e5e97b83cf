"""Monte Carlo of the likelihood route: bias, scatter against the Cramer-Rao bound, and coverage.

`python -m tests.bench bench_joint_likelihood`. Data come from a mesh finer than the model's, with
noise of 0.003 (m/s^2)/N a line and a start 20 % off in every run.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from analysis.dof import Direction, Dof
from analysis.frequency_response import Complex, FrequencyResponses, Real
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.inverse.regression import TERMS
from analysis.inverse.tolerances import EXACT, Deviations, Tolerances
from analysis.structure.beam import Beam, FreeBeam, Mesh, assemble
from analysis.structure.forward import accelerance
from analysis.structure.joints import Cylinder, Joint, joint_from_cylinders

BAR = Beam(0.914, 0.0254, 1290e-6 / 0.0254, 207e9, 0.3, 7850.0)
NODES = np.round([0.0, *np.linspace(0.055, 0.859, 9), 0.914], 9)
RATIOS = (0.004, 0.001, 0.001)
SENSOR = Dof.parse("3y")
INPUTS = tuple(map(Dof.parse, ["1y", "3y", "4y", "5y", "6y", "7y", "8y", "9y", "11y", "1x", "11x"]))
FREQUENCY: Real = np.linspace(20.0, 1024.0, 2009)
NOISE = 0.003
RUNS = 300
STATED = Tolerances(0.005, 0.005, 0.003, 0.001, 0.001, 0.0015)
SHOWN = ("k12(I)", "k22(I)", "h12(I)", "h22(I)", "k12(II)", "k22(II)", "h12(II)", "h22(II)", "sum k11", "sum h11")


@dataclass(frozen=True)
class Row:
    """One term over all runs, in per cent of its true value; `coverage` as a share."""

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


def monte_carlo(runs: int, tolerances: Tolerances = EXACT, model_elements: int = 32, data_elements: int = 48) -> Result:
    """Fit `runs` simulated measurements; with tolerances each bench deviates from the drawing by a draw of its own."""
    model = assemble(BAR, Mesh.through(NODES, model_elements), damping_ratios=RATIOS)
    exact = joints()
    truth = _shown(np.array([joint.dynamic_stiffness for joint in exact]))
    known = None if np.any(_sizes(tolerances)) else _measured(Deviations.none(2, len(INPUTS)), exact, data_elements)
    errors, deviations, bands, seconds, converged = [], [], [], [], 0
    for run in range(runs):
        rng = np.random.default_rng([run, 11])
        without_noise = known
        if without_noise is None:
            off = Deviations(_sizes(tolerances) * np.clip(rng.standard_normal(6 + len(INPUTS)), -3, 3), 2)
            without_noise = _measured(off, exact, data_elements)
        parts = rng.standard_normal((2, *without_noise.shape))
        noisy = without_noise + NOISE * (parts[0] + 1j * parts[1])
        variance = np.full(noisy.shape, NOISE**2)
        responses = FrequencyResponses(FREQUENCY, noisy, SENSOR, INPUTS, variance=variance)
        started = time.process_time()
        fit = identify_from_responses(model, responses, [_off(joint, rng) for joint in exact], tolerances=tolerances)
        seconds.append(time.process_time() - started)
        converged += fit.gates[-1].passed
        errors.append(_shown(np.array([found.joint.dynamic_stiffness for found in fit.joints.values()])) - truth)
        deviations.append(_deviations(fit))
        for interval, part in ((fit.predicted.real_ci95, "real"), (fit.predicted.imaginary_ci95, "imag")):
            value = getattr(without_noise, part)
            bands.append(np.mean((interval[..., 0] <= value) & (value <= interval[..., 1])))
    error, bound = np.array(errors), np.array(deviations)
    inside = np.mean(np.abs(error) < 1.959964 * bound, axis=0)
    rows = tuple(
        Row(
            term=term,
            bias=float(100 * np.mean(error[:, n]) / abs(truth[n])),
            scatter=float(100 * np.std(error[:, n], ddof=1) / abs(truth[n])),
            bound=float(100 * np.sqrt(np.mean(bound[:, n] ** 2)) / abs(truth[n])),
            variance_ratio=float(np.var(error[:, n], ddof=1) / np.mean(bound[:, n] ** 2)),
            coverage=float(inside[n]),
        )
        for n, term in enumerate(SHOWN)
    )
    return Result(rows, float(np.mean(bands)), converged, runs, float(np.median(seconds)))


def table(result: Result) -> str:
    """The result as text."""
    lines = [f"{'term':10}{'bias %':>10}{'scatter %':>11}{'bound %':>10}{'var ratio':>11}{'coverage':>10}"]
    lines += [
        f"{row.term:10}{row.bias:10.4f}{row.scatter:11.4f}{row.bound:10.4f}{row.variance_ratio:11.2f}{row.coverage:10.3f}"
        for row in result.rows
    ]
    lines.append(
        f"{result.converged} of {result.runs} converged from 20 % off; predicted accelerances covered "
        f"{result.bands:.3f}; {result.seconds:.2f} s of processor time a fit of {len(INPUTS)} x {FREQUENCY.size} lines"
    )
    return "\n".join(lines)


def _sizes(tolerances: Tolerances) -> Real:
    return tolerances.deviations(SENSOR, INPUTS, 2)


def _shown(stiffness: Complex) -> Real:
    """(10,) the terms of `SHOWN` of both joints' z (2, 3, 3)."""
    each = [part for z in stiffness for part in (z[0, 1].real, z[1, 1].real, z[0, 1].imag, z[1, 1].imag)]
    total = complex(np.sum(stiffness[:, 0, 0]))
    return np.array([*each, total.real, total.imag])


def _deviations(fit: JointFit) -> Real:
    """(10,) standard deviations of the terms of `SHOWN`."""
    deviation = np.sqrt(np.diag(fit.terms_covariance)).reshape(2, len(TERMS))
    places = [TERMS.index(term) for term in ("k12", "k22", "h12", "h22")]
    return np.array([*deviation[:, places].ravel(), *fit.sum_of(0, 0)[1:]])


def _off(joint: Joint, rng: np.random.Generator) -> Joint:
    """Each term of k and of h 20 % up or down."""
    up, down = (1 + 0.2 * np.sign(np.triu(rng.uniform(-1, 1, (3, 3)))) for _ in range(2))
    up, down = (np.triu(each) + np.triu(each, 1).T for each in (up, down))
    z = joint.dynamic_stiffness
    return replace(joint, dynamic_stiffness=z.real * up + 1j * z.imag * down)


def _measured(off: Deviations, exact: tuple[Joint, Joint], elements: int) -> Complex:
    """Accelerances of a deviating bench without noise, from a mesh with nodes where things really are."""
    beam = replace(
        BAR, youngs_modulus=BAR.youngs_modulus * (1 + off.youngs_modulus), density=BAR.density * (1 + off.density)
    )
    distances = zip(INPUTS, off.blow_positions, strict=True)
    blows = [round(float(abs(NODES[point.node - 1] + d)), 9) for point, d in distances]
    blows = [min(place, 2 * BAR.length - place) for place in blows]  # no blow lands beside the beam
    sensor = round(float(NODES[SENSOR.node - 1] + off.sensor_position), 9)
    supports = [round(float(NODES[joint.node - 1] + d), 9) for joint, d in zip(exact, off.joint_positions, strict=True)]
    places: NDArray[np.float64] = np.unique([0.0, BAR.length, sensor, *supports, *blows])
    node = {place: number for number, place in enumerate(places.tolist(), start=1)}
    per_gap = elements if not np.any(off.values) else max(4, elements // 2)
    free: FreeBeam = assemble(beam, Mesh.through(places, per_gap), damping_ratios=RATIOS)
    held = [replace(joint, node=node[x]) for joint, x in zip(exact, supports, strict=True)]
    inputs = [Dof(node[x], point.direction) for point, x in zip(INPUTS, blows, strict=True)]
    found = accelerance(free, held, FREQUENCY, Dof(node[sensor], Direction.Y), inputs)
    return np.asarray(found.accelerance * (1 + off.gain))


def main() -> None:
    """Print both tables."""
    with threadpool_limits(limits=1):
        for title, tolerances in (("Bench as drawn", EXACT), ("All tolerances loose", STATED)):
            print(f"{title}, {RUNS} runs\n{table(monte_carlo(RUNS, tolerances))}\n", flush=True)
