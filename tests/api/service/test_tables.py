"""Results of a run as tables: listed with units, read as CSV and as Parquet, the same in both."""

import csv
import io
from collections.abc import Iterator

import httpx
import numpy as np
import pytest

from api.page.routes import add_downloads
from api.service.application import create_app
from api.service.context import Services
from jointlab.client import Client
from store.catalogue import Catalogue
from store.results.analyses import latest_analysis
from store.results.dynamic_stiffness import list_dynamic_stiffness
from store.service.keys import add_key
from store.states import AnalysisKind, Scope
from tests.api.service.conftest import served
from tests.store.conftest import fill

HAMMER, SWEEP = 1, 2


@pytest.fixture(scope="module")
def catalogue(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Catalogue]:
    """A hammer run and a sweep with every kind of result."""
    with Catalogue.open(f"sqlite:///{tmp_path_factory.mktemp('tables') / 'lab.db'}") as opened:
        assert fill(opened) == (HAMMER, SWEEP)
        yield opened


@pytest.fixture(scope="module")
def client(catalogue: Catalogue) -> Iterator[httpx.Client]:
    with catalogue.writing() as session:
        _, secret = add_key(session, "reader", [Scope.READ], None)
    services = Services(catalogue)
    app = create_app(services)
    add_downloads(app, services)
    with served(app) as client:
        client.headers["Authorization"] = f"Bearer {secret}"
        yield client


@pytest.fixture
def lab(client: httpx.Client) -> Iterator[Client]:
    with Client(str(client.base_url), key=client.headers["Authorization"].removeprefix("Bearer ")) as lab:
        yield lab


def test_tables_are_listed_with_columns_and_units(lab: Client) -> None:
    found = {table.name: table for table in lab.tables(HAMMER)}
    assert {"frequency_responses", "modes", "modes_by_mode_dof", "joint_matrices"} <= set(found)
    units = {column.name: column.unit for column in found["modes"].columns}
    assert (units["frequency"], units["frequency_ci95_low"], units["loss_factor"]) == ("Hz", "Hz", "1")
    assert found["joint_matrices"].rows == 18


def test_csv_and_parquet_have_the_stored_values(lab: Client, catalogue: Catalogue) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    with catalogue.reading() as session:
        points = list_dynamic_stiffness(session, latest_analysis(session, SWEEP, AnalysisKind.DYNAMIC_STIFFNESS).id)
    rows = list(csv.DictReader(io.StringIO(lab.table(SWEEP, "dynamic_stiffness").decode())))
    table = parquet.read_table(io.BytesIO(lab.table(SWEEP, "dynamic_stiffness", "parquet")))
    for name, unit in (("stiffness", "N/m"), ("stiffness_se", "N/m"), ("amplitude_pp_mm", "mm")):
        expected = [getattr(point, name) for point in points]
        assert [float(row[f"{name} ({unit})"]) for row in rows] == expected
        np.testing.assert_array_equal(table.column(name), expected)
        assert table.schema.field(name).metadata == {b"unit": unit.encode()}
    assert [row["specimen"] for row in rows] == table.column("specimen").to_pylist() == ["I"] * len(points)
    assert {row["sd_rel"] for row in rows} == {""}
    assert b'"title"' in table.schema.metadata[b"jointlab"]


@pytest.mark.parametrize(
    ("path", "status"),
    [("/runs/77/tables", 404), ("/runs/1/tables/dynamic_stiffness.csv", 404), ("/runs/1/tables/modes.xls", 422)],
)
def test_what_is_not_there_is_refused(client: httpx.Client, path: str, status: int) -> None:
    assert client.get(f"/api{path}").status_code == status


def test_a_table_is_a_file_of_its_kind_and_the_page_gives_the_same(client: httpx.Client) -> None:
    answer = client.get("/api/runs/1/tables/modes.csv")
    assert client.get("/page/tables/1/modes.csv").content == answer.content
    joints = client.get("/api/runs/1/tables/joint_matrices.csv").text.splitlines()[0].split(",")
    assert joints[:8] == ["analysis", "method", "joint", "node", "row", "column", "stiffness", "stiffness_ci95_low"]
    assert answer.headers["content-type"].startswith("text/csv")
    assert answer.headers["content-disposition"] == 'attachment; filename="run-1-modes.csv"'
