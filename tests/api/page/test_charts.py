"""What the page draws, as data: nothing is lost by thinning, what was typed is escaped, the next point is lit."""

from datetime import UTC, datetime
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from analysis.dof import Direction, Dof
from analysis.frequency_response import FrequencyResponses
from api.page.charts.axes import axis, line, low, pairs, plot, thinned
from api.page.charts.beam import beam_drawing
from api.page.charts.gap import before_and_after, gap_map, law, over_each_other, shape
from api.page.charts.hammer import accelerances, measured_and_predicted, moving_shape, regression
from api.page.charts.history import over_time
from api.page.charts.sines import (
    by_amplitude,
    by_amplitude_words,
    intervals,
    over_frequency,
    panels,
    superposition,
)
from api.page.markup import Choice, Link, filters, table
from jointlab.identification.inverse import METHODS
from jointlab.report.curves import Panel, PlottedCurve, from_common, panel_colours
from jointlab.report.plots import BLACK, BLUE, ORANGE, stroke
from jointlab.report.section import Share, Unknown
from tests.api.page.diagnosis import example_document

POINT = Dof(3, Direction.Y)
POSITIONS = (0.0, 0.1, 0.2, 0.3)


@given(seed=st.integers(0, 2**32 - 1), samples=st.integers(1, 5000))
def test_a_thinned_record_keeps_its_extremes_and_its_order(seed: int, samples: int) -> None:
    value = np.random.default_rng(seed).standard_normal(samples)
    x, y = thinned(np.arange(samples, dtype=float), value, 100)
    assert x.size <= 100
    assert np.all(np.diff(x) > 0)
    assert (y.min(), y.max()) == (value.min(), value.max())
    assert np.array_equal(value[x.astype(int)], y)


def test_what_is_no_number_is_a_gap_in_a_line() -> None:
    assert pairs(np.array([1.0, 2.0]), np.array([np.nan, 0.123456789])) == ((1.0, None), (2.0, 0.12346))


def test_the_next_point_is_lit_and_no_other() -> None:
    drawn = beam_drawing(POSITIONS, {"I": 2}, "3y", {"1y": (2, 2), "3y": (0, 2), "1x": (0, 2)}, "3y")
    assert drawn.count('data-next="true"') == 1
    assert 'data-point="3y" data-next="true"' in drawn
    assert "strike 3y next" in drawn
    assert 'data-next="true"' not in beam_drawing(POSITIONS, {"I": 2}, "3y", {"1y": (2, 2)}, None)


def test_what_people_typed_is_escaped() -> None:
    bad = "<script>alert(1)</script>"
    cells = (bad, Link(bad, f"/{bad}"), Choice(bad, bad, bad, bad), Unknown(bad, bad), Share(0.5, bad))
    said = table(bad, (bad,), [cells]) + filters({bad: (bad, bad, (bad,))}, bad)
    said += beam_drawing(POSITIONS, {bad: 2}, "3y", {}, None)
    assert "<script" not in said


def test_curves_are_sorted_by_amplitude_and_frequency() -> None:
    curves = by_amplitude([(0.01, 20, 2.0), (0.1, 20, 1.0), (0.01, 10, 3.0)])
    assert list(curves) == [0.1, 0.01]
    assert curves[0.01].frequency.tolist() == [10, 20]
    assert curves[0.01].value.tolist() == [3.0, 2.0]


def test_intervals_are_bars_between_their_ends_and_a_band_widens_the_axis() -> None:
    curve = PlottedCurve(np.array([10.0]), np.array([2.0]), np.array([0.5]))
    made = over_frequency({"0.1 mm": curve}, "k", bands={"inverse": (BLUE, (5.0, 6.0))})
    (bars,) = [series for series in made["series"] if series.get("silent")]
    assert bars["data"] == ((10.0, 1.5), (10.0, 2.5), (10.0, None))
    assert made["yAxis"]["min"] < 2
    assert made["yAxis"]["max"] > 6


