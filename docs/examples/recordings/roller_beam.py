"""A steel cantilever of 501 mm on a roller, which the model has where it was at the first station.

Recorded: `three_stations.npz` with acceleration_v (2, samples), roller_v (samples) and sample_rate. The data are the
first natural frequency at each station at which the roller rests.
"""

import numpy as np
from scipy.linalg import eigh

from analysis.gap.parameter import Parameter
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.modal_structure import ModalStructure
from analysis.gap.structures.modes import Attached, NormalModes

LENGTH, HEIGHT, WIDTH, YOUNG, DENSITY = 0.501, 0.00666, 0.051, 205e9, 7850.0
ROLLER, STIFF = 0.068, 1e7  # m from the clamp at the first station; N/m of the roller
BAND, LEAST_REST, NOISE = (20.0, 60.0), 0.4, 0.1  # Hz; s; Hz


def cantilever(elements=60, modes=20):
    """Modes of a clamped beam at its nodes, by Hermitian elements."""
    h, mass, stiff = LENGTH / elements, DENSITY * WIDTH * HEIGHT, YOUNG * WIDTH * HEIGHT**3 / 12
    bend = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2],
                     [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]])  # fmt: skip
    heavy = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2],
                      [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h**2, -22 * h, 4 * h**2]])  # fmt: skip
    K, M = np.zeros((2, 2 * elements + 2, 2 * elements + 2))
    for element in range(elements):
        own = slice(2 * element, 2 * element + 4)
        K[own, own] += stiff / h**3 * bend
        M[own, own] += mass * h / 420 * heavy
    squares, shapes = eigh(K[2:, 2:], M[2:, 2:], subset_by_index=(0, modes - 1))
    at = np.linspace(0.0, LENGTH, elements + 1)
    transverse = np.vstack([np.zeros(modes), shapes[::2]])
    return NormalModes(tuple(f"{1e3 * each:.0f} mm" for each in at), transverse, np.sqrt(squares) / (2 * np.pi), at)


model = ModalStructure(
    cantilever(),
    attached=(Attached(ROLLER, stiffness=STIFF),),
    parameters=(Parameter("modulus", "1", 1.0, 0.02, positive=True),),
    name="cantilever with its roller at the first station",
)


def read(path):
    """The first natural frequency at each rest of the roller."""
    with np.load(path) as file:
        rate, roller, records = float(file["sample_rate"]), file["roller_v"], file["acceleration_v"].astype(float)
    curves = []
    for number, (start, end) in enumerate(rests(roller, rate), start=1):
        frequency = peak(records[:, start:end], rate)
        conditions = {"mode": np.ones(1), "roller_v": np.array([roller[start:end].mean()])}
        curves.append(Curve("frequencies", str(number), np.array([frequency]), np.array([NOISE]), conditions))
    return curves


def rests(roller, rate):
    """First and last sample of each rest, without its first and last 20 ms."""
    window, margin = int(0.05 * rate), int(0.02 * rate)
    level = np.convolve(roller, np.ones(window) / window, "valid")
    still = np.abs(level[window:] - level[:-window]) < 0.01
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    pairs = [
        (start + window + margin, end + window - margin) for start, end in zip(edges[::2], edges[1::2], strict=True)
    ]
    return [pair for pair in pairs if pair[1] - pair[0] > LEAST_REST * rate]


def peak(records, rate, fine=2**18):
    """Frequency of the largest spectral peak in the band of the first mode, Hz; clear records count more."""
    window = np.hanning(records.shape[1])
    left = (records - records.mean(axis=1, keepdims=True)) * window
    frequency = np.fft.rfftfreq(fine, 1 / rate)
    band = (frequency > BAND[0]) & (frequency < BAND[1])
    power = np.abs(np.fft.rfft(left, fine)[:, band]) ** 2
    clear = power / np.median(power, axis=1, keepdims=True)
    return float(frequency[band][np.argmax(np.sum(clear, axis=0))])
