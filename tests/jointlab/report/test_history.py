"""The history of a specimen in words."""

from datetime import UTC, datetime, timedelta

from jointlab.report.history import history_table, trend_sentences
from jointlab.specimen_history import SpecimenHistory
from store.results.specimen_history import HistoryPoint, NominalPoint


def point(day: float, stiffness: float, temperature: float | None = 23.0) -> HistoryPoint:
    at = datetime(2026, 1, 5, tzinfo=UTC) + timedelta(days=day)
    return HistoryPoint(int(day) + 1, at, temperature, stiffness, 0.99 * stiffness, 1.01 * stiffness, 0.1, None, None)


def history(*points: HistoryPoint) -> SpecimenHistory:
    return SpecimenHistory(NominalPoint("shear", 0.1, 50.0), points)


def test_a_clear_trend_is_told_from_scatter() -> None:
    softer, scatter, how = trend_sentences(history(*(point(day, 1e6 * (1 - day / 1000)) for day in range(0, 101, 20))))
    assert softer.startswith("k: -11 % over 100 days")
    assert softer.endswith(": a change.")
    assert scatter.endswith("would not show.")
    assert "temperature is not taken out" in how


def test_fewer_than_three_runs_have_no_trend() -> None:
    assert trend_sentences(history(point(0, 1e6))) == ["A trend takes 3 runs at different times; there is 1 here."]


def test_the_table_has_units_and_dashes_for_what_is_not_known() -> None:
    made = history_table("I", history(point(0, 1e6, None)))
    assert made.caption == "I in shear, 0.1 mm peak to peak, 50 Hz"
    assert made.head[3] == "k (MN/m)"
    assert made.rows == (("1", "2026-01-05 00:00", "–", "1.000", "0.9900 … 1.010", "0.1000", "–"),)
