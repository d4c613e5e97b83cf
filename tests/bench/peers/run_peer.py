"""Poles of all orders from another package, run by the interpreter of the environment that has it.

    python run_peer.py <tool> <input.npz> <output.npz>

The input holds ``frequency`` (lines,) in Hz and ``accelerance`` (draws, rows, lines). The output holds ``seconds``
(draws,) of the processor that the poles took, and ``poles`` (draws, orders, most) in rad/s, filled up with nan.

Each tool computes with polynomials up to degree 60 in its own steps; what it calls order 60 is another tool for it
where that is another degree.
"""

import contextlib
import importlib
import io
import os
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")  # two of the packages open a window system on import

Poles = list[Any]
"""For each order the complex poles in rad/s, the highest order last."""


def sdypy_ema(order: int) -> Callable[[Any, Any], tuple[float, Poles]]:
    """Its `pol_order_high` counts modes, so half the degree of the polynomial."""
    model_of = importlib.import_module("sdypy.EMA").Model

    def poles(frequency: Any, accelerance: Any) -> tuple[float, Poles]:
        upper = float(frequency[-1])
        model = model_of(accelerance, frequency, lower=float(frequency[0]), upper=upper, pol_order_high=order)
        began = time.process_time()
        model.get_poles(method="lscf", show_progress=False)
        return time.process_time() - began, model.all_poles

    return poles


def sdynpy(degree: int) -> Callable[[Any, Any], tuple[float, Poles]]:
    """PolyPy, every second degree."""
    package = importlib.import_module("sdynpy")

    def poles(frequency: Any, accelerance: Any) -> tuple[float, Poles]:
        rows = package.coordinate_array(np.arange(1, len(accelerance) + 1), 2)
        both = package.coordinate.outer_product(rows, package.coordinate_array([1], 2))
        kind = package.data.FunctionTypes.FREQUENCY_RESPONSE_FUNCTION
        fit = package.PolyPy(package.data_array(kind, frequency, accelerance[:, None, :], both))
        began = time.process_time()
        fit.compute_poles(np.arange(2, degree + 1, 2))
        seconds = time.process_time() - began
        return seconds, [
            one["omega"] * (-one["zeta"] + 1j * np.sqrt(1 - one["zeta"] ** 2)) for one in reversed(fit.pole_list)
        ]

    return poles


def pyfbs(degree: int) -> Callable[[Any, Any], tuple[float, Poles]]:
    """p_lscf, every second degree, which is its default."""
    identification = importlib.import_module("pyfbs.modal_id").ModalID

    def poles(frequency: Any, accelerance: Any) -> tuple[float, Poles]:
        fit = identification(frequency, accelerance.T[:, :, None])
        began = time.process_time()
        fit.p_lscf(degree)
        return time.process_time() - began, [one[0] for one in fit.poles]

    return poles


TOOLS: dict[str, Callable[[], Callable[[Any, Any], tuple[float, Poles]]]] = {
    "sdypy-EMA": lambda: sdypy_ema(30),
    "sdypy-EMA, degree 120": lambda: sdypy_ema(60),
    "sdynpy": lambda: sdynpy(60),
    "pyFBS": lambda: pyfbs(60),
}


def main(tool: str, source: str, target: str) -> None:
    """Compute the poles of every draw."""
    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")  # those of other packages, about other things
        compute = TOOLS[tool]()
        with np.load(source) as given:
            results = [compute(given["frequency"], one) for one in given["accelerance"]]
    np.savez(target, seconds=[seconds for seconds, _ in results], poles=padded([poles for _, poles in results]))


def padded(draws: Sequence[Poles]) -> Any:
    """(draws, orders, most) with nan where an order has fewer poles than another."""
    most = max(len(order) for poles in draws for order in poles)
    table = np.full((len(draws), len(draws[0]), most), np.nan, dtype=complex)
    for draw, poles in enumerate(draws):
        for order, found in enumerate(poles):
            table[draw, order, : len(found)] = found
    return table


if __name__ == "__main__":
    main(*sys.argv[1:])
