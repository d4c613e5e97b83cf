"""The dynamic stiffness of a specimen in the tester, as the bench has it."""

import numpy as np
from numpy.typing import ArrayLike

from simlab.article import SimulatedArticle, with_kinks
from simlab.case.campaign import CONFIGURATIONS, Points
from simlab.case.simulate import specimen_stiffness
from simlab.coupling import Complex
from simlab.elastomer import REFERENCE_TEMPERATURE
from simlab.ordinary import BenchConditions, ordinary_case
from simlab.stand import BuiltCase


def built_of(article: SimulatedArticle, peak_force: float = 100.0) -> BuiltCase:
    """The ordinary case with this article."""
    case = BuiltCase.of(ordinary_case(1, BenchConditions(peak_force=peak_force)))
    return BuiltCase(with_kinks(article), case.campaign, ())


def stiffness_of(
    built: BuiltCase,
    specimen: str,
    configuration: str,
    amplitude: float,
    frequency: ArrayLike,
    temperature: float = REFERENCE_TEMPERATURE,
) -> Complex:
    """k + ih in N/m, shaped like `frequency` (Hz), at zero-to-peak `amplitude` m."""
    where = (list(built.article.joints).index(specimen), CONFIGURATIONS.index(configuration), 2e3 * amplitude)
    points = Points.alike(*where, np.atleast_1d(np.asarray(frequency, dtype=np.float64)), temperature)
    return np.reshape(specimen_stiffness(built, points), np.shape(frequency))