def test_eleven_accelerances_are_told_apart_by_colour_and_line_and_have_their_names_at_their_ends() -> None:
    names = [f"{node}y → 3y" for node in range(1, 12)]
    made = accelerances(np.linspace(0, 100, 5), np.ones((11, 5), dtype=complex), names)
    styles = [(each["color"], str(each["lineStyle"]["type"])) for each in made["series"]]
    assert len(set(styles)) == 11
    assert all(one[0] != other[0] and one[1] != other[1] for one, other in pairwise(styles))
    assert all(each["endLabel"] | {"show": True, "formatter": "{a}"} == each["endLabel"] for each in made["series"])


@given(st.sets(st.integers(0, 23), min_size=2, max_size=2))
def test_no_two_of_24_curves_are_drawn_alike(two: set[int]) -> None:
    one, other = two
    assert stroke(one) != stroke(other)


def test_measured_and_predicted_are_told_apart_without_colour() -> None:
    row = FrequencyResponses(np.array([0.0, 1.0, 2.0]), np.ones((1, 3), dtype=complex), POINT, (POINT,))
    made = measured_and_predicted(row, {"maximum likelihood": row, "paper's method": row}, POINT)
    assert [each["name"] for each in made["series"]] == ["measured", "maximum likelihood", "paper's method"]
    assert len({each["lineStyle"]["type"] for each in made["series"]}) == 3
    assert made["series"][0]["data"] == ((1.0, 1.0), (2.0, 1.0))  # nothing at 0 Hz on a scale of decades


def test_the_regression_has_a_line_of_slope_one_as_long_as_the_data() -> None:
    made = regression({"I": (np.array([3.0, -1.0]), np.array([2.0, -4.0]))})
    joint, slope = made["series"]
    assert joint["data"] == ((2.0, 3.0), (-4.0, -1.0))
    assert slope["data"] == ((-4.0, -4.0), (4.0, 4.0))


def test_a_panel_has_the_sweep_and_the_interval_of_each_method_with_the_names_of_the_report() -> None:
    sweep = PlottedCurve(np.array([10.0]), np.array([2e6]), np.array([1e5]))
    ((_, made),) = panels([Panel("joint I, k22", {0.01: sweep}, {"maximum likelihood": (1.9e6, 2.2e6)})], "k", 1e6)
    drawn, bars, band = made["series"]
    assert (drawn["name"], drawn["data"]) == ("tester, 0.01 mm", ((10.0, 2.0),))
    assert bars["data"] == ((10.0, 1.9), (10.0, 2.1), (10.0, None))
    assert (band["name"], band["markArea"]["data"][0]) == ("maximum likelihood", [{"yAxis": 1.9}, {"yAxis": 2.2}])
    assert made["legend"]["data"] == [{"name": "tester, 0.01 mm"}, {"name": "maximum likelihood", "icon": "rect"}]


def test_a_method_and_an_amplitude_have_one_colour_in_all_panels_which_the_report_has_too() -> None:
    sweep = PlottedCurve(np.array([10.0]), np.array([2e6]), np.array([1e5]))
    likelihood, paper = METHODS.values()
    shown = [
        Panel("one", {0.1: sweep}, {paper: (1.0, 2.0)}),
        Panel("other", {0.1: sweep, 0.01: sweep}, {likelihood: (1.0, 2.0), paper: (1.0, 2.0)}),
    ]
    one, other = ({each["name"]: each["color"] for each in made["series"]} for _, made in panels(shown, "k"))
    assert one.items() <= other.items()
    assert len(set(other.values())) == 4
    methods, amplitudes = panel_colours(shown)
    assert other == methods | {f"tester, {amplitude:g} mm": colour for amplitude, colour in amplitudes.items()}


@pytest.mark.parametrize("middle", [2.0e6, -2.0e6])
def test_intervals_are_drawn_from_their_common_estimate_so_that_half_a_per_cent_is_seen(
    middle: float,
) -> None:
    rows = {"k22 I": {"inverse": (0.995 * middle, 1.005 * middle), "direct": (0.9 * middle, 1.1 * middle)}}
    made = intervals(rows, {"inverse": ORANGE, "direct": BLACK})
    (inverse,), (direct,) = (each["data"] for each in made["series"])
    assert inverse == pytest.approx([0, -0.5, 0.5])
    assert direct == pytest.approx([0, -10, 10])
    assert made["yAxis"]["data"] == ["k22 I"]


