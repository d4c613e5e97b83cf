"""Import of bundles into the catalogue, and export."""

import hashlib
import json
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from store.catalogue import Catalogue
from store.dof import StoredDof
from store.errors import NotFoundError, StoreError, UnknownOutcomeError
from store.exchange.accelerance_file import accelerance_functions
from store.exchange.blow_file import BundleBlow, from_waveform, to_waveform, write_blow
from store.exchange.bundle import BLOWS, SETUP, Bundle, read_bundle
from store.exchange.bundle_setup import FORMAT, BundleSetup, InverseSet, LeftOutPoint, article_from, setup_from
from store.exchange.direct_table import (
    DirectPoint,
    UnfitPointError,
    to_direct_point,
    to_dynamic_stiffness,
    write_direct,
)
from store.exchange.uff import UffModel, write_uff
from store.measurements.blows import Blow, Point, add_blow, add_point, list_blows
from store.measurements.frequency_responses import (
    FrequencyResponseSet,
    add_frequency_responses,
    list_frequency_responses,
)
from store.measurements.runs import Run, finish_run, get_run, start_run
from store.new_file import new_folder
from store.results.analyses import add_analysis, latest_analysis
from store.results.dynamic_stiffness import StoredStiffness, add_dynamic_stiffness, list_dynamic_stiffness
from store.states import HAMMER, AnalysisKind, RunState
from store.waveforms.waveform import WaveformReference

IMPORT, IMPORTED = "import", "imported"
CONTROL = re.compile(r"[\x00-\x1f\x7f]")
"""Characters that no name has."""


class UnfitPointsError(StoreError):
    """A bundle cannot hold these sine points. How they are left out is told where the error is shown."""

    def __init__(self, points: Sequence[LeftOutPoint]) -> None:
        more = f", and {len(points) - 1} more cannot" if points[1:] else ""
        super().__init__(f"{_cannot(points[0])}{more}")
        self.points = tuple(points)


def import_bundle(catalogue: Catalogue, bundle: Bundle | Path, article: str | None = None) -> int:
    """Store a bundle as one finished run of kind ``import`` and return its number; on any error nothing is stored.

    Args:
        bundle: from `read_bundle`, or its path.
        article: the test article, by which its specimens are known over the years; the bundle's title by default.

    Raises:
        StoreError: the bundle is refused (see `read_bundle`), the article has no name, or the database is.
    """
    if article == "":
        raise StoreError("the test article needs a name; leave it out to take the bundle's title")
    if isinstance(bundle, Path):
        bundle = read_bundle(bundle)
    article = bundle.setup.title if article is None else article
    for what, name in (("article", article), *(("joint", joint.name) for joint in bundle.setup.joints)):
        if not name.strip() or CONTROL.search(name):
            raise StoreError(f"the {what} is called {name!r}; a name has letters, and is one line")
    waveform_file: str | None = None
    try:
        with catalogue.writing() as session:
            run = start_run(
                session,
                kind=IMPORT,
                title=bundle.setup.title,
                article=article,
                setup=bundle.setup.model_dump(mode="json", exclude={"checksums"}),
            )
            waveform_file = run.waveform_file
            _store_results(session, run.id, bundle)
            if bundle.blows:
                waveforms = [to_waveform(blow) for blow in bundle.blows]
                _store_blows(session, run.id, bundle, catalogue.waveforms.append_all(waveform_file, waveforms))
            finish_run(session, run.id, RunState.FINISHED)
    except UnknownOutcomeError:
        raise  # the waveforms may be needed
    except BaseException:
        if waveform_file is not None:
            catalogue.waveforms.discard(waveform_file)
        raise
    catalogue.waveforms.finish(waveform_file)
    return run.id


