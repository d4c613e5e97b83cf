"""Models of one measurement: what one leaves to another."""

import numpy as np

from analysis.gap.model import Model, without_effects
from tests.analysis.gap.conftest import Made, search_among


def test_an_effect_of_amplitude_taken_out_leaves_the_unknowns_of_the_paper_s_model(made: Made) -> None:
    search = search_among(made(), {"coulomb_friction"})
    none = search.without_effects()
    (friction, *_) = search.fitted(none, search.screened(none, search.candidates, always=1), 1)
    assert friction.fit.scores.size > none.fit.scores.size + len(friction.places(0))
    left: Model = without_effects(friction, none)
    assert left.fit.scores.shape == none.fit.scores.shape
    assert np.isfinite(left.log_evidence)
