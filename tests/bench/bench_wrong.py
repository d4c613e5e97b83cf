"""Benches with something that the model lacks: is a wrong joint ever shown with all checks passed?

    python -m tests.bench.bench_wrong --benches 10 --seconds 100      # again and again, until it says that all are done
    python -m tests.bench.bench_wrong --kinds clean "mass at a joint"

Twelve kinds of unmodelled thing in three sizes, and clean benches, each with stated noise and without. Data are of the
exact beam of `exact_beam`. Benches are drawn: insets, cylinders, losses, noise, and all deviations within the stated
tolerances. A joint that is not one constant matrix is right with any value that it takes in the band. Results are kept
by the state of the code, so that a run in pieces goes on.
"""

import argparse
import hashlib
import sys
import time
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from tempfile import gettempdir

import numpy as np
from pydantic import TypeAdapter

from analysis.dof import Direction, Dof
from analysis.frequency_response import Complex, FrequencyResponses, Real
from analysis.inverse.frequency_law import FrequencyLaw
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.inverse.tolerances import FREEHAND_LEAN, Deviations, Tolerances
from analysis.structure.beam import Mesh
from analysis.structure.converged import assemble_converged
from analysis.structure.joints import Cylinder, Joint, joint_from_cylinders
from analysis.structure.setup import RIGID_MODES
from tests.bench.bench_joint_likelihood import DRAWN, INPUTS, SENSOR, STATED
from tests.bench.exact_beam import Attached, Blow, exact_accelerance

ROOT = Path(__file__).resolve().parents[2]
CODE = ("analysis/inverse", "analysis/structure", "analysis/modal")
BENCHES = 10
FREQUENCY: Real = np.arange(20.0, 1024.0, 1.0)
TOLERANCES = replace(STATED, blow_lean=FREEHAND_LEAN, joint_law=FrequencyLaw.AUTO)
RETARDATION = 7e-7
"""s, of the beam as drawn, E (1 + i w t): a loss factor of 0.002 at the second free mode."""
CLEAN = "clean"
CLEAN_SHARE = 4
"""Clean benches, as many times those of a kind and size."""
FAR = 4.0
"""Standard errors."""
UPPER = np.triu_indices(3)
Factor = Callable[[Real], Complex]


@dataclass(frozen=True, eq=False)
class Bench:
    """A bench as it is: constant joints at the places that `off` gives, within tolerances, and what is wrong with it.

    Attributes:
        nodes: (11,) as drawn, m.
        joints: at 100 Hz.
        off: deviations from the drawing.
        noise: (m/s^2)/N of a line, per real and imaginary part.
        loss: structural loss factor of the beam beside that of the drawing.
        factor: of the joints' stiffness at each frequency.
        at_sensor: mass (kg), stiffness (N/m) and damping (N s/m) of what hangs on the accelerometer.
        at_joint: mass at joint I, kg.
        base: mass (kg) and stiffness (N/m) of what joint I stands on; None where that is rigid.
    """

    nodes: Real
    joints: tuple[Joint, ...]
    off: Deviations
    noise: float
    loss: float = 0.0
    factor: Factor = lambda frequency: np.ones(frequency.size, dtype=complex)
    at_sensor: tuple[float, float, float] = (0.0, 0.0, 0.0)
    at_joint: float = 0.0
    base: tuple[float, float] | None = None

    def moved(self, at: int, by: float) -> "Bench":
        """The same with deviation number `at` changed."""
        values = self.off.values.copy()
        values[at] += by
        return replace(self, off=Deviations(values, self.off.joints))

    @property
    def right(self) -> Complex:
        """(any, joints, 3, 3) what the joints are: every value counts, and all between."""
        z = np.array([joint.dynamic_stiffness for joint in self.joints])
        found = self.factor(FREQUENCY[::20])[:, None, None, None] * z
        if self.base is not None:
            yielding = found.copy()
            yielding[:, 0] = _in_series(found[:, 0], np.full(len(found), self.base[1]))
            found = np.concatenate([found, yielding])
        return np.asarray(found)


Change = Callable[[Bench, float], Bench]


