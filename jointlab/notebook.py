"""The functions of the public Python API; `jointlab` exports them."""

import math
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.frequency_response import FrequencyResponses
from analysis.inverse.joint_estimate import IdentifiedJoint
from analysis.modal.estimation import ModalEstimate, estimate_modes
from jointlab.diagnosis import wording
from jointlab.diagnosis.load import subject_of_bundle, subject_of_run
from jointlab.diagnosis.pipeline import Diagnosed, diagnosed
from jointlab.diagnosis.save import save_diagnosis
from jointlab.errors import JointlabError
from jointlab.identification.direct import Direct
from jointlab.identification.law import StiffnessAt, laws_of, laws_of_points, points_of_run, stiffness_at
from jointlab.identification.load import measurement_of_bundle
from jointlab.identification.options import AS_MEASURED, Options
from jointlab.identification.pipeline import Identification
from jointlab.identification.pipeline import identify as identify_measurement
from jointlab.identification.responses_file import read_responses
from jointlab.identification.run import identify_and_save, identify_run
from jointlab.identification.statements import fit_statements
from jointlab.report.gap import write_gap_report
from jointlab.report.identification import write_report as write_identification_report
from jointlab.result import Cell, Result, ResultRow
from jointlab.settings import load_settings
from store.catalogue import Catalogue
from store.exchange.bundle import Bundle
from store.exchange.bundle import read_bundle as read_bundle_folder

ELEMENTS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))

Source = str | Path | Bundle | Catalogue


def read_uff(path: str | Path, accelerometer: str | None = None) -> FrequencyResponses:
    """Read the accelerances of one roving-hammer set from a UFF file (datasets 58 and 58b, function type 4).

    Other units are converted, mobility and receptance too. Where the accelerometer roves, the set is that of a roving
    hammer by reciprocity. What was converted or passed over is a Python warning.

    Args:
        path: of the file.
        accelerometer: its place, such as ``"3y"``; needed where the file has more than one.

    Returns:
        ``frequency`` (lines,) in Hz, ``accelerance`` (rows, lines) in (m/s^2)/N, ``coherence`` (rows, lines) or None,
        the point of the accelerometer in ``response`` and those of the hammer in ``inputs``.

    Raises:
        StoreError: the file cannot be read as UFF, or holds no accelerances that belong together.
        JointlabError: there is no such accelerometer, or more than one and none was chosen.

    For example:

        responses = jointlab.read_uff("beam.unv").band(20, 1000)
    """
    found = read_responses(Path(path), accelerometer)
    if len(found.sets) > 1:
        have = ", ".join(str(each.response) for each in found.sets)
        raise JointlabError(
            f"{Path(path).name} has accelerometers at {have}; choose one: accelerometer={str(found.sets[0].response)!r}"
        )
    for note in found.notes:
        warnings.warn(note, stacklevel=2)
    return found.sets[0]


def read_bundle(path: str | Path) -> Bundle:
    """Read and check a measurement bundle: setup.json, accelerances (UFF), sine points (CSV), perhaps single blows.

    Args:
        path: of the folder, or of a zip file of it.

    Returns:
        The bundle: ``setup``, hammer sets in ``inverse``, sine points in ``direct``, ``blows`` and ``warnings``.

    Raises:
        StoreError: a file is missing or damaged; the message names the file, and the key or the line.

    For example:

        bundle = jointlab.read_bundle("bundle/")
        bundle.setup.title, len(bundle.inverse), len(bundle.direct)
    """
    return read_bundle_folder(Path(path))


def open_catalogue(url: str | None = None, waveform_folder: str | Path | None = None) -> Catalogue:
    """Open the database of runs and results; an empty one gets its tables.

    Args:
        url: ``sqlite:///path/to/file.db`` or ``postgresql://user@host/database``; None for the configured one.
        waveform_folder: of the raw records; beside an SQLite file by default, required for PostgreSQL.

    Returns:
        The catalogue, a context manager.

    Raises:
        StoreError: the database cannot be opened.
        SettingsError: no `url` is given and the configuration does not fit.

    For example:

        with jointlab.open_catalogue("sqlite:///demo/jointlab.db") as catalogue:
            joints = jointlab.identify(catalogue, run=1)
    """
    if url is None:
        settings = load_settings()
        folder = settings.waveform_folder if waveform_folder is None else Path(waveform_folder)
        return Catalogue.open(settings.database_url, folder, settings.database_limits, settings.rig)
    return Catalogue.open(url, None if waveform_folder is None else Path(waveform_folder))


