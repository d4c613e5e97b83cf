"""Two measurements of one bench as one measurement: a further one on top of the first."""

from dataclasses import fields, replace

import numpy as np

from analysis.errors import AnalysisError
from analysis.gap.measurement import Drawing, Measurement, TesterPoints


def together(first: Measurement, further: Measurement) -> Measurement:
    """Hammer sets and points of both measurements; in the order of the test, the further points come after the first.

    Raises:
        AnalysisError: the further measurement is of another bench, or of this one after a change.
    """
    check_same_bench(first.drawing, further.drawing)
    if further.points is not None and first.points is not None and further.preset != first.preset:
        raise AnalysisError(
            f"the further points have a preset of {further.preset:g} m and the first of {first.preset:g} m; "
            "diagnose them separately"
        )
    return replace(
        first,
        sets=(*first.sets, *further.sets),
        points=_after(first.points, further.points),
        preset=first.preset if first.points is not None else further.preset,
        blows=(*first.blows, *further.blows),
    )


def check_same_bench(first: Drawing, further: Drawing) -> None:
    """Do nothing where both are one bench; AnalysisError where anything of it differs."""
    for field in fields(Drawing):
        one, other = (getattr(each, field.name) for each in (first, further))
        if not np.array_equal(one, other):
            raise AnalysisError(
                f"{field.name} of the further measurement differs from the first; data of a changed bench are not "
                "diagnosed together, so diagnose them separately"
            )


def check_new(first: Measurement, further: Measurement) -> None:
    """Refuse a further measurement whose data are among the first ones.

    Raises:
        AnalysisError: a hammer set of it, or most of its points, are those of the first: noise never repeats itself.
    """
    known = [each.accelerance for each in first.sets]
    repeated = [
        number
        for number, each in enumerate(further.sets, start=1)
        if np.any(each.accelerance) and any(np.array_equal(each.accelerance, other) for other in known)
    ]
    what = [f"hammer set{'s' if len(repeated) > 1 else ''} {', '.join(map(str, repeated))}"] if repeated else []
    if first.points is not None and further.points is not None and _mostly_repeated(first.points, further.points):
        what.append("the points of the tester")
    if what:
        raise AnalysisError(
            f"{' and '.join(what)} of the further measurement are among the data already; give the further "
            "measurement without them"
        )


def _mostly_repeated(first: TesterPoints, further: TesterPoints) -> bool:
    """Whether most points have the condition and the value of one before; a few may by chance, where few digits are
    kept."""
    names = ("specimen", "configuration", "amplitude", "frequency", "stiffness")
    known, own = (set(zip(*(getattr(each, name).tolist() for name in names), strict=True)) for each in (first, further))
    return 2 * len(own & known) > len(own)


def _after(first: TesterPoints | None, further: TesterPoints | None) -> TesterPoints | None:
    if first is None or further is None:
        return first or further
    later = replace(further, order=further.order - np.min(further.order) + np.max(first.order) + 1)
    names = (field.name for field in fields(TesterPoints))
    return TesterPoints(**{name: np.concatenate([getattr(first, name), getattr(later, name)]) for name in names})