def _zener(strength: float) -> Factor:
    """Fractional Zener's law about 300 Hz, one at 100 Hz (R. L. Bagley, P. J. Torvik, J. Rheology 27, 1983)."""

    def law(frequency: Real) -> Complex:
        turned = np.sqrt(1j * frequency / 300.0)
        return np.asarray(1 + strength * turned / (1 + turned))

    return lambda frequency: law(frequency) / law(np.array([100.0]))


def power_law(exponent: float) -> Factor:
    """A power of frequency, one at 100 Hz."""
    return lambda frequency: np.asarray((1j * frequency / 100.0) ** exponent / 1j**exponent)


def _on_base(bench: Bench, share: float) -> Bench:
    """Joint I on 20 kg whose compliance is a share of the joint's own across the beam."""
    return replace(bench, base=(20.0, float(bench.joints[0].dynamic_stiffness[1, 1].real) / share))


LAST_ROW_LEAN = -1 - INPUTS[::-1].index(Dof.parse("9y"))
KINDS: dict[str, tuple[tuple[float, float, float], Change]] = {
    "mass at a joint": ((0.003, 0.01, 0.03), lambda bench, size: replace(bench, at_joint=size)),
    "accelerometer mass": ((0.002, 0.006, 0.02), lambda bench, size: replace(bench, at_sensor=(size, 0.0, 0.0))),
    "power of frequency": ((0.02, 0.05, 0.1), lambda bench, size: replace(bench, factor=power_law(size))),
    "fractional Zener": ((0.05, 0.15, 0.4), lambda bench, size: replace(bench, factor=_zener(size))),
    "Young's modulus": ((0.01, 0.02, 0.05), lambda bench, size: bench.moved(1, size)),
    "density": ((0.006, 0.015, 0.04), lambda bench, size: bench.moved(2, size)),
    "yielding base": ((0.01, 0.03, 0.1), _on_base),
    "place of a joint": ((0.002, 0.004, 0.01), lambda bench, size: bench.moved(4, size)),
    "place of the sensor": ((0.002, 0.004, 0.01), lambda bench, size: bench.moved(3, size)),
    "cable": ((1.0, 3.0, 10.0), lambda bench, size: replace(bench, at_sensor=(0.0, 300.0 * size, 0.3 * size))),
    "loss of the beam": ((0.001, 0.003, 0.01), lambda bench, size: replace(bench, loss=size)),
    "leaning blows": ((5.0, 10.0, 20.0), lambda bench, size: bench.moved(LAST_ROW_LEAN, np.radians(size))),
}


@dataclass(frozen=True)
class Case:
    """One fit: what is wrong and how much (0 to 2), the number of the bench, and whether noise is stated."""

    kind: str
    size: int
    bench: int
    stated: bool


def cases(kinds: Sequence[str], benches: int) -> Iterator[Case]:
    """All of them, every kind and size with one bench before the next bench."""
    for bench, stated in product(range(CLEAN_SHARE * benches), (True, False)):
        if CLEAN in kinds:
            yield Case(CLEAN, 0, bench, stated)
        if bench < benches:
            yield from (Case(kind, size, bench, stated) for kind in kinds if kind != CLEAN for size in range(3))


def drawn_bench(rng: np.random.Generator) -> Bench:
    """One within its tolerances."""
    inset = rng.uniform(0.045, 0.16, 2)
    nodes = np.array([0.0, *np.linspace(inset[0], DRAWN.length - inset[1], 9), DRAWN.length])
    joints = []
    for name, node, lean in (("I", 2, -45.0), ("II", 10, 45.0)):
        shear, compression = 0.42e6 * np.exp(rng.uniform(-0.6, 0.6)), 2.5e6 * np.exp(rng.uniform(-0.6, 0.6))
        lossy = 1 + 1j * rng.uniform(0.05, 0.15, 3)
        cylinder = Cylinder(shear * lossy[0], compression * lossy[1], rng.uniform(6.0, 30.0) * lossy[2])
        angles = np.radians([lean, lean + 180.0]) + np.radians(0.5) * rng.standard_normal()
        joints.append(joint_from_cylinders(name, node, (cylinder, cylinder), angles, 0.006))
    sizes = TOLERANCES.deviations(SENSOR, INPUTS, len(joints))
    off = Deviations(sizes * np.clip(rng.standard_normal(sizes.size), -2.5, 2.5), len(joints))
    return Bench(nodes, tuple(joints), off, float(np.exp(rng.uniform(np.log(0.001), np.log(0.01)))))