def modes(responses: str | Path | FrequencyResponses, band: tuple[float, float] | None = None) -> Result[ModalEstimate]:
    """Estimate natural frequencies and loss factors; no pole is chosen by hand.

    Args:
        responses: accelerances, or the path of a UFF file of them.
        band: lowest and highest frequency in Hz; all lines above 0 Hz by default.

    Returns:
        The table ``modes``: frequency in Hz and loss factor of each mode with 95 % intervals. ``details`` has poles,
        shapes, covariances, the fitted accelerances and the stabilisation chart.

    Raises:
        StoreError: the file cannot be read.
        AnalysisError: there is no mode in the band.

    For example:

        found = jointlab.modes("beam.unv", band=(20, 1000))
        found.details.modes.frequency
    """
    read = responses if isinstance(responses, FrequencyResponses) else read_uff(responses)
    title = f"Modes, accelerometer at {read.response}, {len(read.inputs)} points struck"
    found = estimate_modes(read, band)
    return Result(title, {"modes": _mode_rows(found)}, found)


def identify(
    source: Source, run: int | None = None, options: Options = AS_MEASURED, *, save: bool = False
) -> Result[Identification]:
    """Identify stiffness k, damping h and loss factor gamma of the joints by both methods, and compare them.

    Args:
        source: a bundle, the path of one, or a catalogue.
        run: number of the run in the catalogue.
        options: averaging, corrections, mesh and priors, such as ``Options(elements=4)``; by default as measured.
        save: store the results in the catalogue, beside older ones.

    Returns:
        The table ``modes``; ``joints`` with k, h (N/m, N, N m) and gamma of each element by each inverse method;
        ``comparison`` of both experiments. What was not measured has no table. ``details.direct`` has the sine points.

    Raises:
        StoreError: the bundle is refused, or there is no such run.
        AnalysisError: a method cannot work with these data.
        JointlabError: there is nothing to identify, or `save` without a catalogue.

    For example:

        joints = jointlab.identify("bundle/")
        joints.details.inverse.likelihood.joints["I"].stiffness  # (3, 3)
    """
    catalogue = _catalogue_of(source, run)
    if catalogue is not None:
        found = (identify_and_save if save else identify_run)(*catalogue, options)
    elif save:
        raise JointlabError("a bundle has no database to save to; import it, then identify the run")
    else:
        found = identify_measurement(measurement_of_bundle(_bundle(source), options), options)
    tables: dict[str, list[ResultRow]] = {}
    notes = [*found.measurement.faults, *found.measurement.left_out]
    if found.inverse is not None:
        tables["modes"] = _mode_rows(found.inverse.modal)
        tables["joints"] = [
            row
            for route in found.inverse.results
            for joint in route.joints.values()
            for row in _joint_rows(joint, route.method)
        ]
        notes += [*filter(None, [found.inverse.paper_left_out]), *fit_statements(found.inverse.fit)]
        notes += [f"left out: {text}" for text in found.levels.left_out]
    if found.inverse_left_out:
        notes.append(f"no joints from the hammer: {found.inverse_left_out}")
    if found.direct:
        points = found.measurement.points
        notes.append(f"{len(points)} sine points of joint {', '.join(found.direct)}")
        notes += [f"in no law and no comparison: {text}" for own in found.direct.values() for text in own.left_out]
    if found.not_compared:
        notes.append(f"not compared: {found.not_compared}")
    if found.comparison:
        tables["comparison"] = [
            {
                "joint": each.joint,
                "element": each.element,
                "inverse_low": each.inverse.low if each.inverse else None,
                "inverse_high": each.inverse.high if each.inverse else None,
                "direct_low": each.direct.low,
                "direct_high": each.direct.high,
                "verdict": each.verdict.value,
            }
            for each in found.comparison
        ]
    return Result(found.measurement.title, tables, found, tuple(notes))