@given(st.lists(st.tuples(st.floats(-1e7, 1e7), st.floats(1e-3, 1e6)), min_size=1, max_size=6))
def test_the_common_estimate_lies_between_the_middles(found: list[tuple[float, float]]) -> None:
    middles = [middle for middle, _ in found]
    assume(min(abs(middle) for middle in middles) > 1 and min(middles) * max(middles) > 0)
    ways = {str(index): (middle - half, middle + half) for index, (middle, half) in enumerate(found)}
    differences = [(low + high) / 2 for low, high in from_common(ways).values()]
    assert min(differences) <= 1e-6
    assert max(differences) >= -1e-6


def test_a_legend_has_pages_only_where_its_rows_would_fill_a_phone() -> None:
    at = np.array([0.0, 1.0])
    few, many = ([line(f"curve {n}", at, at) for n in range(count)] for count in (5, 12))
    made = plot(few, axis("x"), axis("y"))
    assert made["legend"]["type"] == "plain"
    assert made["grid"]["top"] == 18 + 2 * 26
    assert plot(many, axis("x"), axis("y"))["legend"]["type"] == "scroll"


def test_the_legend_of_a_bare_line_has_no_mark_and_that_of_a_marked_one_has() -> None:
    at = np.array([0.0, 1.0])
    bare, marked = plot([line("bare", at, at), line("marked", at, at, symbol="rect")], axis("x"), axis("y"))["legend"][
        "data"
    ]
    assert bare == {"name": "bare", "itemStyle": {"opacity": 0}}
    assert marked == {"name": "marked"}


def test_superposition_is_measured_as_lines_and_computed_as_marks() -> None:
    sweep = PlottedCurve(np.array([10.0]), np.array([2e6]), np.array([1e5]))
    made = superposition({0.1: sweep, 0.01: sweep}, {0.1: sweep, 0.01: sweep})
    assert [(each["type"], each["name"]) for each in made["series"]] == [
        ("line", "measured, 0.1 mm"),
        ("scatter", "computed, 0.1 mm"),
        ("line", "measured, 0.01 mm"),
        ("scatter", "computed, 0.01 mm"),
    ]
    # an amplitude has one colour in every chart
    drawn = over_frequency(by_amplitude_words(dict.fromkeys((0.1, 0.01), sweep)), "k")["series"]
    assert [each["color"] for each in drawn if not each.get("silent")] == [
        each["color"] for each in made["series"][::2]
    ]


