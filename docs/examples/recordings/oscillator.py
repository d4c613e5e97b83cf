"""An electronic oscillator as a linear one with structural damping, in volts per volt.

Recorded: `multisine.npz` with input_v, output_v and sample_rate; ten realisations of a random-phase multisine in a row.
Any other record of the same names is read, too.
"""

from itertools import pairwise

import numpy as np

from analysis.gap.parameter import Parameter
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.single_degree import SingleDegree

NATURAL = 2 * np.pi * 69.0
PIECE, LEAD, NOISE = 14.14, 0.5, 4e-4  # s of a part; s before it, until what was before is forgotten; V

model = SingleDegree(
    parameters=(
        Parameter("stiffness", "V/V", 1.0, 0.3, positive=True),
        Parameter("mass", "V s2/V", NATURAL**-2, 0.1, positive=True),
        Parameter("loss_factor", "1", 0.1, 0.7, positive=True),
    ),
    name="oscillator, linear",
)


def read(path):
    """A record for each realisation, or for each piece of about that length."""
    with np.load(path) as file:
        rate = float(file["sample_rate"])
        force, response = (file[name].astype(float) - np.mean(file[name]) for name in ("input_v", "output_v"))
    ends = np.linspace(0, force.size, max(1, round(force.size / (PIECE * rate))) + 1).astype(int)
    curves, lead = [], int(LEAD * rate)
    for number, (start, end) in enumerate(pairwise(ends.tolist()), start=1):
        own = np.arange(max(0, start - lead), end)
        deviation = np.where(own < max(start, lead), np.inf, NOISE)
        curves.append(
            Curve("displacement", str(number), response[own], deviation, {"time": own / rate, "force": force[own]})
        )
    return curves
