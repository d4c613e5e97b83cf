"""An elastomer film as a constant complex modulus, whatever the frequency and the temperature.

Recorded: `frequency_sweeps.csv` with frequency Hz, storage and loss modulus MPa, temperature degC and set; two lines of
heading.
"""

import numpy as np

from analysis.gap.parameter import Parameter
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.single_degree import SingleDegree

model = SingleDegree(
    parameters=(
        Parameter("stiffness", "Pa", 5e9, 1.0, positive=True),
        Parameter("loss_factor", "1", 0.05, 1.0, positive=True),
    ),
    name="constant complex modulus",
)


def read(path):
    """A curve for each set, measured at one temperature; 3 % of each value is in doubt."""
    lines = np.genfromtxt(path, delimiter=",", skip_header=2)
    curves = []
    for number in np.unique(lines[:, 4]):
        own = lines[lines[:, 4] == number]
        values = 1e6 * (own[:, 1] + 1j * own[:, 2])
        conditions = {"frequency": own[:, 0], "temperature": own[:, 3]}
        curves.append(Curve("stiffness", f"{number:.0f}", values, 0.03 * np.abs(values), conditions))
    return curves
