"""Benches and structures drawn at random, nothing like the paper's: does identification answer, and do intervals hold?

Benches have four to twelve nodes, one to three joints anywhere, k from 3 to 300 EI/L^3, and noise from 1e-4 to 5 % of
the median accelerance. Data are of the model's own mesh: what is tried here is the search, not the mesh. No search
starts from the true joints.

Structures have one to eight modes with loss factors from 3e-4 to 0.2; of some the modes move from row to row, or
within an average, so that no modal model holds, and of some the noise is next to none or not stated.
"""

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from analysis.dof import Direction, Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, FrequencyResponses, Real
from analysis.inverse.coarse_search import coarse_joints
from analysis.inverse.identification import components_of, identify_joints
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.inverse.validity_checks import MISFIT
from analysis.modal.estimation import estimate_modes
from analysis.structure.beam import Beam, FreeBeam, Mesh
from analysis.structure.converged import assemble_converged
from analysis.structure.forward import accelerance
from analysis.structure.joints import Joint
from tests.analysis.inverse.laboratory import drawn_as_springs

BENCHES, STRUCTURES = 60, 250
LINES = np.linspace(0.0, 1024.0, 2049)
INPUTS = tuple(Dof(node, Direction.Y) for node in range(1, 12))
EXACT = 1e-7  # (m/s^2)/N, stated where there is no noise


@dataclass(frozen=True)
class DrawnBench:
    """A bench and its accelerances."""

    model: FreeBeam
    joints: tuple[Joint, ...]
    responses: FrequencyResponses


def main() -> None:
    """Print how many fits pass their checks and which intervals hold, then how structures were answered."""
    for title, from_modes in (("from the paper's method, then the search", True), ("from the search alone", False)):
        began = time.perf_counter()
        tally = Counter[str]()
        for seed in range(BENCHES):
            bench = drawn_bench(seed)
            fit = fitted(bench, from_modes)
            tally += counted(fit, bench.joints)
        print(f"started {title}, {BENCHES} benches in {time.perf_counter() - began:.0f} s: {dict(tally)}")
        print(
            f"of the {tally['intervals']} intervals of those that pass "
            f"{100 * tally['hold'] / tally['intervals']:.1f} % hold"
        )
    answers = Counter(answer(seed) for seed in range(STRUCTURES))
    for kind in sorted({kind for kind, _ in answers}):
        row = ", ".join(f"{answers[kind, what]} {what}" for what in ("all modes", "other modes", "refused"))
        print(f"{kind:<24}{row}")


def counted(fit: JointFit, joints: Sequence[Joint]) -> Counter[str]:
    """What one fit adds to the figures."""
    found = Counter({"at rest": int(fit.checks[-1].passed), "passed": int(fit.passed)})
    found["in a wrong valley"] = int(np.mean(fit.chi_square_per_row) > MISFIT)
    found.update(f"failed: {check.name}" for check in fit.all_checks if not check.passed)
    if fit.passed:
        inside = [each for joint in joints for each in holds(fit, joint)]
        found.update({"intervals": len(inside), "hold": sum(inside)})
    return found


def drawn_bench(seed: int) -> DrawnBench:
    """A bench by its number."""
    rng = np.random.default_rng(seed)
    length = rng.uniform(0.3, 2.0)
    material = ((70e9, 2700.0), (207e9, 7850.0))[rng.integers(2)]
    height, width = 0.05 * length * rng.uniform(0.3, 1.0), 0.05 * length * rng.uniform(0.5, 1.5)
    beam = Beam(length, height, width, youngs_modulus=material[0], poisson_ratio=0.3, density=material[1])
    places = np.sort(rng.uniform(0.08, 0.92, rng.integers(3, 11)))
    places = np.concatenate([[0.0], places[np.diff(places, prepend=0.0) > 0.02], [1.0]]) * length
    nodes = np.sort(
        rng.choice(np.arange(2, places.size), min(int(rng.choice([1, 2, 2, 2, 3])), places.size - 2), False)
    )
    joints = tuple(drawn_joint(rng, f"J{node}", int(node), beam) for node in nodes)
    model = assemble_converged(beam, Mesh.through(places, 8), damping_ratios=(0.004, 0.001, 0.001))
    across = [Dof(node, Direction.Y) for node in range(1, places.size + 1) if node not in nodes]
    inputs = (*across, Dof(1, Direction.X), Dof(places.size, Direction.X))
    first_free = 4.73**2 / (2 * np.pi) * np.sqrt(material[0] / material[1] * height**2 / 12) / length**2
    frequency = np.linspace(0.005, 1.0, 900) * min(4000.0, 2.5 * first_free * rng.uniform(0.9, 3.0))
    exact = accelerance(model, joints, frequency, across[rng.integers(len(across))], inputs)
    noise = float(np.median(np.abs(exact.accelerance)) * rng.choice([1e-4, 1e-3, 1e-2, 5e-2]))
    stated = np.full(exact.accelerance.shape, noise**2) if rng.random() < 0.8 else None
    return DrawnBench(model, joints, replace(exact, accelerance=noisy(rng, exact.accelerance, noise), variance=stated))


