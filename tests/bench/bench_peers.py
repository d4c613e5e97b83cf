"""Modes by sdypy-EMA, sdynpy and pyFBS and by ours, from the same accelerances, in one run, one BLAS
thread; seconds are the processor's, so that a busy machine counts against none.

The packages live in an environment of their own, ``.venv-peers``, made here. None of them chooses poles by itself, so
they get what a perfect user would pick: of the highest order the pole nearest to the true one, in the band from 0.5
or from 20 Hz, whichever serves them better. Loss factors are of the complex poles, so no convention counts against
them. In the last column they even get the order that happens to suit each mode best.
"""

import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.dof import Dof
from analysis.frequency_response import Complex, FrequencyResponses, Real
from analysis.modal.estimation import estimate_modes
from analysis.modal.lscf import lscf_poles
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from simlab.ordinary import BenchConditions
from tests.bench.bench_modes import NOISE, POINTS, SENSOR, true_modes

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = ROOT / ".venv-peers"
PEERS = Path(__file__).parent / "peers"
RECORDED = ROOT.parent / "shared" / "data" / "beam"
TOOLS = {  # and what each is installed as
    "sdypy-EMA": "sdypy-EMA",
    "sdypy-EMA, degree 120": "sdypy-EMA",
    "sdynpy": "sdynpy",
    "pyFBS": "pyFBS",
}
LOWEST = (0.5, 20.0)  # Hz
DRAWS = 5
ROUNDS = 3
BEAM_HZ = np.array([51.5, 142.18, 278.66, 460.39, 687.16, 958.5])


@dataclass(frozen=True)
class PeerPoles:
    """What a tool gave: the least seconds of a draw, and its poles (draws, orders, most), nan where there is none."""

    seconds: float
    poles: Complex

    def nearest(self, true: Complex) -> Complex:
        """(draws, orders, modes) the pole of each order nearest to each true one."""
        distance = np.abs(self.poles[..., None] - true)
        found = np.nanargmin(np.where(np.isnan(distance), np.inf, distance), axis=2)
        return np.asarray(np.take_along_axis(self.poles, found, axis=2))


def main() -> None:
    """Print time and errors of every tool on the simulated beam, then what each says of the recorded one."""
    installed = {package: install(package) for package in dict.fromkeys(TOOLS.values())}
    tools = [tool for tool, package in TOOLS.items() if installed[package]]
    simulated_beam(tools)
    if RECORDED.is_dir():
        recorded_beam(tools)
    else:
        print("recorded beam: skipped, ../shared/data/beam is not there")


def install(package: str) -> bool:
    """Whether the environment has the package, after an attempt to install it."""
    python = interpreter()
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(ENVIRONMENT)], check=True)
    pinned = next(line for line in (PEERS / "requirements.txt").read_text().split() if line.startswith(package))
    command = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", pinned]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        print(f"{pinned} cannot be installed and is left out: {(result.stderr.strip().splitlines() or ['?'])[-1]}")
    return result.returncode == 0


def interpreter() -> Path:
    """Python of the peers' environment."""
    return ENVIRONMENT / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def run(tool: str, frequency: Real, accelerance: Complex) -> PeerPoles:
    """Poles of accelerances (draws, rows, lines)."""
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "given.npz", Path(folder) / "found.npz"
        np.savez(source, frequency=frequency, accelerance=accelerance)
        subprocess.run(
            [str(interpreter()), str(PEERS / "run_peer.py"), tool, str(source), str(target)],
            check=True,
            capture_output=True,
        )
        with np.load(target) as found:
            return PeerPoles(float(np.min(found["seconds"])), found["poles"])


