"""The density of data that are left out, against formulas that are exact where a model is linear."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from analysis.gap.effects.tester import FrameCompliance
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.model_evidence import divided
from analysis.gap.evidence.verdict import weigh
from analysis.gap.fitting.fit import Fit
from analysis.gap.fitting.predictive import density_of, parts_of
from analysis.inverse.levenberg_marquardt import Linearised
from tests.analysis.gap.conftest import Made, search_among

PARTS, DATA, UNKNOWNS = 4, 5, 3


@pytest.mark.parametrize("overdispersion", [1.0, 7.0])
@pytest.mark.parametrize("off", [0.0, 0.3])
def test_it_is_the_density_of_each_part_given_the_others_wherever_the_search_ended(
    off: float, overdispersion: float
) -> None:
    random = np.random.default_rng(2)
    columns = random.standard_normal((PARTS, DATA, UNKNOWNS))
    measured = columns @ random.standard_normal(UNKNOWNS) + random.standard_normal((PARTS, DATA))
    normal = np.einsum("pdu,pdv->uv", columns, columns)
    descent = np.einsum("pdu,pd->u", columns, measured)
    scores = np.linalg.solve(np.eye(UNKNOWNS) + normal, descent) + off
    left = measured - columns @ scores
    blocks = [
        SimpleNamespace(unknowns=np.arange(UNKNOWNS), normal=j.T @ j, descent=j.T @ r, chi_square=float(r @ r))
        for j, r in zip(columns, left, strict=True)
    ]
    fitted = SimpleNamespace(
        scores=scores,
        at=Linearised(0.0, descent - normal @ scores - scores, np.eye(UNKNOWNS) + normal),
        left_out=lambda rows: tuple(blocks[row] for _, row in rows),
        likelihood=SimpleNamespace(
            measurement=SimpleNamespace(points=None, sets=[SimpleNamespace(inputs=range(PARTS))])
        ),
    )
    expected = 0.0
    for part in range(PARTS):
        rest = [other for other in range(PARTS) if other != part]
        others, seen = np.concatenate(columns[rest]), np.concatenate(measured[rest])
        known = np.linalg.inv(np.eye(UNKNOWNS) + others.T @ others / overdispersion)
        mean, spread = known @ others.T @ seen / overdispersion, columns[part] @ known @ columns[part].T
        of_part = multivariate_normal(columns[part] @ mean, overdispersion * np.eye(DATA) + spread)
        expected += float(of_part.logpdf(measured[part]))
    constant = -PARTS * DATA / 2 * np.log(2 * np.pi * overdispersion)
    found = cast("Fit", fitted)
    there = divided(found.at, found.scores, overdispersion)
    density = density_of(parts_of(found), there, overdispersion)
    assert density + constant == pytest.approx(expected, abs=1e-6)


def test_the_right_model_foresees_what_is_left_out(made: Made) -> None:
    search = search_among(made((FrameCompliance(),), (0.6,)), {"frame_compliance", "joint_mass"})
    none = search.fit_paper_model()
    found = {each.ids[0]: each for each in search.singles(none)}
    densities = {name: each.log_predictive_density(1.0) for name, each in found.items()}
    assert max(densities, key=lambda name: densities[name]) == "frame_compliance"
    assert densities["frame_compliance"] > none.log_predictive_density(1.0) + 10
    weighed = weigh(none, list(found.values()), UNCALIBRATED, left_out=True)
    assert weighed[0].effects == ("frame_compliance",)
    assert sum(each.probability for each in weighed) == pytest.approx(1.0)
