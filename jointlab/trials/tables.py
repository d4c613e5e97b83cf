"""A trial's scores as Markdown, for people and for the project's documents."""

from collections.abc import Mapping
from typing import Any

TARGETS = (
    ("top-1 where d is 5 or more", ("top_1", "detectable"), "at least 95 %"),
    ("the same, inseparable ones counted", ("top_1", "detectable_or_inseparable"), "at least 99 %"),
    ("top-1 of all singles", ("top_1", "all"), ""),
    ("false alarms", ("false_alarms",), "at most 2 %"),
    ("unknown effects accepted as known", ("unknown_accepted_as_known",), "at most 5 %"),
    ("unknown effects rejected", ("unknown_rejected",), ""),
    ("both of a pair", ("pairs", "both"), "at least 80 %"),
    ("at least one of a pair", ("pairs", "at_least_one"), ""),
    ("spurious second effect", ("pairs", "spurious_second"), "at most 10 %"),
    ("90 % intervals that hold the truth", ("coverage",), "85 to 95 %"),
    ("gap after at most 1.2 floors, as reported", ("held_out", "near_floor"), "at least 90 %"),
    ("gap after at most 1.2 floors, rows never shown", ("held_out", "unseen_near_floor"), "at least 90 %"),
    ("reported gap within 10 % of the true one", ("held_out", "within_a_tenth"), ""),
    ("unknown or inseparable without the true effect", ("without_truth",), ""),
)


def markdown(scores: Mapping[str, Any]) -> str:
    """Targets, sizes, effects, calibration, and every wrong answer."""
    held, seconds = scores["held_out"], scores["seconds"]
    parts = [
        f"{scores['cases']} sealed cases; {len(scores['failed'])} diagnoses failed.",
        _table(("", "found", "target"), [(name, _share(_at(scores, path)), target) for name, path, target in TARGETS]),
        f"Calibration error {_number(scores['calibration']['error'], 3)} (target at most 0.05). "
        f"Seconds a case, each on one core: median {_number(seconds['median'])}, worst {_number(seconds['worst'])} "
        "(targets on two cores: 10 and 60).",
        "Held-out gap of cases with effects of the catalogue, quartiles: "
        f"before {_quartiles(held['before_percent'])} %, after {_quartiles(held['after_percent'])} %, "
        f"floor {_quartiles(held['floor_percent'])} %; reported over true on rows never shown "
        f"{_quartiles(held['reported_over_true'])}.",
        "## By size and by d",
        _table(("size", "top-1"), [(name, _share(each)) for name, each in scores["top_1"]["by_size"].items()]),
        _table(("d", "top-1"), [(name, _share(each)) for name, each in scores["top_1"]["by_d"].items()]),
        "## By effect",
        _table(
            ("effect", "cases", "named", "named or inseparable", "smallest d"),
            [
                (name, *(str(each[key]) for key in ("cases", "right", "inseparable")), f"{each['smallest_d']:.0f}")
                for name, each in scores["by_effect"].items()
            ],
        ),
        "## Calibration",
        _table(
            ("claimed", "right", "cases"),
            [
                (f"{100 * each['claimed']:.0f} %", f"{100 * each['right']:.0f} %", str(each["cases"]))
                for each in scores["calibration"]["bins"]
            ],
        ),
        "## Coverage of 90 % intervals",
        _table(
            ("parameter", "inside"),
            [(name, _share(each)) for name, each in scores["coverage"]["by_parameter"].items()],
        ),
        "## Every wrong answer",
        _table(
            ("case", "there", "size", "d", "answer", "probability", "inseparable"),
            [
                (
                    str(each["case"]),
                    " + ".join(each["there"]),
                    f"{each['size']:.2f}",
                    f"{each['d']:.0f}",
                    ": ".join((each["answer"][0], " + ".join(each["answer"][1:]))).rstrip(": "),
                    f"{each['probability']:.2f}",
                    "yes" if each["inseparable"] else "no",
                )
                for each in scores["confusions"]
            ],
        ),
    ]
    if scores["failed"]:
        parts += ["## Diagnoses that failed", "\n".join(f"- {each}" for each in scores["failed"])]
    return "\n\n".join(parts) + "\n"


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def _at(scores: Mapping[str, Any], path: tuple[str, ...]) -> Mapping[str, Any]:
    found: Any = scores
    for name in path:
        found = found[name]
    return dict(found)


def _share(each: Mapping[str, Any]) -> str:
    if each["share"] is None:
        return "none tried"
    return f"{100 * each['share']:.1f} % ({each['count']} of {each['of']})"


def _quartiles(values: list[float] | None) -> str:
    return "–" if values is None else ", ".join(f"{value:.2f}" for value in values)


def _number(value: float | None, digits: int = 1) -> str:
    return "–" if value is None else f"{value:.{digits}f}"
