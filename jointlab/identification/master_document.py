"""The document of a master curve, for the service, the page, the store and `jointlab master --json`."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from analysis.direct.master_curve import MasterCurve, MasterPoint, Range
from analysis.direct.time_temperature import KELVIN
from analysis.frequency_response import Real
from jointlab.documents.master import (
    CurveDocument,
    DiscrepancyDocument,
    Ends,
    HammerStiffnessDocument,
    LagDocument,
    LeftOutDocument,
    MasterDocument,
    MasterPointDocument,
    ParameterName,
    ParameterUnit,
    PredictionDocument,
    ShiftCurve,
    ShiftParameter,
    SweepDocument,
)
from jointlab.identification.master import SpecimenMaster

Places = NDArray[np.intp]
"""(points,) for each point the place of its sweep."""
SHOWN = 10.0
"""How far outside of the measured reduced frequencies the curve goes: a decade."""
CURVE_POINTS, SHIFT_POINTS = 121, 41
PARAMETERS: Mapping[str, tuple[ParameterName, ParameterUnit]] = {
    "C1": ("C1", "1"),
    "C2": ("C2", "K"),
    "E": ("E", "kJ/mol"),
}
"""Parameters of the laws of the shift with their units."""


def master_document(found: SpecimenMaster) -> MasterDocument:
    """The document of a master curve; SI units, temperatures in degrees Celsius."""
    curve, swept = found.curve, found.sweeps.swept
    configuration, amplitude = swept[0].series
    temperature = np.array(found.sweeps.temperatures)
    sweep = np.argmin(np.abs(temperature[:, None] - curve.model.temperatures), axis=1)
    return MasterDocument(
        article=found.question.article,
        specimen=found.question.specimen,
        configuration=configuration,
        amplitude_pp_mm=amplitude,
        runs=sorted({each.run for each in swept}),
        analyses=sorted({each.analysis for each in swept}),
        shift=curve.model.shift.law,
        reference_c=curve.model.shift.reference,
        parameters=_parameters(curve),
        vertical_shift=curve.model.vertical,
        lag=LagDocument(value=curve.lag.value, standard_error=curve.lag_error, ci95=_ends(curve.lag)),
        discrepancy=DiscrepancyDocument(**curve.sizes._asdict()),
        reduced_frequencies_covered=curve.covered,
        sweeps=_sweeps(found, sweep),
        shift_curve=_shift_curve(curve),
        curve=_curve(curve),
        measured=_measured(found, temperature, sweep),
        predictions=[_prediction(each) for each in found.asked],
        hammer_k22=[
            HammerStiffnessDocument(
                run=each.run,
                frequency=each.frequency,
                law=each.law,
                k=each.stiffness.value,
                k_ci95=_ends(each.stiffness),
            )
            for each in found.hammer
        ],
        left_out=[
            LeftOutDocument(
                cause=each.cause,
                configuration=each.series[0],
                amplitude_pp_mm=each.series[1],
                points=len(each.points),
                runs=each.runs,
                temperatures_c=each.temperatures,
            )
            for each in found.sweeps.left_out
        ],
        not_identified=list(found.sweeps.unidentified),
    )


def _parameters(curve: MasterCurve) -> list[ShiftParameter]:
    given = curve.model.shift.constants
    if given is not None:
        return [_parameter(name, value, None, None) for name, value in zip(("C1", "C2"), given, strict=True)]
    errors = curve.shift_errors
    return [_parameter(name, each.value, errors[name], _ends(each)) for name, each in curve.shift_values.items()]


def _parameter(known: str, value: float, error: float | None, interval: Ends | None) -> ShiftParameter:
    name, unit = PARAMETERS[known]
    return ShiftParameter(name=name, unit=unit, value=value, standard_error=error, ci95=interval)


def _sweeps(found: SpecimenMaster, sweep: Places) -> list[SweepDocument]:
    documents = []
    own_shifts = found.curve.sweep_shifts
    for place, mean in enumerate(found.curve.model.temperatures.tolist()):
        points = [each for each, at in zip(found.sweeps.swept, sweep, strict=True) if at == place]
        frequency = [each.point.result.frequency for each in points]
        by_law, own = found.curve.shift_by_law(mean), own_shifts[place]
        documents.append(
            SweepDocument(
                temperature_c=mean,
                runs=sorted({each.run for each in points}),
                points=len(points),
                lowest_frequency=min(frequency),
                highest_frequency=max(frequency),
                shift_factor=by_law.value,
                shift_factor_ci95=_ends(by_law),
                own_shift_factor=own.value,
                own_shift_factor_ci95=_ends(own),
            )
        )
    return documents


def _shift_curve(curve: MasterCurve) -> ShiftCurve:
    measured = curve.model.temperatures
    at = np.linspace(np.min(measured), np.max(measured), SHIFT_POINTS).tolist()
    shifts = [curve.shift_by_law(each) for each in at]
    return ShiftCurve(
        temperature_c=at,
        shift_factor=[each.value for each in shifts],
        shift_factor_ci95=[_ends(each) for each in shifts],
    )


def _curve(curve: MasterCurve) -> CurveDocument:
    low, high = curve.covered
    reference = curve.model.shift.reference
    shown = [curve.at(each, reference) for each in np.geomspace(low / SHOWN, high * SHOWN, CURVE_POINTS).tolist()]
    return CurveDocument(
        reduced_frequency=[each.reduced_frequency for each in shown],
        magnitude=[each.magnitude.value for each in shown],
        magnitude_ci95=[_ends(each.magnitude) for each in shown],
        k=[each.stiffness.value for each in shown],
        k_ci95=[_ends(each.stiffness) for each in shown],
        gamma=[each.loss_factor.value for each in shown],
        gamma_ci95=[_ends(each.loss_factor) for each in shown],
    )


def _measured(found: SpecimenMaster, temperature: Real, sweep: Places) -> list[MasterPointDocument]:
    curve = found.curve
    reference = curve.model.shift.reference
    lifted = (reference + KELVIN) / (temperature + KELVIN) if curve.model.vertical else np.ones_like(temperature)
    documents = []
    for each, warm, place, reduced, factor in zip(
        found.sweeps.swept, temperature.tolist(), sweep.tolist(), curve.reduced.tolist(), lifted.tolist(), strict=True
    ):
        result = each.point.result
        late = 2 * np.pi * result.frequency * curve.lag.value
        documents.append(
            MasterPointDocument(
                run=each.run,
                frequency=result.frequency,
                temperature_c=warm,
                sweep=place,
                k=result.stiffness,
                gamma=result.loss_factor,
                reduced_frequency=reduced,
                reduced_magnitude=result.magnitude * factor,
                gamma_without_lag=float(np.tan(np.angle(result.complex_stiffness) - late)),
            )
        )
    return documents


def _prediction(found: MasterPoint) -> PredictionDocument:
    return PredictionDocument(
        frequency=found.frequency,
        temperature_c=found.temperature,
        reduced_frequency=found.reduced_frequency,
        k=found.stiffness.value,
        k_ci95=_ends(found.stiffness),
        gamma=found.loss_factor.value,
        gamma_ci95=_ends(found.loss_factor),
        beyond=list(found.beyond),
    )


def _ends(found: Range) -> Ends:
    return found.low, found.high
