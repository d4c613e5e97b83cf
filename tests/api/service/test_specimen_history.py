"""The history of a specimen over REST and in the client."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from api.service.application import create_app
from api.service.context import Services
from jointlab.client import Client, ProblemError
from store.catalogue import Catalogue
from tests.api.service.conftest import served
from tests.master_sweeps import ARTICLE, SPECIMEN, store_sweeps

TEMPERATURES = [5.0, 23.0, 38.0]


@pytest.fixture
def lab(database_url: str, tmp_path: Path) -> Iterator[Client]:
    """A client of a service that has a sweep of one specimen at each of three temperatures."""
    with Catalogue.open(database_url, tmp_path / "waveforms") as catalogue:
        store_sweeps(catalogue, list(TEMPERATURES))
        with served(create_app(Services(catalogue))) as http, Client(str(http.base_url)) as client:
            yield client


def test_a_specimen_is_shown_over_its_runs_with_its_trend(lab: Client) -> None:
    specimen = next(each for each in lab.specimens(ARTICLE) if each.name == SPECIMEN)
    found = lab.specimen_history(specimen.id)
    assert (found.article, found.specimen) == (ARTICLE, SPECIMEN)
    assert [each.run_id for each in found.results] == [1, 2, 3]
    assert [round(each.temperature_c or 0.0) for each in found.results] == TEMPERATURES
    cold, _, warm = (each.stiffness for each in found.results)
    assert cold > warm
    change = found.stiffness_change
    assert change is not None
    assert change.share < 0
    assert change.ci95[0] < change.share < change.ci95[1]


def test_a_point_is_chosen_by_its_nominal_values(lab: Client) -> None:
    specimen = next(iter(lab.specimens(ARTICLE))).id
    first = lab.specimen_history(specimen)
    points = list(lab.dynamic_stiffness(1))
    other = next(each.frequency for each in points if each.frequency != first.frequency)
    found = lab.specimen_history(specimen, first.configuration, first.amplitude_pp_mm, other)
    assert found.frequency == other
    assert found.results[0].stiffness == next(each.stiffness for each in points if each.frequency == other)


def test_where_it_was_measured_is_said_of_a_point_where_it_was_not(lab: Client) -> None:
    specimen = next(iter(lab.specimens(ARTICLE))).id
    with pytest.raises(ProblemError, match="not measured at this point; its points are angled") as refused:
        lab.specimen_history(specimen, frequency=21.3)
    assert refused.value.status == 404
    with pytest.raises(ProblemError) as unknown:
        lab.specimen_history(999)
    assert unknown.value.status == 404