def test_a_shape_swings_once_from_end_to_end() -> None:
    drawn = moving_shape("mode 1", np.array([0.2, 0.0]), np.array([1j, -1j]), 0.2)
    frames = drawn.split('values="')[1].split('"')[0].split(";")
    assert frames[0] == frames[-1]
    assert frames[0] == "30.0,123.0 470.0,27.0"  # from left to right, whatever the order of points and the phase
    assert frames[len(frames) // 2] == "30.0,27.0 470.0,123.0"


def test_a_function_is_drawn_between_the_ends_of_its_band() -> None:
    ends = [[0.0, 0.5], [2.0, 2.5]]
    made = shape(
        {"at": [10.0, 20.0], "over": "frequency", "unit": "N/m", "real": [1.0, 1.5], "real_ci90": ends}, "real"
    )
    assert [each["name"] for each in made["series"]] == ["function", "low", "high"]
    assert made["series"][2]["data"] == ((10.0, 2.0), (20.0, 2.5))


def test_a_law_is_drawn_along_both_axes_between_the_ends_of_its_bands() -> None:
    made = law(example_document()["effects"][0]["law_found"], "stiffness")
    assert (made["xAxis"]["name"], made["xAxis"]["type"]) == ("amplitude (µm)", "log")
    assert made["yAxis"]["name"] == "k over that at 1.0 µm"
    compression, low, high, shear, *_ = made["series"]
    assert [each["name"] for each in (compression, low, shear)] == ["compression", "compression, 90 %", "shear"]
    assert compression["data"] == ((1.0, 1.0), (3.0, 0.9), (10.0, 0.8))
    assert (low["data"][-1], high["data"][-1]) == ((10.0, 0.78), (10.0, 0.82))
    strokes = {each["lineStyle"]["type"] for each in (compression, low, shear)}
    assert len(strokes) == 3


def test_the_map_shows_each_cell_at_its_row_and_band() -> None:
    made = gap_map(example_document()["maps"][0])
    assert made["xAxis"]["data"] == ["0–100", "100–300", "300–360", "360–1024"]
    assert made["series"][0]["data"] == [[1, 2, 2.0], [2, 2, 93.0]]  # 9 and 410 of 441; what may be noise is white
    assert made["yAxis"]["data"] == ["1y", "3y", "1x"]


def test_measured_before_and_after_are_told_apart_without_colour() -> None:
    measured, before, after = over_each_other(example_document()["curves"][0], "magnitude")["series"]
    assert [each["name"] for each in (measured, before, after)] == ["measured", "before", "after"]
    assert before["data"] == ((100.0, 1.1), (300.0, 1.8), (360.0, 1.4))
    strokes = {(each["lineStyle"]["width"], each["lineStyle"]["type"]) for each in (measured, before, after)}
    assert len(strokes) == 3


def test_a_closer_look_has_its_band_and_an_even_scale() -> None:
    made = over_each_other(example_document()["curves"][0], "magnitude", [300.0, 360.0])
    assert made["series"][0]["data"] == ((300.0, 2.0), (360.0, 1.5))
    assert (made["xAxis"]["min"], made["xAxis"]["max"], made["yAxis"]["type"]) == (300.0, 360.0, "value")


def test_stiffness_of_the_tester_is_drawn_in_meganewtons_a_metre() -> None:
    made = over_each_other(example_document()["curves"][2], "stiffness")
    assert made["series"][0]["data"] == ((5.0, 2.0), (200.0, 2.2))
    assert made["yAxis"]["name"] == "k (MN/m)"


def test_before_and_after_have_interval_and_floor() -> None:
    made = before_and_after(example_document()["gap"])
    before, after, interval, floor = made["series"]
    assert made["yAxis"]["data"] == ["beam rig", "elastomer tester"]
    assert (before["data"], after["data"]) == ([11.0, 14.0], [3.0, 3.3])
    assert floor["markLine"]["data"][0]["xAxis"] == 2.9
    assert [end["xAxis"] for end in interval["markArea"]["data"][0]] == [2.8, 3.5]


def test_a_history_has_a_bar_for_each_interval_that_is_known() -> None:
    days = [datetime(2026, 1, day, tzinfo=UTC) for day in (5, 6)]
    points, bars = over_time("k (MN/m)", days, [1.0, 1.1], [(0.9, 1.1), (None, None)])["series"]
    first = 1e3 * days[0].timestamp()
    assert points["data"] == ((first, 1.0), (1e3 * days[1].timestamp(), 1.1))
    assert bars["data"] == ((first, 0.9), (first, 1.1), (first, None))
    assert len(over_time("temperature (°C)", days, [23.0, None])["series"]) == 1


@pytest.mark.parametrize(
    ("values", "labels"),
    [
        ((-28.0, 88.0), (-100.0, 100.0, 100.0)),
        ((1.36, 1.44), (1.35, 1.45, 0.05)),
        ((0.4749, 0.5251), (0.45, 0.55, 0.05)),
        ((0.1844, 0.2066), (0.18, 0.22, 0.02)),
    ],
)
def test_a_low_chart_has_four_labels_at_most(values: tuple[float, float], labels: tuple[float, float, float]) -> None:
    drawn = low(plot([line("k", np.array([1.0, 2.0]), np.array(values))], axis("frequency (Hz)"), axis("k (MN/m)")))
    found = tuple(drawn["yAxis"][name] for name in ("min", "max", "interval"))
    assert found == pytest.approx(labels)
    assert (found[1] - found[0]) / found[2] <= 3 + 1e-9