def accelerance_of(bench: Bench) -> Complex:
    """(rows, lines) without noise."""
    off, omega = bench.off, 2 * np.pi * FREQUENCY
    beam = replace(
        DRAWN, youngs_modulus=DRAWN.youngs_modulus * (1 + off.youngs_modulus), density=DRAWN.density * (1 + off.density)
    )
    sensor = float(bench.nodes[SENSOR.node - 1] + off.sensor_position)
    mass, stiffness, damping = bench.at_sensor
    hung = stiffness + 1j * omega * damping - mass * omega**2
    attached = [Attached(sensor, np.asarray(hung[:, None, None] * np.diag([1.0, 1.0, 0.0]), dtype=complex))]
    for number, (joint, moved) in enumerate(zip(bench.joints, off.joint_positions.tolist(), strict=True)):
        z = bench.factor(FREQUENCY)[:, None, None] * joint.dynamic_stiffness
        if number == 0:
            if bench.base is not None:
                ground: Complex = np.asarray(bench.base[1] * (1 + 0.02j) - bench.base[0] * omega**2)
                z = _in_series(z, ground)
            z = z - bench.at_joint * omega[:, None, None] ** 2 * np.diag([1.0, 1.0, 0.0])
        attached.append(Attached(float(bench.nodes[joint.node - 1] + moved), z))
    blows = []
    for point, beside, lean in zip(INPUTS, off.blow_positions.tolist(), off.blow_leans.tolist(), strict=True):
        node = float(bench.nodes[point.node - 1])
        if point.direction is Direction.X:
            blows.append(Blow(node, x=1.0, y=lean, r=-beside))
        else:
            place = abs(node + beside)
            blows.append(Blow(min(place, 2 * DRAWN.length - place), x=lean, y=1.0))
    time_constant = RETARDATION * np.sqrt((1 + off.density) / (1 + off.youngs_modulus))  # same damping ratios
    modulus: Complex = np.asarray(beam.youngs_modulus * (1 + 1j * omega * time_constant + 1j * bench.loss))
    return (1 + off.gain) * exact_accelerance(beam, modulus, FREQUENCY, sensor, blows, attached)


def fitted(bench: Bench, rng: np.random.Generator, stated: bool, tolerances: Tolerances = TOLERANCES) -> JointFit:
    """From joints some 20 % off, on the beam as drawn."""
    clean = accelerance_of(bench)
    parts = rng.standard_normal((2, *clean.shape))
    variance = np.full(clean.shape, bench.noise**2) if stated else None
    noisy = clean + bench.noise * (parts[0] + 1j * parts[1])
    responses = FrequencyResponses(FREQUENCY, noisy, SENSOR, INPUTS, variance=variance)
    mesh = Mesh.through(bench.nodes, 8)
    natural = 2 * np.pi * assemble_converged(DRAWN, mesh).frequency[RIGID_MODES:]
    model = assemble_converged(DRAWN, mesh, np.minimum(natural * RETARDATION / 2, 0.99).tolist())
    start = [replace(each, dynamic_stiffness=rng.uniform(0.8, 1.25) * each.dynamic_stiffness) for each in bench.joints]
    return identify_from_responses(model, responses, start, tolerances=tolerances)


@dataclass(frozen=True)
class Answer:
    """What is kept of one fit: failed checks, and of each term shown its error over the standard error, whether its
    interval holds, and the half-width of that over the term."""

    failed: list[str]
    far: list[float]
    inside: list[bool]
    width: list[float]


ANSWER = TypeAdapter(Answer)


def answer(case: Case) -> Answer:
    """Draw a bench, measure it and fit."""
    rng = np.random.default_rng([case.bench, 19])
    bench = drawn_bench(rng)
    if case.kind != CLEAN:
        sizes, change = KINDS[case.kind]
        bench = change(bench, sizes[case.size])
    rng = np.random.default_rng([case.bench, case.size, zlib.crc32(case.kind.encode())])
    fit = fitted(bench, rng, case.stated)
    far, inside, width = [], [], []
    right = bench.right
    for number, joint in enumerate(fit.joints.values()):
        shown = joint.observable[UPPER]
        deviation = np.sqrt(np.diag(joint.covariance)).reshape(2, -1)
        for half, (value, ends, part) in enumerate(
            ((joint.stiffness, joint.k_ci95, right.real), (joint.damping, joint.h_ci95, right.imag))
        ):
            own = part[:, number][:, *UPPER]
            least, most = np.min(own, axis=0), np.max(own, axis=0)
            low, high = ends[UPPER].T
            gap = np.maximum(0.0, np.maximum(least - value[UPPER], value[UPPER] - most))
            far += (gap / deviation[half])[shown].tolist()
            inside += ((low <= most) & (least <= high))[shown].tolist()
            width += ((high - low) / 2 / np.abs(value[UPPER]))[shown].tolist()
    return Answer([check.name for check in fit.all_checks if not check.passed], far, inside, width)