def stiffness(
    source: Source, run: int | None = None, *, amplitude_pp_mm: float, frequency: float, specimens: Collection[str] = ()
) -> Result[StiffnessAt]:
    """Ask for k, h and gamma at an amplitude and a frequency that need not have been measured.

    Args:
        source: a bundle, the path of one, or a catalogue.
        run: number of the run in the catalogue; it has to be identified and stored.
        amplitude_pp_mm: of the cylinder's motion, mm peak to peak.
        frequency: Hz.
        specimens: names of joints; all by default.

    Returns:
        The table ``stiffness``: k and h in N/m and gamma with 95 % intervals, of one cylinder in shear (a) and
        compression (b) and of the joint (k11, k22, k12). A note says where the question is an extrapolation.

    Raises:
        StoreError: the bundle is refused, there is no such run, or it was not identified.
        JointlabError: there are too few sine points for a law, or there is no such joint.
        AnalysisError: amplitude or frequency is not positive.

    For example:

        jointlab.stiffness("bundle/", amplitude_pp_mm=0.03, frequency=80)
    """
    catalogue = _catalogue_of(source, run)
    if catalogue is None:
        laws: Mapping[str, Direct] = laws_of(measurement_of_bundle(_bundle(source)))
    else:
        laws = laws_of_points(*catalogue, points_of_run(*catalogue))
    found = stiffness_at(laws, 1e-3 * amplitude_pp_mm, frequency, specimens)
    rows = [_stiffness_row(each.specimen, name, term) for each in found.specimens for name, term in each.terms.items()]
    notes = tuple(text for each in found.specimens for text in each.notices) + tuple(
        f"extrapolated, joint {each.specimen}: {phrase}" for each in found.specimens for phrase in each.beyond
    )
    title = f"Stiffness at {amplitude_pp_mm:g} mm peak to peak and {frequency:g} Hz"
    return Result(title, {"stiffness": rows}, found, notes)


def diagnose(
    source: Source, run: int | None = None, *, without: Collection[str] = (), workers: int = 1, save: bool = False
) -> Result[Diagnosed]:
    """Diagnose the gap between a measurement and the paper's model of it: where, how far, and which effect.

    Args:
        source: a bundle, the path of one, or a catalogue.
        run: number of the run in the catalogue.
        without: ids of effects that may not be named.
        workers: processes that share the work. More than one needs a script with ``if __name__ == "__main__":``.
        save: store the diagnosis in the catalogue.

    Returns:
        The tables ``explanations`` (probability, gap that remains in %), ``parameters`` of the effects named, with 90 %
        intervals, and ``places`` of the gap. The notes are the verdict in sentences; ``details.document`` is all of it,
        ready for JSON.

    Raises:
        StoreError: the bundle is refused, or there is no such run.
        AnalysisError: the measurement cannot be simulated.
        JointlabError: there is no such effect, or `save` without a catalogue.

    For example:

        gap = jointlab.diagnose("bundle/")
        gap.details.diagnosis.status, gap.details.diagnosis.effects
    """
    catalogue = _catalogue_of(source, run)
    if save and catalogue is None:
        raise JointlabError("a bundle has no database to save to; import it, then diagnose the run")
    subject = subject_of_bundle(_bundle(source)) if catalogue is None else subject_of_run(*catalogue)
    found = diagnosed(subject, without, workers=workers)
    if catalogue is not None and save:
        opened, number = catalogue
        with opened.writing() as session:
            save_diagnosis(session, number, found.document, tuple(without))
    document = found.document
    tables: dict[str, list[ResultRow]] = {
        "explanations": [
            {
                "effects": wording.ranked_name(each["effects"]),
                "probability": each["probability"],
                "gap_percent": each["held_out_gap_percent"],
            }
            for each in document["ranking"]
        ],
        "parameters": list(_parameter_rows(document)),
        "places": [
            {
                "place": wording.place_words(each),
                "band": wording.band_words(each),
                "share": each["share"],
                "significance": each["significance"],
            }
            for each in document["where"]
        ],
    }
    notes = (*document["faults"], *document["lost"], wording.verdict_sentence(document))
    return Result(found.subject.title, tables, found, (*notes, wording.probability_sentence(document)))


