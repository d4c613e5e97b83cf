"""The gap of a structure with a simulator of its own: diagnoses, predictions and trials with `--model`."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.errors import AnalysisError
from analysis.gap.structures.checks import effects_offered_by, usable
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.diagnosis import diagnose_curves
from analysis.gap.structures.effect import StructureEffect
from analysis.gap.structures.left_out import LeftOutPrediction, by_part
from analysis.gap.structures.prediction import predict
from analysis.gap.structures.search import Failure
from analysis.gap.structures.simulator import Simulator
from api.commands.terminal import PICTURES, check_writable, out, progress_bar, write_json
from jointlab.diagnosis.pipeline import PARTS, progress_callback
from jointlab.errors import JointlabError
from jointlab.structures.curve_file import read_curves, write_predictions
from jointlab.structures.document import record_sentence, sentences, structure_document
from jointlab.structures.model_file import effects_of, read_structure_model, structure_model, write_structure_model
from jointlab.structures.plug_ins import curves_read, effect_named, offered_effects, simulator_named
from jointlab.structures.trial import never_tried, read_record, trial_document, try_cases

OTHER = "Another structure"
"""Heading, in help, of the options of a simulator of one's own."""


@dataclass(frozen=True)
class StructureInput:
    """What a command on a structure reads.

    Attributes:
        data: a CSV file of curves, or what `reader` reads.
        model: name of the simulator.
        reader: name of a function that reads `data`; None for CSV.
        effects: names of further effects.
    """

    data: Path
    model: str
    reader: str | None
    effects: tuple[str, ...]


@dataclass(frozen=True)
class StructureOptions(StructureInput):
    """The options of a diagnosis of a structure.

    Attributes:
        without: ids to leave out.
        hold_out: parts that nothing but the last figure sees.
        json_file, picture: where to write; None for nowhere.
        record: scores of a trial of this simulator; None where there are none.
        model_out: where to write the corrected simulation; None for nowhere.
        fitted_to: parts that the simulation as it is was fitted to; all by default.
    """

    without: tuple[str, ...]
    hold_out: tuple[str, ...]
    json_file: Path | None
    picture: Path | None
    record: Path | None = None
    model_out: Path | None = None
    fitted_to: tuple[str, ...] = ()


@dataclass(frozen=True)
class TrialOptions(StructureInput):
    """The options of a trial on a structure.

    Attributes:
        cases: how many.
        seed: which.
        publish: where to write the scores; None for nowhere.
    """

    cases: int
    seed: int
    publish: Path | None


def diagnose_structure(asked: StructureOptions) -> None:
    """Diagnose, show, and write what is asked for."""
    _check_outputs(asked)
    simulator = simulator_named(asked.model)
    curves = _curves(asked.data, asked.reader)
    seen = [each for each in curves if each.part not in asked.hold_out]
    offered, failed = _candidates(simulator, seen, asked.effects)
    kept, _ = usable(offered)
    record = None if asked.record is None else read_record(asked.record, simulator, kept)
    titles = {each.id: each.title for each in kept}
    with progress_bar("diagnosis", PARTS) as advance:
        found = diagnose_curves(
            simulator,
            curves,
            offered,
            asked.hold_out,
            frozenset(asked.without),
            progress=progress_callback(advance, lambda effect: titles.get(effect, effect)),
            fitted_to=asked.fitted_to,
            failed=failed,
        )
    document = structure_document(found, simulator.name, asked.data.name, record)
    for sentence in sentences(document):
        out.print(sentence)
    if asked.json_file is not None:
        write_json(document, asked.json_file)
    if asked.model_out is not None:
        write_structure_model(asked.model_out, structure_model(found, simulator.name))
        out.print(f"{asked.model_out} written")
    if asked.picture is not None:
        from jointlab.structures.picture import write_picture

        write_picture(asked.picture, found, curves)
        out.print(f"{asked.picture} written")


def _check_outputs(asked: StructureOptions) -> None:
    """A diagnosis may take minutes, after which a file that cannot be written would be known too late."""
    for path, option, endings in ((asked.model_out, "--model-out", (".json",)), (asked.picture, "--picture", PICTURES)):
        if path is not None and path.suffix.lower() not in endings:
            raise JointlabError(f"{option} {path}: with --model the name is to end in {' or '.join(endings)}")
    check_writable(asked.json_file, asked.model_out, asked.picture, read=(asked.data, asked.record))


def predict_structure(
    file: Path, data: Path, model: str, reader: str | None, effects: Sequence[str], output: Path
) -> None:
    """Predict curves by a corrected simulation, write them, and show the gap where values were measured."""
    check_writable(output, read=(file, data))
    simulator, stored = simulator_named(model), read_structure_model(file)
    if stored.simulator != simulator.name:
        raise JointlabError(f"{file} belongs to the simulator {stored.simulator!r}; {model} is {simulator.name!r}")
    curves = read_curves(data, measured=False) if reader is None else _curves(data, reader)
    offered_effects()
    for each in effects:
        effect_named(each)  # which imports its class
    models = [(effects_of(each, simulator), each.known) for each in (stored.before, stored.after)]
    found = []
    for curve in curves:
        try:
            before, after = (predict(simulator, acting, known, curve) for acting, known in models)
        except AnalysisError as error:
            out.print(f"NOT PREDICTED: {curve.name}: {error}")
        else:
            found.append((curve, before, after))
    if not found:
        raise JointlabError(f"{file} cannot predict any curve of {data}")
    write_predictions(output, found)
    out.print(f"{output} written")
    before_by_part = by_part([LeftOutPrediction(curve, before.values) for curve, before, _ in found])
    after_by_part = by_part([LeftOutPrediction(curve, after.values) for curve, _, after in found])
    for part in dict.fromkeys(curve.part for curve, _, _ in found if curve.data):
        out.print(f"{part}: gap {before_by_part[part]:.3g} % before, {after_by_part[part]:.3g} % after")


def try_structure(asked: TrialOptions) -> None:
    """Draw cases on a simulator, diagnose them, and say how often that was right."""
    check_writable(asked.publish, read=(asked.data,))
    simulator, curves = simulator_named(asked.model), _curves(asked.data, asked.reader)
    candidates, failures = _candidates(simulator, curves, asked.effects)
    kept, unusable = usable(candidates)
    for each in (*failures, *unusable):
        out.print(f"NOT TRIED: {each.effect}: {each.reason}")
    with progress_bar("cases", asked.cases) as advance:
        found = try_cases(simulator, curves, asked.cases, asked.seed, kept, advance)
    for each in never_tried(found):
        out.print(f"FAILED IN EVERY CASE: {each.effect}: {each.reason}")
    document = trial_document(found, simulator, kept, asked.seed)
    out.print(record_sentence(document))
    if asked.publish is not None:
        write_json(document, asked.publish)
        out.print(f"{asked.publish} written")


def _candidates(
    simulator: Simulator, curves: Sequence[Curve], named: Sequence[str]
) -> tuple[tuple[StructureEffect, ...], list[Failure]]:
    """Effects of the simulator, of installed packages and by name, and those that could not be made."""
    installed, failures = offered_effects()
    return (*effects_offered_by(simulator, curves), *installed, *map(effect_named, named)), failures


def _curves(data: Path, reader: str | None) -> tuple[Curve, ...]:
    return read_curves(data) if reader is None else curves_read(data, reader)
