"""Corrections of every sine point: effects of the tester, found on known pieces, and the temperature of the room.

Each correction can be switched off by name. Those that were applied are stored with the points and the analysis.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace

from analysis.direct.corrections import correct
from analysis.direct.dynamic_stiffness import AppliedCorrection
from analysis.direct.rig_calibration import CalibrationRun, RigCalibration, calibrate_rig
from analysis.direct.temperature import EFFECT as TEMPERATURE_SHIFT
from analysis.direct.temperature import TemperatureCoefficients, at_reference_temperature
from jointlab.errors import JointlabError
from jointlab.identification.options import SWITCHES
from jointlab.identification.sine_points import IdentifiedSinePoint


@dataclass(frozen=True)
class ReferenceTemperature:
    """Temperature of the results, and how the compound depends on it.

    Attributes:
        celsius: degrees Celsius.
        coefficients: of the compound.
        thermometer_error: standard error of the thermometer, the same at all points, K.
    """

    celsius: float
    coefficients: TemperatureCoefficients
    thermometer_error: float


@dataclass(frozen=True, eq=False)
class TesterCorrections:
    """The corrections of the sine points of a measurement.

    Attributes:
        applied: to every point; empty where nothing is known or all is switched off. How far a point was from the
            reference temperature is in the point.
        switched_off: by hand, by name.
        calibration: from the known pieces, or None without any.
    """

    applied: tuple[AppliedCorrection, ...] = ()
    switched_off: tuple[str, ...] = ()
    calibration: RigCalibration | None = None


def corrected(
    points: tuple[IdentifiedSinePoint, ...],
    calibration_runs: tuple[CalibrationRun, ...],
    reference: ReferenceTemperature | None,
    without: Collection[str] = (),
) -> tuple[tuple[IdentifiedSinePoint, ...], TesterCorrections]:
    """The specimens' own dynamic stiffness, and the corrections.

    Args:
        points: as measured.
        calibration_runs: on known pieces; without any, the tester is taken to be rigid, massless and on time.
        reference: temperature of the results; None leaves them at that of the room.
        without: names of `SWITCHES` to leave off.

    Raises:
        JointlabError: there is no such switch, or a point has no temperature where one is needed.
        AnalysisError: the runs determine nothing, or a correction is too large to be one.
    """
    if unknown := set(without) - set(SWITCHES):
        raise JointlabError(f"no correction {', '.join(sorted(unknown))}; there are {', '.join(SWITCHES)}")
    off = tuple(name for name in SWITCHES if name in without)
    results = tuple(point.result for point in points)
    applied: tuple[AppliedCorrection, ...] = ()
    calibration = None
    if calibration_runs and points:
        calibration = calibrate_rig(calibration_runs)
        found = calibration.corrections
        chosen = found.only(*(effect for effect in found.values if effect not in off))
        results = correct(results, chosen)
        applied += chosen.records
    if reference is not None and points and TEMPERATURE_SHIFT not in off:
        results = at_reference_temperature(
            results, _temperatures(points), reference.celsius, reference.coefficients, reference.thermometer_error
        )
        # the last two are the compound's; the one before is each point's own
        applied += results[0].corrections[-2:]
    kept = tuple(replace(point, result=result) for point, result in zip(points, results, strict=True))
    return kept, TesterCorrections(applied, off, calibration)


def _temperatures(points: tuple[IdentifiedSinePoint, ...]) -> list[float]:
    known = [point.temperature_c for point in points if point.temperature_c is not None]
    if len(known) < len(points):
        raise JointlabError(
            f"{len(points) - len(known)} sine points have no temperature; leave the correction out: "
            f"--without {TEMPERATURE_SHIFT}"
        )
    return known
