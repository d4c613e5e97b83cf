"""Tables of results as text for spreadsheets."""

import csv

import numpy as np
import pytest

from store.exports.tables import Column, as_csv


@pytest.mark.parametrize("name", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1"])
def test_a_name_in_csv_is_no_formula(name: str) -> None:
    table = {"joint": Column(np.array([name, "I"]), ""), "k": Column(np.array([-1.5, np.nan]), "N/m")}
    rows = list(csv.reader(as_csv(table).decode().splitlines()))
    assert rows == [["joint", "k (N/m)"], ["'" + name, "-1.5"], ["I", ""]]
