"""A Jenkins element: a spring and dry friction in series."""

import numpy as np

from analysis.frequency_response import Real


def jenkins_element(ratio: Real) -> tuple[Real, Real]:
    """Storage and loss stiffness of the first harmonic, over the stiffness of the spring.

    `ratio` is the amplitude at which the element slips, over its amplitude; from 1 on it sticks.
    """
    slides = np.minimum(ratio, 1.0)
    angle = np.arccos(1 - 2 * slides)
    return np.asarray((angle - np.sin(2 * angle) / 2) / np.pi), np.asarray(4 * slides * (1 - slides) / np.pi)
