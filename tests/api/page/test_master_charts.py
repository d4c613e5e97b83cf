"""Charts of a master curve: its band, the points of each temperature, and the shift factors."""

import numpy as np
import pytest

from api.page.charts import master as charts
from jointlab.documents.master import MasterDocument, MasterQuestion
from jointlab.identification.master import specimen_master
from jointlab.identification.master_document import master_document
from store.catalogue import Catalogue
from tests.master_sweeps import ARTICLE, SPECIMEN, store_sweeps


@pytest.fixture
def found(catalogue: Catalogue) -> MasterDocument:
    store_sweeps(catalogue, [5.0, 23.0, 38.0])
    return master_document(specimen_master(catalogue, MasterQuestion(article=ARTICLE, specimen=SPECIMEN)))


def test_the_curve_runs_between_the_ends_of_its_band_through_the_points_of_each_temperature(
    found: MasterDocument,
) -> None:
    for drawn, values in (
        (charts.magnitude(found), [1e-6 * each for each in found.curve.magnitude]),
        (charts.loss_factor(found), found.curve.gamma),
    ):
        series = drawn["series"]
        assert [each["name"] for each in series] == ["curve", "95 %", "95 %", "5.0 °C", "23.0 °C", "38.0 °C"]
        curve, low, high = (np.array(each["data"], dtype=float) for each in series[:3])
        assert np.all((low[:, 1] < curve[:, 1]) & (curve[:, 1] < high[:, 1]))
        assert [len(each["data"]) for each in series[3:]] == [12, 12, 12]
        for points in series[3:]:
            x, y = np.array(points["data"], dtype=float).T
            on_curve = np.interp(np.log(x), np.log(curve[:, 0]), curve[:, 1])
            assert y == pytest.approx(on_curve, rel=0.05), points["name"]
        ends = [each["xAxis"] for each in series[0]["markLine"]["data"]]
        assert ends == pytest.approx(found.reduced_frequencies_covered, rel=1e-4)
        assert drawn["xAxis"]["type"] == "log"
        assert curve[:, 1] == pytest.approx(values, rel=1e-4)


def test_the_shift_is_drawn_by_its_law_and_for_each_sweep(found: MasterDocument) -> None:
    drawn = charts.shift_factors(found)
    law, low, high, sweeps, bars = drawn["series"]
    assert [law["name"], low["name"], high["name"]] == ["by the law", "95 %", "95 %"]
    warm, factor = np.array(law["data"], dtype=float).T
    assert (warm[0], warm[-1]) == (5.0, 38.0)
    assert np.all(np.diff(factor) < 0)  # warmer is faster
    assert [point[0] for point in sweeps["data"]] == [5.0, 23.0, 38.0]
    assert sweeps["data"][1][1] == pytest.approx(1.0, rel=0.3)
    assert [bars["data"][place][1] for place in (2, 5, 8)] == [None] * 3  # a gap behind each interval
    assert drawn["yAxis"]["type"] == "log"
