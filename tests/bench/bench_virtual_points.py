"""What inverse substructuring without a beam model would give on the paper's beam, if five places of the accelerometer
were measured on the joints and on the suspended beam.

Points: x at an end, y at either side of each joint. Motions of the virtual points: x, which both share as the beam is
rigid along itself, and y and rotation of each. With A the (5, 5) accelerance over these motions, the joints are
-w^2 (A_on_joints^-1 - A_suspended^-1) (D. de Klerk, D. J. Rixen, S. N. Voormeeren, AIAA J. 46, 2008, 1169-1181).
Errors: noise of each line, and the gain of each mounting of the accelerometer.
"""

from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.structure.beam import Mesh, assemble
from tests.bench.paper_bench import BEAM

INSET = 0.105  # m, of the joints from the ends
SHEAR, COMPRESSION, ROTATION = 0.4e6 * (1 + 0.1j), 2.5e6 * (1 + 0.1j), 40.0 * (1 + 0.1j)
NOISE, GAIN = 0.003, 0.005  # (m/s^2)/N a line; relative, of each mounting
DRAWS = 60
LINES = np.arange(60.0, 141.0)  # Hz, where an average over lines is best
SINGLE = (20.0, 60.0, 100.0, 150.0, 200.0, 300.0, 500.0, 800.0)
TERMS = {"k22(I)": (1, 1), "k12(I)": (0, 1), "sum of k11": (0, 0), "k33(I)": (2, 2), "y(I) - y(II), zero": (1, 3)}


@dataclass(frozen=True, eq=False)
class Bench:
    """Accelerances (lines, 5, 5) over the virtual points, on the joints and suspended, and the true (5, 5) joints."""

    frequency: Real
    on_joints: Complex
    suspended: Complex
    true: Real

    @classmethod
    def of(cls, distance: float, frequency: Real) -> "Bench":
        left, right = INSET, BEAM.length - INSET
        places = [0.0, left - distance, left, left + distance, right - distance, right, right + distance, BEAM.length]
        mesh = Mesh.through(places, 3)
        beam = assemble(BEAM, mesh, damping_ratios=(0.004, 0.001, 0.001))
        stiff, coupling = SHEAR + COMPRESSION, COMPRESSION - SHEAR
        joints = np.zeros((beam.mass.shape[0],) * 2, dtype=complex)
        true = np.zeros((5, 5))
        for node, sign, own in ((3, 1, [0, 1, 2]), (6, -1, [0, 3, 4])):
            each = np.array([[stiff, sign * coupling, 0], [sign * coupling, stiff, 0], [0, 0, ROTATION]])
            degrees = mesh.node_degrees(node)
            joints[np.ix_(degrees, degrees)] += each
            true[np.ix_(own, own)] += each.real
        rows = [mesh.node_degrees(node)[direction] for node, direction in ((1, 0), (2, 1), (4, 1), (5, 1), (7, 1))]
        either_side = np.array([[1, -distance], [1, distance]])
        motions = np.zeros((5, 5))
        motions[0, 0], motions[1:3, 1:3], motions[3:, 3:] = 1, either_side, either_side
        transform = np.linalg.inv(motions)

        def over(attached: Complex) -> Complex:
            found = []
            for omega in 2 * np.pi * frequency:
                whole = -(omega**2) * np.linalg.inv(beam.dynamic_stiffness(1j * omega) + attached)
                found.append(transform @ whole[np.ix_(rows, rows)] @ transform.T)
            return np.array(found)

        return cls(frequency, over(joints), over(0 * joints), true)

    def joints(self, random: np.random.Generator | None, distance: float) -> Real:
        """(lines, 5, 5) stiffness of the joints, without errors or with drawn ones."""
        omega = 2 * np.pi * self.frequency[:, None, None]
        both = [self.on_joints, self.suspended]
        if random is not None:
            both = [_measured(each, random, distance) for each in both]
        return np.asarray((-(omega**2) * (np.linalg.inv(both[0]) - np.linalg.inv(both[1]))).real)


def _measured(over: Complex, random: np.random.Generator, distance: float) -> Complex:
    motions = np.eye(5)
    motions[1:3, 1:3] = motions[3:, 3:] = [[1, -distance], [1, distance]]
    back = np.linalg.inv(motions)
    parts = random.normal(size=(2, *over.shape)) / np.sqrt(2)
    at_points = (motions @ over @ motions.T + NOISE * (parts[0] + 1j * parts[1])) * (
        1 + GAIN * random.normal(size=(5, 1))
    )
    return np.asarray(back @ at_points @ back.T)


def main() -> None:
    """Print errors of the mean over lines, and of single lines, for two distances of the points from the joint."""
    for distance in (0.02, 0.05):
        random = np.random.default_rng(1)
        bench = Bench.of(distance, LINES)
        clean = bench.joints(None, distance).mean(axis=0)
        drawn = np.array([bench.joints(random, distance).mean(axis=0) for _ in range(DRAWS)])
        print(f"points {1e3 * distance:g} mm from the joint, mean over {LINES[0]:g} to {LINES[-1]:g} Hz:")
        for name, at in TERMS.items():
            size = abs(bench.true[at]) or bench.true[1, 1]
            off, scatter = (clean[at] - bench.true[at]) / size, drawn[:, *at].std() / size
            print(f"  {name}: {100 * off:+.2f} % without errors, scatter {100 * scatter:.3g} %")
        for frequency in SINGLE:
            line = Bench.of(distance, np.array([frequency]))
            level = np.sqrt(np.abs(np.diagonal(line.on_joints[0])))
            condition = np.linalg.cond(line.on_joints[0] / np.outer(level, level))
            found = np.array([line.joints(random, distance)[0, 1, 1] for _ in range(DRAWS)])
            off = line.joints(None, distance)[0, 1, 1] / line.true[1, 1] - 1
            spread = np.subtract(*np.percentile(found, [84, 16])) / 2 / line.true[1, 1]
            print(
                f"  {frequency:g} Hz: condition {condition:.0f}; "
                f"k22(I) {100 * off:+.1f} %, scatter {100 * spread:.3g} %"
            )


if __name__ == "__main__":
    main()