def simulated_beam(tools: list[str]) -> None:
    """Time and error against exact poles."""
    frequency = np.arange(0.5, 1024.25, 0.5)
    bench = ordinary_bench(1, Clock(), BenchConditions(gain_error=0.0))
    exact = np.array([bench.accelerance(frequency, point.node, point.direction) for point in POINTS])
    within = frequency >= LOWEST[-1]
    true = true_modes(FrequencyResponses(frequency[within], exact[:, within], SENSOR, POINTS)).poles
    rng = np.random.default_rng(0)
    noise = [rng.standard_normal(exact.shape) + 1j * rng.standard_normal(exact.shape) for _ in range(DRAWS)]
    measured: Complex = exact + NOISE * np.array(noise, dtype=np.complex128)

    least = dict.fromkeys(["ours", *tools], np.inf)
    bands: dict[tuple[str, float], PeerPoles] = {}
    for _ in range(ROUNDS):  # in turn, so that a busy moment of the machine hits all
        least["ours"] = min(least["ours"], seconds_of_ours(frequency, measured))
        for tool in tools:
            bands[tool, LOWEST[0]] = run(tool, frequency, measured)
            least[tool] = min(least[tool], bands[tool, LOWEST[0]].seconds)
    for tool in tools:
        bands[tool, LOWEST[1]] = run(tool, frequency[within], measured[..., within])

    began = time.process_time()
    ours = loss_factor_error(np.array([poles_of_ours(frequency[within], one[:, within]) for one in measured]), true)
    whole = (time.process_time() - began) / DRAWS
    print(f"simulated beam, 11 x {frequency.size} lines, noise {NOISE} (m/s^2)/N: rms error of loss factors, %")
    print(f"{'':<24}poles to 60  {'  '.join(f'{f:6.1f} Hz' for f in abs(true) / 2 / np.pi)}   worst over ours")
    print(f"{'ours':<24}{1e3 * least['ours']:7.1f} ms   {'  '.join(f'{e:9.4f}' for e in ours)}")
    print(f"{'':<24}(poles, choice, maximum likelihood and intervals: {1e3 * whole:.0f} ms)")
    for tool in tools:
        errors = [bands[tool, lowest].nearest(true) for lowest in LOWEST]
        top = min((loss_factor_error(found[:, -1], true) for found in errors), key=np.max)
        any_order = np.nanmin(np.concatenate([loss_factor_error_by_order(found, true) for found in errors]), axis=0)
        print(
            f"{tool:<24}{1e3 * least[tool]:7.1f} ms   {'  '.join(f'{e:9.4f}' for e in top)}   "
            f"{np.max(top) / np.max(ours):8.1f}   (best order of each mode: {np.max(any_order) / np.max(ours):.1f})"
        )
    print(
        "ours has 60 polynomials, of every degree to 60; the others every second, sdypy-EMA up to twice what it names"
    )
    for tool in tools:
        print(f"  time over that of {tool}: {least['ours'] / least[tool]:.2f}")


def seconds_of_ours(frequency: Real, measured: Complex) -> float:
    """Least processor seconds of a draw."""
    took = []
    for one in measured:
        began = time.process_time()
        lscf_poles(frequency, one, highest_order=60)
        took.append(time.process_time() - began)
    return min(took)


def poles_of_ours(frequency: Real, accelerance: Complex) -> Complex:
    """(modes,) of the whole estimate; the noise is not stated, as the others are not told it either."""
    return estimate_modes(FrequencyResponses(frequency, accelerance, SENSOR, POINTS)).modes.poles


def loss_factor_error_by_order(found: Complex, true: Complex) -> Real:
    """(orders, modes) rms over draws in per cent, of poles (draws, orders, modes)."""
    return np.array([loss_factor_error(found[:, order], true) for order in range(found.shape[1])])


def loss_factor_error(found: Complex, true: Complex) -> Real:
    """(modes,) rms over draws in per cent, of poles (draws, modes)."""
    relative = loss_factor(found) / loss_factor(true) - 1
    return np.asarray(100 * np.sqrt(np.mean(relative**2, axis=0)))


def loss_factor(poles: Complex) -> Real:
    """Of poles in rad/s, whatever made them."""
    square = -(poles**2)
    with np.errstate(invalid="ignore"):  # an order without poles
        return np.asarray(square.imag / square.real)


def recorded_beam(tools: list[str]) -> None:
    """Frequencies and loss factors of a beam that others recorded, by every tool."""
    rows = [np.loadtxt(RECORDED / f"meas_point_{point}.txt", dtype=complex) for point in (1, 2, 3)]
    frequency = np.arange(float(len(rows[0])))[1:]
    accelerance = np.array(rows)[:, 1:]
    inputs = tuple(Dof.parse(f"{node}y") for node in (1, 2, 3))
    estimate = estimate_modes(FrequencyResponses(frequency, accelerance, inputs[0], inputs))
    print("recorded beam, 3 x 1000 lines: frequency in Hz and loss factor in %")
    found = estimate.modes
    print(f"{'ours':<24}" + "  ".join(f"{f:8.3f}" for f in found.frequency))
    print(f"{'  95 % interval':<24}" + "  ".join(f"+-{np.ptp(each) / 2:6.3f}" for each in estimate.frequency_ci95))
    print(f"{'  loss factor':<24}" + "  ".join(f"{100 * e:8.4f}" for e in found.loss_factor))
    print(f"{'  95 % interval':<24}" + "  ".join(f"+-{50 * np.ptp(e):6.4f}" for e in estimate.loss_factor_ci95))
    for tool in tools:
        top = run(tool, frequency, accelerance[None]).nearest(2j * np.pi * BEAM_HZ)[0, -1]
        print(f"{tool:<24}" + "  ".join(f"{f:8.3f}" for f in np.sqrt(-(top**2).real) / (2 * np.pi)))
        print(f"{'  loss factor':<24}" + "  ".join(f"{100 * e:8.4f}" for e in loss_factor(top)))


if __name__ == "__main__":
    main()
