"""How a measurement was made, as one text for each fact; what is not recorded has none."""

from collections.abc import Iterable, Iterator

from analysis.direct.standards import LINEARITY_INPUTS_DB, LINEARITY_LEVELS_DB, linearity_difference_db
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.pipeline import Identification
from jointlab.report.laboratory import LaboratorySettings
from jointlab.report.run_record import RunRecord
from jointlab.report.section import number
from jointlab.sequences import sequence_of
from rig.sequences.sequence import BlankStep, Sequence, SoakStep, SweepStep, WaitStep
from store.states import SINE

Facts = dict[str, str]
"""By name."""


def facts_of(found: Identification, laboratory: LaboratorySettings, record: RunRecord | None) -> Facts:
    """Every fact that is known of an identified measurement; `record` is None where it is no stored run."""
    measurement = found.measurement
    facts = {
        "laboratory": ", ".join([laboratory.name, *laboratory.address.split("\n")]) if laboratory.name else "",
        "beam": _beam(measurement),
        "specimens": _specimens(measurement),
        "temperature": _range(_temperatures(measurement), "°C"),
        **_record_facts(record),
        **(_hammer_facts(measurement) if measurement.sets else {}),
        **(_tester_facts(found, record) if measurement.points else {}),
    }
    return {name: text for name, text in facts.items() if text}


def _record_facts(record: RunRecord | None) -> Facts:
    if record is None:
        return {}
    run, used, examined = record.run, record.calibrated, record.examination
    dated = sum(each.calibrated_on is not None for _, each in used)
    return {
        "article": run.article,
        "run": f"{run.id}{f' on {run.rig}' if run.rig else ', imported'}",
        "amended": _amended(record),
        "description": "; ".join(f"{name}: {text}" for name, text in record.descriptions.items()),
        "dates": _dates(record),
        "operator": "; ".join(record.who),
        "instruments": f"{len(used)} with model and serial number, in the summary" if used else "",
        "calibration": f"{dated} of {len(used)} with the date of a calibration, in the summary" if dated else "",
        "examination": ""
        if examined is None
        else f"record {examined.id} of {examined.created_at:%Y-%m-%d}: {examined.verdict}",
    }


def _amended(record: RunRecord) -> str:
    """The version of the set-up that is in force, and why it was amended; empty where it is as measured."""
    if not record.amendments:
        return ""
    reasons = "; ".join(each.reason for each in record.amendments)
    return f"version {record.amendments[-1].version}, amended: {reasons}"


def _dates(record: RunRecord) -> str:
    began, ended = record.run.began_at, record.run.finished_at
    if began is None:
        return ""
    return f"{began:%Y-%m-%d %H:%M} to {f'{ended:%Y-%m-%d %H:%M}' if ended else '?'} UTC"


def _beam(measurement: MeasuredArticle) -> str:
    beam = measurement.article.beam
    return f"{1e3 * beam.length:.4g} x {1e3 * beam.height:.4g} x {1e3 * beam.width:.4g} mm, {beam.density:g} kg/m³"


def _specimens(measurement: MeasuredArticle) -> str:
    return "; ".join(
        f"{joint.name}: cylinders at {' and '.join(f'{angle:g}°' for angle in joint.inclinations_deg)}, "
        f"node {joint.node}"
        for joint in measurement.article.joints
    )


def _temperatures(measurement: MeasuredArticle) -> Iterator[float]:
    yield from (each.temperature_c for each in measurement.sets)
    yield from (each.temperature_c for each in measurement.points if each.temperature_c is not None)


def _range(values: Iterable[float], unit: str) -> str:
    """Lowest to highest of the values; empty without any."""
    known = sorted(values)
    if not known:
        return ""
    ends = dict.fromkeys(f"{end:.4g}" for end in (known[0], known[-1]))
    return f"{' to '.join(ends)} {unit}"


def _hammer_facts(measurement: MeasuredArticle) -> Facts:
    first, accelerometer = measurement.sets[0], measurement.article.accelerometer
    forces = _range((each.peak_force for each in measurement.sets), "N")
    points, other = ", ".join(map(str, first.inputs)), str(first.response)
    sine = first.excitation == SINE  # the accelerometer goes from point to point, and the shaker stays
    return {
        "excitation": f"sine at {other}; amplitude {forces}" if sine else f"hammer at {points}; mean peak {forces}",
        "response": f"accelerometer of {1e3 * accelerometer.mass:g} g at {points if sine else other}",
        "averages": f"{first.averages} averages a point, {first.estimator}, window {first.window}",
        "digitising": f"{first.sample_rate:g} Hz for {first.block_seconds:g} s; lines "
        f"{first.frequency[1] - first.frequency[0]:.4g} Hz apart to {first.frequency[-1]:g} Hz",
        "coherence": "of every point and line" if first.coherence is not None else "",
        "refused": f"double hits and overloads are refused; {len(measurement.left_out)} other blows are in no average"
        if measurement.raw
        else "",
        "accelerances": "magnitude and phase over frequency, with 95 % bands of the prediction, in the annexes",
    }


def _tester_facts(found: Identification, record: RunRecord | None) -> Facts:
    points = found.measurement.points
    amplitudes = sorted({each.amplitude_pp_mm for each in points})
    frequencies = sorted({each.frequency for each in points})
    sequence = None if record is None else sequence_of(record.run)
    calibration = found.corrections.calibration
    return {
        "configurations": ", ".join(dict.fromkeys(each.configuration for each in points)),
        "sines": f"stepped sine, {_range(frequencies, 'Hz')}, {len(frequencies)} frequencies",
        "amplitudes": f"{', '.join(f'{each:g}' for each in amplitudes)} mm peak to peak",
        "preset": "" if record is None else _preset(record, sequence),
        "conditioning": "" if sequence is None else _waits(sequence),
        "linearity": _linearity(found),
        "waveform": _distortion(found.measurement),
        "rig": ""
        if calibration is None
        else f"known pieces measured: chi-square {number(calibration.chi_square)} on {calibration.degrees_of_freedom}",
        "stiffness": "k, h and γ of every point with 95 % intervals, in the annexes",
    }


def _preset(record: RunRecord, sequence: Sequence | None) -> str:
    """The mean displacement, as the sequence or an imported table has it."""
    table = record.run.setup.get("direct")
    preset = sequence.sweep.preset_mm if sequence and sequence.sweep else table and table["preset_mm"]
    return "" if preset is None else f"{preset:g} mm of mean displacement"


def _waits(sequence: Sequence) -> str:
    """What a sequence waited for before the sweep."""
    said = []
    for step in sequence.steps:
        match step:
            case SoakStep():
                said.append(f"{step.seconds:g} s within {step.band_celsius:g} K")
            case WaitStep():
                said.append(f"{step.seconds:g} s of rest")
            case SweepStep():
                return ", ".join(said)
            case BlankStep() | _:
                pass
    return ""


def _linearity(found: Identification) -> str:
    known = []
    for direct in found.direct.values():
        for by_amplitude in direct.series.values():
            known.append(linearity_difference_db([point for series in by_amplitude.values() for point in series]))
    differences = [each for each in known if each is not None]
    if not differences or len(differences) < len(known):
        return ""
    return (
        f"levels at amplitudes {LINEARITY_INPUTS_DB:g} dB apart differ by up to {max(differences):.1f} dB; linear "
        f"means {LINEARITY_LEVELS_DB:g} dB or less"
    )


def _distortion(measurement: MeasuredArticle) -> str:
    force = [each.result.thd_force for each in measurement.points if each.result.thd_force is not None]
    return f"total harmonic distortion of the force up to {100 * max(force):.2g} %" if force else ""
