"""The first bending mode of two bolted half beams as one linear degree of freedom.

Recorded: acceleration under a force of four levels, `force_control.csv` with the columns set, frequency_hz, force_n,
acceleration_m_s2 and phase_rad (of displacement over force); and the decay after a blow, `ring_down.npz` with time and
acceleration (accelerometers, samples).
"""

import numpy as np
from scipy.signal import butter, hilbert, sosfiltfilt

from analysis.gap.parameter import Parameter
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.single_degree import SingleDegree

NATURAL, MASS = 2 * np.pi * 80.3, 2.0
BAND, START, END, WINDOW, PARTS, NOISE = (70.0, 92.0), 0.1, 0.4, 0.1, 6, 0.03  # Hz; s; s left out; s; parts; rad/s

model = SingleDegree(
    parameters=(
        Parameter("stiffness", "N/m", MASS * NATURAL**2, 0.05, positive=True),
        Parameter("mass", "kg", MASS, 0.1, positive=True),
        Parameter("loss_factor", "1", 0.004, 1.0, positive=True),
    ),
    local=(Parameter("gain", "1", 0.0, 0.01), Parameter("phase", "rad", 0.0, 0.02)),
    name="jointed beam, one mode",
)


def read(path):
    """Of either recording."""
    return decay(path) if str(path).endswith(".npz") else levels(path)


def decay(path):
    """Poles of the first accelerometer over amplitude, in parts of which the first is the loudest."""
    with np.load(path) as file:
        time, record = file["time"], file["acceleration"][0].astype(float)
    rate = (time.size - 1) / (time[-1] - time[0])
    signal = hilbert(sosfiltfilt(butter(4, BAND, "band", fs=rate, output="sos"), record))
    exponent, each = np.log(np.abs(signal)) + 1j * np.unwrap(np.angle(signal)), round(WINDOW * rate)
    starts = np.arange(np.searchsorted(time, START), time.size - END * rate - each, each).astype(int)
    lines = [np.polyfit((np.arange(each) - each / 2) / rate, exponent[first : first + each], 1) for first in starts]
    curves = []
    for number, own in enumerate(np.array_split(np.array(lines), PARTS), start=1):
        pole = own[:, 0]
        amplitude = np.exp(own[:, 1].real) / np.abs(pole) ** 2
        curves.append(Curve("pole", str(number), pole, np.full(pole.size, NOISE), {"amplitude": amplitude}))
    return curves


def levels(path):
    """A curve for each level; 2 % of each value and 1 % of the largest are in doubt."""
    lines = np.genfromtxt(path, delimiter=",", names=True)
    curves = []
    for level in np.unique(lines["set"]):
        own = lines[lines["set"] == level]
        values = -own["acceleration_m_s2"] * np.exp(1j * own["phase_rad"])
        deviation = np.hypot(0.02 * np.abs(values), 0.01 * np.abs(values).max())
        conditions = {"frequency": own["frequency_hz"], "force": own["force_n"]}
        curves.append(Curve("acceleration", f"{level:.0f}", values, deviation, conditions))
    return curves
