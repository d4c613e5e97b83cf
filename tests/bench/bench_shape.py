"""The shape of what no law explains, on drawn cases whose cause is in no catalogue: is it at the right place?

    python -m tests.bench.bench_shape --cases 13 --seed 1

The cases are those of the sealed trial (`jointlab.trials.plan`): random laws, three benches, all nuisances. Shapes are
sought on top of the paper's model, as a diagnosis does where its verdict is unknown; the verdict is not asked for.
"""

import argparse
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from analysis.frequency_response import Complex
from analysis.gap.faults.removal import examine
from analysis.gap.findings.shape_search import found_shape
from analysis.gap.fitting.held_out import Gap, HeldOut
from analysis.gap.measurement import Measurement
from analysis.gap.outside_catalogue.shape import FoundShape
from analysis.gap.search.single_effects import Search, search_of
from jointlab.diagnosis.load import subject_of_bundle
from simlab.case.bundle import write_case
from simlab.case.draw import Case, CaseKind
from simlab.case.random_case import draw_random_case
from simlab.case.random_laws import OUTSIDE
from store.exchange.bundle import read_bundle

LINES = 64
NEAR = 0.03
"""m, within which a place is the right one; the points struck are 0.1 m apart."""
ACROSS = {"absorber", "hung_mass", "grounded_damper", "mid_span_spring"}
TURNING = {"crack", "rotary_damper"}
CHANNEL = {"sensor_mount_resonance", "gain_drift", "phase_offset", "level_gain"}
TESTER = {"tester_ripple", "cross_talk"}
JOINT = {"rotary_lump", "common_base", "roving_drift", "set_step"}
"""What acts where; every cause is in one of these."""


def right(name: str, values: Mapping[str, Any], place: Mapping[str, Any]) -> bool:
    """Whether a shape acts where the cause does: the degree of freedom at its place, the joint, or the channel."""
    if name in ACROSS:
        return bool(place.get("motion") == "y" and abs(place["position"] - values["x"]) < NEAR)
    if name in TURNING:
        return bool(place.get("motion") in ("r", "bending") and abs(place["position"] - values["x"]) < NEAR)
    if name in CHANNEL:
        return bool(place["at"] == "channel")
    if name in TESTER:
        return bool(place["rig"] == "direct")
    wanted = values.get("joint")
    return str(place["at"]).startswith("joint") and place["at"] in (f"joint {wanted or place['at'][6:]}",)


def true_function(name: str, values: Mapping[str, Any], frequency: np.ndarray) -> Complex | None:
    """(n,) what the cause really does over frequency, in the unit of its shape; None where that is none over it."""
    pole, one = 2j * np.pi * frequency, np.ones(frequency.size, dtype=complex)
    if name == "absorber":
        own, mass = 2 * np.pi * values["f"], values["m"]
        spring = mass * (own**2 + 2 * values["zeta"] * own * pole)
        return np.asarray(mass * pole**2 * spring / (spring + mass * pole**2))
    if name == "hung_mass":
        return np.asarray(values["m"] * pole**2)
    if name == "grounded_damper":
        return np.asarray(values["k"] + pole * values["c"])
    if name == "mid_span_spring":
        return np.asarray(one * values["k"] * (1 + 1j * values["eta"]))
    if name == "rotary_damper":
        return np.asarray(pole * values["c"])
    if name == "rotary_lump":
        return np.asarray(values["inertia"] * pole**2)
    if name == "sensor_mount_resonance":
        ratio, damping = frequency / values["f"], 2j * values["zeta"] * frequency / values["f"]
        return np.asarray((1 + damping) / (1 - ratio**2 + damping) - 1)
    if name == "tester_ripple":
        return np.asarray(one * values["depth"] * np.sin(2 * np.pi * frequency / values["period_hz"] + values["phase"]))
    return None


def covered(shape: FoundShape, truth: Complex) -> float:
    """Share of the range over which the 90 % bands hold; of both parts, each counts by itself."""
    parts = [
        (low <= true) & (true <= high)
        for low, true, high in (
            (shape.low.real, truth.real, shape.high.real),
            (shape.low.imag, truth.imag, shape.high.imag),
        )
    ]
    return float(np.mean(parts))


def searched(measurement: Measurement) -> tuple[Search, Any]:
    """A search with the paper's model fitted."""
    search = search_of(measurement, (), LINES)
    return search, search.fit_paper_model()


def shape_of(case: Case) -> tuple[FoundShape | None, float]:
    """The shape of a case, and the gap of the paper's model in units of noise."""
    with TemporaryDirectory() as folder:
        write_case(case, Path(folder) / "bundle")
        measurement = examine(subject_of_bundle(read_bundle(Path(folder) / "bundle")).measurement).measurement
    search, none = searched(measurement)
    found = found_shape(search, none, [], measurement.thinned(LINES), UNASKED)
    return found, float(np.sqrt(none.misfit.certain))


NOTHING = Gap(np.nan, np.nan, np.nan, np.nan)
UNASKED = HeldOut(NOTHING, NOTHING, (float("nan"), float("nan")))
"""The gap of the paper's model, which takes a minute to measure where the model does not hold."""


def main(arguments: Sequence[str] = ()) -> None:
    """Draw, search, compare and print."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.bench_shape", description=__doc__)
    parser.add_argument("--cases", type=int, default=len(OUTSIDE))
    parser.add_argument("--first", type=int, default=0, help="number of the first kind of cause")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    names = [list(OUTSIDE)[(given.first + n) % len(OUTSIDE)] for n in range(given.cases)]
    rights, shares = 0, list[float]()
    for number, name in enumerate(names):
        began, case = time.process_time(), draw_random_case(given.seed + number, CaseKind.NOVEL, [name])
        found, size = shape_of(case)
        values = dict(case.effects[0].values)
        ok, share, text, left = False, None, "nothing", float("nan")
        if found is not None:
            ok, left = right(name, values, found.place), found.after
            truth = true_function(name, values, found.at) if ok and found.over == "frequency" else None
            share = None if truth is None else covered(found, truth)
            text = f"{dict(found.place)} over {found.over}: {found.resembles or '-'}"
        rights, shares = rights + ok, shares + ([] if share is None else [share])
        band = "" if share is None else f", band holds {share:.2f}"
        print(f"{name} {given.seed + number} (d {size:.0f}) {values}", flush=True)
        seconds = time.process_time() - began
        print(f"    {'right' if ok else 'WRONG'}: {text}; {left:.2f} %{band}; {seconds:.0f} s", flush=True)
    held = sum(share >= 0.8 for share in shares)
    print(f"right place {rights} of {len(names)}; band holds over 0.8 of the range in {held} of {len(shares)}")


if __name__ == "__main__":
    main(sys.argv[1:])