def write_report(result: Result[Any], path: str | Path) -> Path:
    """Write what `identify` or `diagnose` found as one HTML page that loads nothing from outside.

    Args:
        result: of `identify` or `diagnose`.
        path: of the page.

    Returns:
        The path.

    Raises:
        JointlabError: the file cannot be written, or there is no report of such a result.

    For example:

        jointlab.write_report(jointlab.identify("bundle/"), "report.html")
    """
    page = Path(path)
    if isinstance(result.details, Identification):
        write_identification_report(result.details, page)
    elif isinstance(result.details, Diagnosed):
        write_gap_report(result.details.document, page)
    else:
        raise JointlabError("there are reports of what identify and diagnose found, and of nothing else")
    return page


def _catalogue_of(source: Source, run: int | None) -> tuple[Catalogue, int] | None:
    """The catalogue and the run in it; None for a bundle."""
    if isinstance(source, Catalogue) == (run is None):
        raise JointlabError("a catalogue needs the number of a run, as in identify(catalogue, run=1); a bundle none")
    return (source, run) if isinstance(source, Catalogue) and run is not None else None


def _bundle(source: Source) -> Bundle:
    assert not isinstance(source, Catalogue)
    return source if isinstance(source, Bundle) else read_bundle(source)


def _mode_rows(found: ModalEstimate) -> list[ResultRow]:
    columns = zip(
        found.modes.frequency, found.frequency_ci95, found.modes.loss_factor, found.loss_factor_ci95, strict=True
    )
    return [
        {
            "number": number,
            **_value("frequency", frequency, frequency_ends),
            **_value("loss_factor", loss_factor, loss_factor_ends),
        }
        for number, (frequency, frequency_ends, loss_factor, loss_factor_ends) in enumerate(columns, start=1)
    ]


def _joint_rows(joint: IdentifiedJoint, method: str) -> list[ResultRow]:
    return [
        {
            "joint": joint.name,
            "method": method,
            "element": f"k{at[0] + 1}{at[1] + 1}",
            **_value("stiffness", joint.stiffness[at], joint.k_ci95[at]),
            **_value("damping", joint.damping[at], joint.h_ci95[at]),
            **_value("loss_factor", joint.loss_factor[at], joint.loss_factor_ci95[at]),
            "observable": bool(joint.observable[at]),
        }
        for at in ELEMENTS
    ]


def _stiffness_row(specimen: str, term: str, found: DynamicStiffness) -> ResultRow:
    k, h, gamma = found.stiffness_estimate, found.damping_estimate, found.loss_factor_estimate
    return {
        "specimen": specimen,
        "term": term,
        **_value("stiffness", k.value, k.interval()),
        **_value("damping", h.value, h.interval()),
        **_value("loss_factor", gamma.value, gamma.interval()),
    }


def _parameter_rows(document: Mapping[str, Any]) -> Iterator[ResultRow]:
    effects = sorted(document["verdict"]["effects"])
    verdict = next((each for each in document["ranking"] if sorted(each["effects"]) == effects), None)
    for effect, parameters in (verdict["parameters"] if verdict and effects else {}).items():
        for name, found in parameters.items():
            low, high = found["ci90"]
            known = {"value": found["value"], "low": low, "high": high, "unit": found["unit"]}
            yield {"effect": effect, "parameter": name, **known}


def _value(name: str, value: float, ends: Sequence[float]) -> dict[str, Cell]:
    """A value and its interval under the names that the SQL views have for them; None where it cannot be told."""
    low, high = ends
    named = {name: value, f"{name}_low": low, f"{name}_high": high}
    return {key: float(number) if math.isfinite(number) else None for key, number in named.items()}
