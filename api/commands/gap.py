"""`jointlab gap`: where simulation and measurement differ, which effect causes it, and how much gap is left."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from analysis.dof import Dof
from analysis.gap.diagnosis import locate
from analysis.gap.measurement import Measurement
from api.commands.gap_catalogue import catalogue_table
from api.commands.gap_investigate import answer_of, investigate_target
from api.commands.gap_structures import (
    OTHER,
    StructureOptions,
    diagnose_structure,
    predict_structure,
)
from api.commands.gap_trial import trial
from api.commands.sequences import named_sequence
from api.commands.terminal import (
    bundle_with_notes,
    check_writable,
    open_catalogue,
    out,
    progress_bar,
    run_number,
    show_table,
    write_json,
)
from jointlab.diagnosis import wording
from jointlab.diagnosis.carried import carried, carried_sentences
from jointlab.diagnosis.catalogue import blank_measurement, entries
from jointlab.diagnosis.document import location_document
from jointlab.diagnosis.load import Subject, subject_of_bundle, subject_of_run
from jointlab.diagnosis.model_file import read_effects, write_model
from jointlab.diagnosis.pipeline import Diagnosed, diagnosed
from jointlab.diagnosis.predictions import write_predictions
from jointlab.diagnosis.save import save_diagnosis
from jointlab.errors import JointlabError
from jointlab.report.gap import write_gap_report
from jointlab.report.gap_tables import effects_table, places_table, ranking_table
from jointlab.sequences import BUILT_IN
from store.exchange.uff import UffModel

BundleOrRun = Annotated[str, typer.Argument(metavar="BUNDLE|RUN", help="A bundle, or the number of a run.")]
SHOWN_PLACES, SHOWN_RANKS = 5, 5

gap = typer.Typer(
    help="Say where simulation and measurement differ, which effect causes it, and how far the gap shrinks with it.",
    no_args_is_help=True,
    rich_markup_mode=None,
)


@gap.command("diagnose")
def diagnose(
    target: BundleOrRun,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the whole diagnosis to this file.")] = None,
    predictions: Annotated[
        Path | None, typer.Option(help="Write before.unv and after.unv here: what the bundle's `predict` asks for.")
    ] = None,
    report: Annotated[Path | None, typer.Option("--report", "-o", help="Write one HTML page with maps.")] = None,
    without: Annotated[
        list[str] | None,
        typer.Option(metavar="EFFECT", help="Do without an effect; may be repeated. `gap catalogue` lists them."),
    ] = None,
    model_out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write the corrected simulation: FILE.json, .h5 and .unv, or one .zip; with --model one .json.",
        ),
    ] = None,
    with_effect: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Search nothing: try the effects in the .json of another article's model."),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            metavar="MODULE:OBJECT",
            help="Another structure, or FILE.unv with its modes: BUNDLE is then a CSV of curves.",
            rich_help_panel=OTHER,
        ),
    ] = None,
    effect: Annotated[
        list[str] | None,
        typer.Option(metavar="MODULE:CLASS", help="An additional effect; may be repeated.", rich_help_panel=OTHER),
    ] = None,
    hold_out: Annotated[
        list[str] | None,
        typer.Option(metavar="PART", help="A part that no fit sees; may be repeated.", rich_help_panel=OTHER),
    ] = None,
    fitted_to: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PART", help="Fit the simulation as it is to this part; may be repeated.", rich_help_panel=OTHER
        ),
    ] = None,
    reader: Annotated[
        str | None,
        typer.Option(metavar="MODULE:FUNCTION", help="Reads BUNDLE, if it is no CSV.", rich_help_panel=OTHER),
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Draw curves as SVG or PNG.", rich_help_panel=OTHER)] = None,
    record: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Scores of `gap trial --model --publish`.", rich_help_panel=OTHER),
    ] = None,
) -> None:
    """Diagnose the gap between a measurement and the paper's model of it.

    Says where they differ beyond noise and stated tolerances, which effects of the catalogue explain it and with what
    probability, and how far the gap on held-out data then falls. Diagnoses of a run are stored; those of a
    bundle are only shown (import it first to store them).

    With --model the same is asked of a structure of your own: its simulator is a Python object (package.module:object
    or file.py:object), its measurement a CSV of curves.
    """
    if with_effect is not None:
        others = predictions, report, without, model, effect, hold_out, fitted_to, reader, picture, record
        if any(others):
            raise JointlabError(
                "--with-effect makes no search; of the other options it takes only --json and --model-out"
            )
        _carry(target, with_effect, json_file, model_out)
        return
    if model is not None:
        if predictions or report:
            raise JointlabError("--predictions and --report belong to the beam rig; leave them out with --model")
        effects, absent, parts, own = (tuple(each or ()) for each in (effect, without, hold_out, fitted_to))
        asked = StructureOptions(
            Path(target), model, reader, effects, absent, parts, json_file, picture, record, model_out, own
        )
        diagnose_structure(asked)
        return
    if effect or hold_out or fitted_to or reader or picture or record:
        raise JointlabError("--effect, --hold-out, --fitted-to, --reader, --picture and --record belong to --model")
    check_writable(json_file, report, *_model_files(model_out), read=(Path(target),))
    if predictions is not None and not _measurement(target).predict:
        raise JointlabError(
            f"{target} asks for no predictions; name responses and inputs in `predict` of its setup.json"
        )
    found = _diagnosed(target, tuple(without or ()))
    show(found.document)
    if json_file is not None:
        write_json(found.document, json_file)
    if predictions is not None:
        wanted = found.subject.measurement.predict
        if found.diagnosis.predicted is None:
            raise JointlabError(f"{target} has no hammer test, which predictions need")
        positions = found.subject.measurement.drawing.node_positions
        drawing = UffModel(found.subject.title, positions.tolist(), datetime.now(UTC))
        files = write_predictions(predictions, found.diagnosis.predicted, wanted, drawing)
        out.print(" and ".join(map(str, files)) + " written")
    if model_out is not None:
        _write_model(model_out, found.subject, found.document)
    if report is not None:
        write_gap_report(found.document, report)
        out.print(f"{report} written")


@gap.command("predict")
def predict_(
    corrected: Annotated[Path, typer.Argument(metavar="MODEL", help="File of `gap diagnose --model --model-out`.")],
    curves: Annotated[
        Path,
        typer.Argument(metavar="CURVES", help="CSV of conditions, with values or without, or what --reader reads."),
    ],
    output: Annotated[Path, typer.Argument(metavar="OUT", help="CSV to write: before, after and deviations.")],
    model: Annotated[str, typer.Option(metavar="MODULE:OBJECT", help="The simulator that was diagnosed.")],
    effect: Annotated[
        list[str] | None, typer.Option(metavar="MODULE:CLASS", help="An additional effect; may be repeated.")
    ] = None,
    reader: Annotated[
        str | None, typer.Option(metavar="MODULE:FUNCTION", help="Reads CURVES, if they are no CSV.")
    ] = None,
) -> None:
    """Predict curves of another structure by its corrected simulation, under conditions that were never measured.

    Each value is written without the effects that were found and with them, with the standard deviation that the
    parameters leave. Where CURVES has measured values, the gap of each part is shown.
    """
    predict_structure(corrected, curves, model, reader, tuple(effect or ()), output)


def _carry(target: str, effects: Path, json_file: Path | None, model_out: Path | None) -> None:
    """Show what the effects of another article do on this one."""
    check_writable(json_file, *_model_files(model_out), read=(Path(target), effects))
    other, subject = read_effects(effects), _subject(target)
    document = carried(subject, other)
    _show_faults(document)
    for sentence in carried_sentences(document):
        out.print(sentence)
    if json_file is not None:
        write_json(document, json_file)
    if model_out is not None:
        _write_model(model_out, subject, document)


def _model_files(path: Path | None) -> Sequence[Path]:
    """The files that `write_model` may write."""
    if path is None or path.suffix == ".zip":
        return [] if path is None else [path]
    return [path.with_suffix(suffix) for suffix in (".json", ".h5", ".unv")]


def _write_model(path: Path, subject: Subject, document: Mapping[str, Any]) -> None:
    out.print(", ".join(map(str, write_model(path, subject, document))) + " written")


@gap.command("investigate")
def investigate(
    target: BundleOrRun,
    folder: Annotated[Path, typer.Option(help="Of the investigation: it is made, or gone on with.")],
    data: Annotated[
        str | None, typer.Option(metavar="BUNDLE|RUN", help="Answer: further data of the same bench.")
    ] = None,
    reading: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help="Answer: what was read; may be repeated.")
    ] = None,
    refuse: Annotated[str | None, typer.Option(metavar="REASON", help="Answer: it cannot be made.")] = None,
    on_rig: Annotated[
        bool, typer.Option("--rig", help="Run experiments on the rig, each after consent; RUN only.")
    ] = False,
    minutes: Annotated[float | None, typer.Option(min=0, help="Of rig time in all; 240 in a new one.")] = None,
    experiments: Annotated[int | None, typer.Option(min=0, help="That are made; 3 in a new one.")] = None,
) -> None:
    """Find the cause of a gap by further experiments: diagnose, ask for what tells most, diagnose again.

    Each call goes on where the last one ended: it takes the answer to what was asked for, diagnoses all data together,
    and asks for the experiment with most expected information a minute, until the verdict is certain, nothing would
    help, or the budget is spent. FOLDER has every step and every diagnosis as JSON.

    The service makes investigations, too, and keeps them in its database: on its page under Gap, and by REST under
    /api/investigations.
    """
    limits = {"minutes": minutes, "experiments": experiments}
    given = answer_of(data, reading or [], refuse)
    asked = {name: value for name, value in limits.items() if value is not None}
    investigate_target(target, _subject, folder, given, asked, on_rig=on_rig)


@gap.command("locate")
def locate_(
    target: BundleOrRun,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write places and maps to this file.")] = None,
) -> None:
    """Say where simulation and measurement differ, and nothing about causes: quicker than a diagnosis."""
    check_writable(json_file)
    document = location_document(*locate(_measurement(target)))
    _show_faults(document)
    if places := places_table(document):
        show_table(places)
        out.print(wording.MAP_WARNING)
    else:
        out.print("simulation and measurement differ nowhere beyond noise and stated tolerances")
    if json_file is not None:
        write_json(document, json_file)


@gap.command("catalogue")
def catalogue(
    target: Annotated[
        str | None,
        typer.Argument(metavar="[BUNDLE|RUN]", help="For this measurement; by default for the paper's experiments."),
    ] = None,
) -> None:
    """List the effects that a diagnosis knows, with their laws, parameters and plausible ranges.

    Nineteen of twenty values are expected within the range. An effect with several laws is tried with each of them.
    """
    out.print(catalogue_table(entries(_measurement(target))))


gap.command("trial")(trial)


def _measurement(target: str | None) -> Measurement:
    if target is None:
        sequence = named_sequence(BUILT_IN)
        struck = tuple(Dof.parse(point) for point in sequence.hammer_steps[0].points)
        return blank_measurement(sequence.article, struck)
    return _subject(target).measurement


def _subject(target: str) -> Subject:
    run = run_number(target)
    if run is None:
        return subject_of_bundle(bundle_with_notes(target))
    with open_catalogue() as store:
        return subject_of_run(store, run, progress_bar)


def _diagnosed(target: str, without: tuple[str, ...]) -> Diagnosed:
    """Diagnose a bundle, or a run; a run's diagnosis is stored."""
    run = run_number(target)
    if run is None:
        return diagnosed(_subject(target), without, progress_bar)
    with open_catalogue() as store:
        found = diagnosed(subject_of_run(store, run, progress_bar), without, progress_bar)
        with store.writing() as session:
            save_diagnosis(session, run, found.document, without)
    return found


def show(document: Mapping[str, Any]) -> None:
    """A diagnosis on one screen."""
    _show_faults(document)
    status = document["verdict"]["status"]
    out.print(f"{status.upper()}: {wording.verdict_sentence(document)}", style="bold")
    for sentence in (
        wording.probability_sentence(document),
        wording.rigs_sentence(document),
        *wording.beside(document),
    ):
        out.print(sentence)
    for effect, name, value, interval in wording.parameter_lines(document):
        out.print(f"  {effect}: {name} = {value}, 90 % {interval}")
    for sentence in (wording.confounded_sentence(document), wording.next_experiment_words(document)):
        if sentence:
            out.print(sentence)
    if places := places_table(document, SHOWN_PLACES):
        show_table(places)
    if effects := effects_table(document):
        show_table(effects)
    show_table(ranking_table(document, SHOWN_RANKS))


def _show_faults(document: Mapping[str, Any]) -> None:
    for fault in document["faults"]:
        out.print(f"FAULT in the measurement: {fault}", style="red")
    for sentence in document.get("lost", ()):
        out.print(f"NOT TOLD by this measurement: {sentence}", style="yellow")
