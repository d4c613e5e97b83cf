"""The document of results of several runs over each other, for the service."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.frequency_response import Complex, Real
from jointlab.documents.overlay import (
    AcceleranceCurve,
    OverlaidRow,
    OverlaidRun,
    OverlayDocument,
    SweepCurve,
    SweepOverlay,
    TermInterval,
    TermOverlay,
)
from jointlab.overlay import (
    Row,
    RunResults,
    accelerances,
    common_amplitudes,
    common_rows,
    joint_intervals,
    sweeps,
)
from jointlab.report.curves import CurveValue, Ends, curve, loss_factor, stiffness
from store.errors import NotFoundError


def overlay_document(
    results: Sequence[RunResults],
    amplitude_pp_mm: float | None = None,
    point: str | None = None,
    response: str | None = None,
) -> OverlayDocument:
    """The document of an overlay; of what is not given, the first in common is taken.

    Args:
        results: of `read_results`.
        amplitude_pp_mm: of the sweeps, as commanded, mm peak to peak.
        point, response: where the hammer struck and where the accelerometer sat, such as 3y.

    Raises:
        NotFoundError: the runs do not have this amplitude or row in common; the message says what they have.
    """
    amplitudes, rows = common_amplitudes(results), common_rows(results)
    amplitude, row = _amplitude(amplitudes, amplitude_pp_mm), _row(rows, point, response)
    numbers = {each.name: each.run.id for each in results}
    found = {} if amplitude is None else sweeps(results, amplitude)
    measured = {} if row is None else accelerances(results, row)
    return OverlayDocument(
        runs=[_run(each) for each in results],
        amplitudes_pp_mm=amplitudes,
        amplitude_pp_mm=amplitude,
        sweeps=[
            SweepOverlay(
                specimen=specimen,
                configuration=configuration,
                curves=[_sweep(numbers[name], points) for name, points in by_run.items()],
            )
            for (specimen, configuration), by_run in found.items()
        ],
        rows=[_row_document(each) for each in rows],
        row=None if row is None else _row_document(row),
        accelerances=[_accelerance(numbers[name], *each) for name, each in measured.items()],
        joints=[_term(name, by_run, numbers) for name, by_run in joint_intervals(results).items()],
    )


def _amplitude(common: Sequence[float], asked: float | None) -> float | None:
    if asked is None:
        return next(iter(common), None)
    if asked not in common:
        known = (f"{each:g}" for each in common)
        raise NotFoundError(f"these runs have no sine points in common at {asked:g} mm peak to peak{_there_are(known)}")
    return asked


def _row(common: Sequence[Row], point: str | None, response: str | None) -> Row | None:
    if point is None and response is None:
        return next(iter(common), None)
    for each in common:
        if all(asked in (None, str(has)) for asked, has in zip((point, response), each, strict=True)):
            return each
    asked = f"from {point or 'any point'} to {response or 'any point'}"
    known = (f"{struck} to {sat}" for struck, sat in common)
    raise NotFoundError(f"these runs have no accelerance in common {asked}{_there_are(known)}")


def _there_are(known: Iterable[str]) -> str:
    """The end of a sentence on what runs do not have in common."""
    listed = ", ".join(known)
    return f"; there are {listed}" if listed else ""


def _run(each: RunResults) -> OverlaidRun:
    run = each.run
    return OverlaidRun(
        run_id=run.id,
        title=run.title,
        article=run.article,
        started_at=run.started_at,
        sine_points=len(each.points),
        has_accelerances=each.responses is not None,
        joints=list(each.joints),
        failed=each.failed,
    )


def _sweep(run: int, points: Sequence[DynamicStiffness]) -> SweepCurve:
    k, gamma = (curve(points, quantity) for quantity in (stiffness, loss_factor))
    return SweepCurve(
        run_id=run,
        frequency=k.frequency.tolist(),
        stiffness=k.value.tolist(),
        stiffness_ci95=_intervals(points, stiffness),
        loss_factor=gamma.value.tolist(),
        loss_factor_ci95=_intervals(points, loss_factor),
    )


def _intervals(points: Sequence[DynamicStiffness], quantity: CurveValue) -> list[list[float | None]]:
    """Both ends of each; a point that was stored without a standard error has none."""
    estimates = [quantity(point) for point in points]
    return [list(each.interval()) if each.standard_error > 0 else [None, None] for each in estimates]


def _accelerance(run: int, frequency: Real, accelerance: Complex) -> AcceleranceCurve:
    accelerance = np.asarray(accelerance)
    return AcceleranceCurve(
        run_id=run,
        frequency=frequency.tolist(),
        real=accelerance.real.tolist(),
        imaginary=accelerance.imag.tolist(),
    )


def _row_document(row: Row) -> OverlaidRow:
    struck, response = map(str, row)
    return OverlaidRow(input=struck, response=response)


def _term(name: str, by_run: Mapping[str, Ends], numbers: Mapping[str, int]) -> TermOverlay:
    term, joint = name.split(" ", 1)
    return TermOverlay(
        joint=joint, term=term, intervals=[TermInterval(run_id=numbers[run], ci95=own) for run, own in by_run.items()]
    )