def drawn_joint(rng: np.random.Generator, name: str, node: int, beam: Beam) -> Joint:
    """One whose matrix is positive, with one loss factor."""
    k = beam.flexural_rigidity / beam.length**3 * 10 ** rng.uniform(0.5, 2.5)
    lever = beam.length / 40
    matrix = np.diag([rng.uniform(0.3, 3.0), 1.0, lever**2 * rng.uniform(0.3, 3.0)])
    matrix[0, 1] = matrix[1, 0] = 0.5 * rng.uniform(-0.5, 0.5)
    matrix[0, 2] = matrix[2, 0] = 0.1 * lever * rng.uniform(-1.0, 1.0)
    return Joint(name, node, np.asarray(k * matrix * (1 + 1j * rng.uniform(0.02, 0.3)), dtype=np.complex128))


def fitted(bench: DrawnBench, from_modes: bool) -> JointFit:
    """By likelihood, started from the paper's method where that is wanted and possible, then from a search."""
    band = (float(bench.responses.frequency[0]), float(bench.responses.frequency[-1]))
    starts = started(bench, band, from_modes)
    return identify_from_responses(bench.model, bench.responses, next(starts), other_starts=starts, band=band)


def started(bench: DrawnBench, band: tuple[float, float], from_modes: bool) -> Iterator[Sequence[Joint]]:
    """Joints to start from, by the data and the drawing alone: of the true joints only names and nodes are read."""
    nodes = {joint.name: joint.node for joint in bench.joints}
    components = components_of(list(nodes.values()), len(bench.model.mesh.named), bench.responses.inputs)
    if from_modes:
        with suppress(AnalysisError):  # too few modes or points
            modes = estimate_modes(bench.responses, band).modes
            yield [joint.joint for joint in identify_joints(bench.model, modes, nodes, components).values()]
    drawn = [drawn_as_springs(name, node, bench.model) for name, node in nodes.items()]
    yield from coarse_joints(bench.model, bench.responses, drawn, band)


def holds(fit: JointFit, joint: Joint) -> list[bool]:
    """Whether each of the 12 intervals of a joint's terms holds the truth."""
    upper = np.triu_indices(3)
    found, inside = fit.joints[joint.name], []
    for ends, true in ((found.k_ci95, joint.dynamic_stiffness.real), (found.h_ci95, joint.dynamic_stiffness.imag)):
        low, high = ends[upper].T
        inside += ((low <= true[upper]) & (true[upper] <= high)).tolist()
    return inside


def answer(seed: int) -> tuple[str, str]:
    """Kind of a drawn structure, and whether all of its modes were found, fewer or more of them, or it was refused."""
    rng = np.random.default_rng(seed)
    modes, rows = int(rng.integers(1, 9)), int(rng.integers(1, 12))
    frequency = np.sort(rng.uniform(30.0, 1000.0, modes))
    if modes > 1 and rng.random() < 0.3:
        frequency[1] = frequency[0] * (1 + rng.uniform(0.002, 0.05))
    loss_factor = 10 ** rng.uniform(-3.5, -0.7, modes)
    constants = rng.standard_normal((modes, 11)) * (1 + 0.05j * rng.standard_normal((modes, 11))) / 9
    noise, kind = (
        float(rng.choice([0.0, 1e-5, 1e-3, 0.03])),
        str(rng.choice(["steady", "moved between rows", "moved within rows"])),
    )
    moved = np.zeros(11) if kind == "steady" else rng.standard_normal(11) * rng.choice([1e-5, 1e-4, 1e-3])
    each = np.array(
        [accelerance_of(frequency * (1 + by), loss_factor, constants.astype(np.complex128)) for by in moved]
    )
    exact = np.mean(each, axis=0) if kind == "moved within rows" else each[np.arange(11), np.arange(11)]
    stated = np.full((rows, LINES.size), max(noise, EXACT) ** 2) if rng.random() < 0.6 else None
    responses = FrequencyResponses(LINES, noisy(rng, exact, noise)[:rows], INPUTS[0], INPUTS[:rows], variance=stated)
    try:
        found = estimate_modes(responses, (20.0, 1024.0)).modes.poles.size
    except AnalysisError:
        return kind, "refused"
    return kind, "all modes" if found == modes else "other modes"


def accelerance_of(frequency: Real, loss_factor: Real, constants: Complex) -> Complex:
    """(rows, lines) of modes with these constants (modes, rows)."""
    square = (2j * np.pi * LINES) ** 2
    stiffness = (2 * np.pi * frequency) ** 2 * (1 + 1j * loss_factor)
    return np.asarray(constants.T @ (square / (square + stiffness[:, None])))


def noisy(rng: np.random.Generator, exact: Complex, noise: float) -> Complex:
    """With noise in the real and in the imaginary part of every line."""
    return np.asarray(exact + noise * (rng.standard_normal(exact.shape) + 1j * rng.standard_normal(exact.shape)))


if __name__ == "__main__":
    main()