def export_bundle(
    catalogue: Catalogue,
    run_id: int,
    path: Path,
    *,
    also: Sequence[int] = (),
    blows: bool = True,
    leave_out_unfit_points: bool = False,
) -> tuple[LeftOutPoint, ...]:
    """Write the newest frequency responses and dynamic stiffness of a run as a bundle, with checksums.

    Returns the sine points that are not in the bundle although they were measured: setup.json has them and the reasons,
    too. Those that were left out of a bundle before it was imported are among them.

    Args:
        run_id: an imported run, or one measured here whose setup is in the form of setup.json.
        path: a new or empty folder, or a new file that ends in .zip.
        also: further runs for the same bundle, such as the sweep of a hammer run.
        blows: whether accepted blows are exported.
        leave_out_unfit_points: whether sine points that direct.csv cannot hold are left out; else they are refused.

    Raises:
        UnfitPointsError: there are sine points that direct.csv cannot hold, and they are not left out.
        StoreError: the runs lack results that a bundle needs, are of different articles, or have blows or sine points
            that a bundle cannot tell apart; or the path exists or cannot be written.
    """
    with new_folder(path) as folder:
        (folder / BLOWS).mkdir()
        return _write(catalogue, [run_id, *also], folder, blows, leave_out_unfit_points)


def stored_blows(catalogue: Catalogue, run_id: int) -> tuple[BundleBlow, ...]:
    """The single blows of an imported bundle, none of other runs; StoreError for a missing run or damaged record."""
    with catalogue.reading() as session:
        run = get_run(session, run_id)
        if run.kind != IMPORT:
            return ()
        blows = list_blows(session, run_id)
    accelerometer = article_from(run.setup).accelerometer
    response = StoredDof(accelerometer.node, accelerometer.direction)
    return tuple(_bundle_blow(catalogue, blow, blow.waveform, response) for blow in blows if blow.waveform is not None)


def _store_results(session: Session, run_id: int, bundle: Bundle) -> None:
    def imported(kind: AnalysisKind) -> int:
        return add_analysis(session, kind=kind, method=IMPORTED, settings={}, runs=[run_id])

    if bundle.inverse:
        analysis = imported(AnalysisKind.FREQUENCY_RESPONSES)
        for measured in bundle.inverse:
            add_frequency_responses(session, analysis, run_id, measured)
    if bundle.direct:
        points = [to_dynamic_stiffness(point) for point in bundle.direct]
        add_dynamic_stiffness(session, imported(AnalysisKind.DYNAMIC_STIFFNESS), points)


def _store_blows(session: Session, run_id: int, bundle: Bundle, references: list[WaveformReference]) -> None:
    points: dict[StoredDof, Point] = {}
    counts: dict[StoredDof, int] = {}
    for blow, reference in zip(bundle.blows, references, strict=True):
        if blow.point not in points:
            points[blow.point] = add_point(session, run_id, blow.point)
        counts[blow.point] = counts.get(blow.point, 0) + 1
        add_blow(
            session,
            points[blow.point],
            counts[blow.point],
            accepted=True,
            waveform=reference,
            peak_force=float(np.abs(blow.force).max()),  # one in a negative direction has a negative force
            source=blow.file,
        )


def _write(
    catalogue: Catalogue, runs: Sequence[int], folder: Path, with_blows: bool, leave_out: bool
) -> tuple[LeftOutPoint, ...]:
    with catalogue.reading() as session:
        first, *others = [get_run(session, run) for run in runs]
        for other in others:
            if other.article != first.article:
                raise StoreError(
                    f"run {other.id} is of article {other.article!r}, run {first.id} of {first.article!r}; "
                    "export each by itself"
                )
        sets_of_run = {run: _newest_sets(session, run) for run in runs}
        sets = [measured for run in runs for measured in sets_of_run[run]]
        direct, unfit = _newest_points(session, runs)
        blows = [blow for run in runs for blow in _blows_of(session, run, sets_of_run[run])] if with_blows else []
    numbers = ", ".join(map(str, runs))
    if unfit and not leave_out:
        raise UnfitPointsError(unfit)
    if not sets and not direct:
        if unfit:
            raise StoreError(
                f"run {numbers} has no frequency responses, and none of its {len(unfit)} sine points fits into a "
                f"bundle; {_cannot(unfit[0])}"
            )
        raise StoreError(
            f"run {numbers} has neither frequency responses nor dynamic stiffness to export; identify it first"
        )
    setup = _setup([first, *others], sets, bool(direct), unfit)
    model = UffModel(first.article, setup.node_positions, first.started_at)
    for entry, measured in zip(setup.inverse, sets, strict=True):
        write_uff(
            folder / entry.file,
            accelerance_functions(
                measured.response,
                measured.inputs,
                measured.frequency,
                measured.accelerance,
                measured.coherence,
                measured.excitation,
            ),
            model,
        )
    if setup.direct is not None:
        write_direct(folder / setup.direct.file, direct)
    response = StoredDof(setup.accelerometer.node, setup.accelerometer.direction)
    for blow in blows:
        if blow.accepted and blow.waveform is not None:
            written = _bundle_blow(catalogue, blow, blow.waveform, response)
            if (folder / BLOWS / written.file).exists():
                raise StoreError(f"two blows are named {written.file}; export the runs one by one, or without blows")
            write_blow(folder / BLOWS, written)
    document = setup.model_dump(mode="json")
    for each in document["inverse"]:
        if each["excitation"] == HAMMER:  # the default; the exchange format does not have the key
            del each["excitation"]
    if not setup.sine_points_left_out:  # as above
        del document["sine_points_left_out"]
    document["checksums"] = {
        file.relative_to(folder).as_posix(): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(folder.rglob("*"))
        if file.is_file()
    }
    (folder / SETUP).write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return setup.sine_points_left_out