def main(arguments: Sequence[str] = ()) -> None:
    """Fit what is not fitted yet, for as long as is allowed, and print the figures of all that is."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.bench_wrong", description=__doc__)
    parser.add_argument("--benches", type=int, default=BENCHES, help="of each kind and size")
    parser.add_argument("--kinds", nargs="*", default=[CLEAN, *KINDS], choices=[CLEAN, *KINDS])
    parser.add_argument("--seconds", type=float, default=np.inf, help="after which no further fit begins")
    parser.add_argument("--cache", type=Path, default=Path(gettempdir()) / "jointlab-wrong")
    given = parser.parse_args(arguments)
    folder = given.cache / _state_of_code()
    folder.mkdir(parents=True, exist_ok=True)
    ends, found, left = time.monotonic() + given.seconds, dict[Case, Answer](), 0
    for case in cases(given.kinds, given.benches):
        file = folder / f"{case.kind}-{case.size}-{case.bench}-{case.stated}.json"
        if not file.exists():
            if time.monotonic() > ends:
                left += 1
                continue
            partial = file.with_suffix(".part")
            partial.write_bytes(ANSWER.dump_json(answer(case)))
            partial.replace(file)
        found[case] = ANSWER.validate_json(file.read_bytes())
    print(table(found))
    print(f"{left} cases are left: run it again" if left else f"all {len(found)} cases are done")


def table(found: dict[Case, Answer]) -> str:
    """A line for each kind and size, then sums."""
    groups: dict[str, list[Case]] = {}
    for case in found:
        groups.setdefault(f"{case.kind} {KINDS[case.kind][0][case.size] if case.kind in KINDS else ''}", []).append(
            case
        )
    for noise in (True, False):
        for clean in (True, False):
            name = f"all {'clean' if clean else 'wrong'}, noise {'stated' if noise else 'not stated'}"
            groups[name] = [case for case in found if case.stated is noise and (case.kind == CLEAN) is clean]
    lines = [f"{'':<38}{'fits':>5}{'passed':>8}{'shown':>7}{'far off %':>11}{'hold %':>8}{'width %':>9}  failed"]
    for name, members in groups.items():
        passed = [found[case] for case in members if not found[case].failed]
        far, inside, width = (
            np.array([value for each in passed for value in getattr(each, what)]) for what in ("far", "inside", "width")
        )
        checks = [each.split(" of ")[0] for case in members for each in found[case].failed]
        figures = (
            f"{100 * np.mean(far > FAR):11.1f}{100 * np.mean(inside):8.1f}{100 * np.median(width):9.2f}"
            if passed
            else f"{'-':>11}{'-':>8}{'-':>9}"
        )
        counts = ", ".join(f"{checks.count(each)} {each}" for each in sorted(set(checks)))
        lines.append(f"{name:<38}{len(members):5}{len(passed):8}{far.size:7}{figures}  {counts}")
    return "\n".join(lines)


def _state_of_code() -> str:
    """Names what an answer depends on."""
    files = [Path(__file__), *(each for part in CODE for each in sorted((ROOT / part).glob("*.py")))]
    return hashlib.sha256(b"".join(each.read_bytes() for each in files)).hexdigest()[:12]


def _in_series(stiffness: Complex, base: Complex | Real) -> Complex:
    """(n, 3, 3) of a joint whose ground yields along and across the beam, with `base` (n,) each way."""
    held = base[:, None, None] * np.eye(2)
    inner = np.linalg.inv(stiffness[:, :2, :2] + held)
    return np.asarray(stiffness - stiffness[:, :, :2] @ inner @ stiffness[:, :2])


if __name__ == "__main__":
    main(sys.argv[1:])
