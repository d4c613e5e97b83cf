"""The history of a specimen as a table, and its trend as sentences; terminal and page show the same."""

from analysis.direct.trend import FEWEST
from jointlab.report.section import Table, ends, number
from jointlab.specimen_history import SpecimenHistory
from rig.operator import loading_text
from store.results.specimen_history import NominalPoint


def history_title(specimen: str, point: NominalPoint) -> str:
    """The title of a history, such as I in shear, 0.1 mm peak to peak, 50 Hz."""
    loaded = loading_text(point.configuration)
    return f"{specimen} {loaded}, {point.amplitude_pp_mm:g} mm peak to peak, {point.frequency:g} Hz"


def history_table(specimen: str, history: SpecimenHistory) -> Table:
    """A row for each run."""
    head = ("run", "measured (UTC)", "°C", "k (MN/m)", "95 %", "γ", "95 %")
    rows = tuple(
        (
            str(each.run_id),
            f"{each.measured_at:%Y-%m-%d %H:%M}",
            "–" if each.temperature_c is None else f"{each.temperature_c:.1f}",
            number(each.stiffness / 1e6, 4),
            _ends(each.stiffness_low, each.stiffness_high, 1e6),
            number(each.loss_factor, 4),
            _ends(each.loss_factor_low, each.loss_factor_high),
        )
        for each in history.results
    )
    return Table(history_title(specimen, history.point), head, rows)


def trend_sentences(history: SpecimenHistory) -> list[str]:
    """How k and γ have changed over the runs, or what a trend needs."""
    said = []
    for name, found in (("k", history.stiffness_change), ("γ", history.loss_factor_change)):
        if found is None:
            return [f"A trend takes {FEWEST} runs at different times; there {_are(len(history.results))} here."]
        low, high = found.interval()
        clear = "a change" if low > 0 or high < 0 else "no change that the scatter of the runs would not show"
        said.append(
            f"{name}: {100 * found.value:+.2g} % over {number(history.days, 2)} days, 95 % interval "
            f"{100 * low:+.2g} … {100 * high:+.2g} %: {clear}."
        )
    return [*said, "The line goes through all runs alike; temperature is not taken out of it."]


def _are(count: int) -> str:
    return "is 1" if count == 1 else f"are {count}"


def _ends(low: float | None, high: float | None, scale: float = 1.0) -> str:
    return "–" if low is None or high is None else ends((low / scale, high / scale), 4)
