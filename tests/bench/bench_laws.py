"""Joints that follow frequency, and constant ones: which law is chosen, do intervals hold, what does the choice cost?

    python -m tests.bench.bench_laws --benches 40 --seconds 100     # says how many it did; --first N goes on

Exact benches of `bench_wrong`, drawn within their tolerances, on joints that are constant, that follow a power of
frequency, or a fractional Zener law with rise, corner and order drawn for each bench. Each is fitted with the law
chosen by evidence; constant ones also with constant joints asked for, which gives the cost of the choice in width and
time. Terms that are shown are compared with the truth at 100 Hz, where joints are stated, and at 40 and 500 Hz.
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.inverse.frequency_law import FrequencyLaw
from analysis.inverse.joint_fit import JointFit, LikelihoodEstimate
from tests.bench.bench_wrong import TOLERANCES, UPPER, Bench, Factor, drawn_bench, fitted, power_law

BENCHES = 10
STATED_AT = (100.0, 40.0, 500.0)


def zener_law(rng: np.random.Generator) -> Factor:
    """A rise of 1.1 to 1.8 about 60 to 700 Hz, of the order 0.3 to 0.7."""
    ratio, corner, order = np.exp(rng.uniform(0.1, 0.6)), np.exp(rng.uniform(*np.log([60, 700]))), rng.uniform(0.3, 0.7)

    def law(frequency: Real) -> Complex:
        turned = (1j * frequency / corner) ** order
        return np.asarray((1 + ratio * turned) / (1 + turned))

    return lambda frequency: law(frequency) / law(np.array([100.0]))


KINDS: dict[str, Callable[[np.random.Generator], Factor]] = {
    "constant": lambda _: power_law(0.0),
    "f^0.02": lambda _: power_law(0.02),
    "f^0.05": lambda _: power_law(0.05),
    "f^0.1": lambda _: power_law(0.1),
    "fractional Zener": zener_law,
}


@dataclass
class Figures:
    """Sums over the benches of a kind."""

    fits: int = 0
    passed: int = 0
    laws: list[FrequencyLaw] = field(default_factory=list)
    inside: dict[float, list[bool]] = field(default_factory=lambda: {each: [] for each in STATED_AT})
    far: int = 0
    wider: list[float] = field(default_factory=list)
    slower: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)

    def __str__(self) -> str:
        laws = ", ".join(f"{self.laws.count(law)} {law}" for law in FrequencyLaw if law in self.laws)
        held = ", ".join(
            f"{100 * np.mean(inside):.1f} % of {len(inside)} at {at:g} Hz"
            for at, inside in self.inside.items()
            if inside
        )
        found = f"{self.fits} fits, {self.passed} pass, {laws}; hold {held}; {self.far} over 4 standard errors off; "
        found += f"{np.median(self.seconds):.1f} s median, {np.max(self.seconds):.1f} at most"
        if self.wider:
            found += f"; wider by {np.median(self.wider):.3f} (at most {np.max(self.wider):.3f})"
            found += f", slower by {np.sum(self.seconds) / np.sum(self.slower):.2f}"
        return found


def add(figures: Figures, kind: str, number: int) -> None:
    """One bench more; only what a fit shows that passes its checks is compared."""
    rng = np.random.default_rng([number, 23])
    bench = drawn_bench(rng)
    bench = replace(bench, factor=KINDS[kind](rng))
    fit, seconds = _timed(bench, number, FrequencyLaw.AUTO)
    figures.fits += 1
    figures.laws.append(fit.law)
    figures.seconds.append(seconds)
    if kind == "constant":
        asked, seconds = _timed(bench, number, FrequencyLaw.CONSTANT)
        figures.slower.append(seconds)
        figures.wider.append(float(np.median(_half_widths(fit) / _half_widths(asked))))
    if not fit.passed:
        return
    figures.passed += 1
    for at, inside in figures.inside.items():
        factor = complex(bench.factor(np.array([at]))[0])
        joints = fit.joints if at == STATED_AT[0] else fit.joints_at(at)
        for drawn, found in zip(bench.joints, joints.values(), strict=True):
            hold, far = _against(found, np.asarray(factor * drawn.dynamic_stiffness))
            inside += hold
            figures.far += far


def _timed(bench: Bench, number: int, law: FrequencyLaw) -> tuple[JointFit, float]:
    """A fit of the same data for every law, and its seconds of processor time."""
    began = time.process_time()
    fit = fitted(bench, np.random.default_rng([number, 29]), stated=True, tolerances=replace(TOLERANCES, joint_law=law))
    return fit, time.process_time() - began


def _half_widths(fit: JointFit) -> Real:
    return np.sqrt(np.diag(fit.terms_covariance))


def _against(found: LikelihoodEstimate, true: Complex) -> tuple[list[bool], int]:
    """Whether the interval of each shown term holds, and how many are more than 4 standard errors off."""
    shown = found.observable[UPPER]
    deviation = np.sqrt(np.diag(found.covariance)).reshape(2, -1)
    hold, far = list[bool](), 0
    for half, (value, ends, part) in enumerate(
        ((found.stiffness, found.k_ci95, true.real), (found.damping, found.h_ci95, true.imag))
    ):
        low, high = ends[UPPER].T
        hold += ((low <= part[UPPER]) & (part[UPPER] <= high))[shown].tolist()
        far += int(np.sum(np.abs(value - part)[UPPER][shown] > 4 * deviation[half][shown]))
    return hold, far


def main(arguments: Sequence[str] = ()) -> None:
    """Print a line for each kind."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.bench_laws", description=__doc__)
    parser.add_argument("--benches", type=int, default=BENCHES, help="of each kind")
    parser.add_argument("--first", type=int, default=0, help="number of the first bench")
    parser.add_argument("--kinds", nargs="*", default=list(KINDS), choices=list(KINDS))
    parser.add_argument("--seconds", type=float, default=np.inf, help="after which no further bench begins")
    given = parser.parse_args(arguments)
    ends, found = time.monotonic() + given.seconds, {kind: Figures() for kind in given.kinds}
    for number, kind in product(range(given.first, given.first + given.benches), given.kinds):
        if time.monotonic() > ends:
            print(f"bench {number} and later ones are left: --first {number}")
            break
        add(found[kind], kind, number)
    for kind, figures in found.items():
        if figures.fits:
            print(f"{kind:<18}{figures}")


if __name__ == "__main__":
    main(sys.argv[1:])