def _newest_sets(session: Session, run: int) -> list[FrequencyResponseSet]:
    try:
        return list_frequency_responses(session, run)
    except NotFoundError:
        return []  # a sweep has none; another run may have them


def _blows_of(session: Session, run: int, sets: Sequence[FrequencyResponseSet]) -> list[Blow]:
    """Blows of the exported sets. A run may have others, of the beam in its cords, which a bundle cannot tell apart."""
    numbers = {measured.number for measured in sets}
    return [blow for blow in list_blows(session, run) if not numbers or blow.set_number in numbers]


def _newest_points(session: Session, runs: Sequence[int]) -> tuple[list[DirectPoint], list[LeftOutPoint]]:
    """The rows of the table, and the points that it cannot hold."""
    stored: list[StoredStiffness] = []
    for run in runs:
        try:
            analysis = latest_analysis(session, run, AnalysisKind.DYNAMIC_STIFFNESS)
            stored += list_dynamic_stiffness(session, analysis.id)
        except NotFoundError:
            continue
    order, times = Counter(point.order_number for point in stored).most_common(1)[0] if stored else (0, 0)
    if times > 1:
        raise StoreError(
            f"runs {', '.join(map(str, runs))} have two sine points of order {order}; export the sweeps one by one"
        )
    rows: list[DirectPoint] = []
    unfit: list[LeftOutPoint] = []
    for point in stored:
        try:
            rows.append(to_direct_point(point))
        except UnfitPointError as error:
            unfit.append(
                LeftOutPoint(
                    order=point.order_number,
                    specimen=point.specimen,
                    configuration=point.configuration,
                    amplitude_pp_mm=point.amplitude_pp_mm,
                    frequency_hz=point.frequency,
                    why=error.why,
                )
            )
    return rows, unfit


def _cannot(point: LeftOutPoint) -> str:
    return str(UnfitPointError(point.order, point.why))


def _setup(
    runs: Sequence[Run], sets: Sequence[FrequencyResponseSet], tested: bool, unfit: Sequence[LeftOutPoint]
) -> BundleSetup:
    run = runs[0]
    inverse: list[dict[str, Any]] = [
        {
            "file": measured.source or f"inverse_{number}.unv",
            **{name: getattr(measured, name) for name in InverseSet.model_fields if name != "file"},
        }
        for number, measured in enumerate(sets, start=1)
    ]
    direct = {"file": "direct.csv", **(run.setup.get("direct") or {})} if tested else None
    # those that were left out before a bundle was imported are still not in it
    left_out = [point for each in runs for point in each.setup.get("sine_points_left_out", [])]
    left_out += [point.model_dump(mode="json") for point in unfit]
    here = {
        "format": FORMAT,
        "title": run.title,
        "inverse": inverse,
        "direct": direct,
        "sine_points_left_out": left_out,
    }
    try:
        return setup_from({**run.setup, **here})
    except StoreError as error:
        raise StoreError(f"run {run.id} cannot be exported, its setup is not that of a bundle: {error}") from error


def _bundle_blow(catalogue: Catalogue, blow: Blow, reference: WaveformReference, response: StoredDof) -> BundleBlow:
    file = blow.source or f"blow_{blow.point}_set{blow.set_number}_{blow.number:02}.unv"
    return from_waveform(catalogue.waveforms.read(reference), file, blow.point, response)
