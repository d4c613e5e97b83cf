"""Sequence documents: what is wrong is said with its place, whatever was done to the document."""

import re
from collections.abc import Callable
from contextlib import nullcontext
from copy import deepcopy
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.errors import ChannelError
from rig.instruments import Instruments
from rig.operator import mounting_text
from rig.sequences.sequence import Frequencies, HammerStep, Sequence, SequenceError, SweepStep, sequence_from
from rig.sequences.sequence_file import load_sequence
from rig.sequences.steps import channels_of, check_plan, sweep_plan
from rig.sequences.sweep_plan import PlanError
from rig.tester.limits import LimitExceededError, TesterLimits
from tests.channels import ACCELEROMETER
from tests.channels import HAMMER as HAMMER_CHANNEL

PAPER = (resources.files("jointlab.sequences") / "paper.yaml").read_text(encoding="utf-8")
PLAIN: dict[str, Any] = yaml.safe_load(PAPER)


def places(value: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The path of everything in a document."""
    children = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [at, *(path for key, child in children for path in places(child, (*at, key)))]


def changed(path: tuple[Any, ...], value: Any, document: Any = PLAIN) -> Any:
    """A copy of the document with another value at `path`."""
    if not path:
        return value
    copy = deepcopy(document)
    inside = copy
    for key in path[:-1]:
        inside = inside[key]
    inside[path[-1]] = value
    return copy


def without(path: tuple[Any, ...]) -> Any:
    copy = deepcopy(PLAIN)
    inside = copy
    for key in path[:-1]:
        inside = inside[key]
    del inside[path[-1]]
    return copy


def test_the_papers_sequence_is_110_blows_and_720_sine_points() -> None:
    paper = sequence_from(PLAIN)
    (hammer,) = paper.hammer_steps
    assert hammer.points == ("1y", "3y", "4y", "5y", "6y", "7y", "8y", "9y", "11y", "1x", "11x")
    assert hammer.blows == 10
    assert paper.sweep is not None
    assert paper.sweep.points == 720
    assert paper.sweep.frequencies.values == tuple(float(f) for f in range(5, 201, 5))
    check_plan(paper, TesterLimits())


def test_a_sequence_survives_storage_as_json() -> None:
    paper = sequence_from(PLAIN)
    assert sequence_from(paper.model_dump(mode="json")) == paper


def test_a_sequence_has_a_json_schema_that_knows_both_steps() -> None:
    schema = Sequence.model_json_schema()
    assert {"HammerStep", "SweepStep", "Frequencies", "Article"} <= set(schema["$defs"])
    assert schema["required"] == ["format", "title", "article_name", "article", "steps"]
    assert schema["additionalProperties"] is False


def blank(**fields: Any) -> Any:
    return changed(("steps",), [{"step": "blank"} | fields, *PLAIN["steps"]])


def test_a_blank_is_a_sweep_of_one_mounting_whose_numbers_come_first() -> None:
    sequence = sequence_from(blank(stiffness=2e8, amplitude_pp_mm=0.02))
    (step, first), (sweep, next_first) = sequence.sine_steps
    assert (first, next_first) == (1, 11)
    plan = sweep_plan(step, first)
    assert (plan.specimens, plan.configurations, plan.preset) == (("blank",), ("blank",), 0.0)
    assert (plan.amplitudes_pp, plan.frequencies[0], plan.frequencies[-1]) == ((2e-5,), 20.0, 200.0)
    numbers = [sine.order_number for mounting in sweep_plan(sweep, next_first).mountings() for sine in mounting.sines]
    assert numbers == list(range(11, 731))
    check_plan(sequence, TesterLimits())


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"piece": "I"}, "steps.0.blank.piece: I is another piece or a joint"),
        ({"stiffness": -1.0}, "it has to be 0 N/m or more"),
        ({"stiffness_standard_error": 1e6}, "belongs to a stiffness; give that, too"),
        ({"sample_rate": 1999.0}, "less than 10 times the highest frequency, 200 Hz"),
        ({"brick": 1}, "there is no such key"),
    ],
)
def test_a_blank_that_cannot_calibrate_is_refused(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(SequenceError, match=re.escape(words)):
        sequence_from(blank(**fields))


def test_an_operator_is_asked_for_the_piece_by_its_name() -> None:
    assert mounting_text("empty", "blank") == "the known piece 'empty' in place of a specimen"
    assert mounting_text("I", "shear") == "the cylinders of joint I in shear"
    assert mounting_text("beam", "suspended") == "the beam in its cords, free of the joints"
    assert mounting_text("beam", "supported") == "the beam on its joints"


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"suspension": {"bounce": 4.0}}, "suspension and weight are of a suspended beam"),
        ({"beam": "suspended", "suspension": {"bounce": 0.0}}, "it has to be more than 0"),
        ({"beam": "floating"}, "'supported' or 'suspended'"),
    ],
)
def test_a_beam_hangs_in_cords_or_stands_on_joints(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(SequenceError, match=re.escape(words)):
        sequence_from(changed(("steps", 0), PLAIN["steps"][0] | fields))


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        (
            {"weakest_peak": 120},
            "weakest_peak 120 N is above peak_force 100 N: a blow that is struck as asked for would be refused",
        ),
        ({"trigger_level": 30.5}, "trigger_level 30.5 N is above weakest_peak 30 N: a blow that counts would not be"),
        ({"peak_force": 20}, "weakest_peak 30 N is above peak_force 20 N"),
    ],
)
def test_a_hammer_step_whose_blows_can_never_count_is_refused(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(SequenceError, match=re.escape(f"steps.0.hammer: {words}")):
        sequence_from(changed(("steps", 0), PLAIN["steps"][0] | fields))


def test_blows_beyond_the_range_of_the_hammers_channel_are_refused_whatever_its_polarity() -> None:
    step = HammerStep(step="hammer", peak_force=4900.0)
    for polarity in (1, -1):
        for maximum, ends in ((2000.0, True), (5000.0, False)):
            hammer = replace(HAMMER_CHANNEL, minimum=-0.0, maximum=maximum, polarity=polarity)
            instruments = Instruments("local", None, "/dev/ttyNothing", (hammer, ACCELEROMETER))
            with (
                pytest.raises(ChannelError, match="'hammer' ends at 2000 N, below the peak_force 4900 N")
                if ends
                else nullcontext()
            ):
                channels_of(step, instruments)


def test_the_beam_hangs_once() -> None:
    hung = PLAIN["steps"][0] | {"beam": "suspended"}
    assert sequence_from(changed(("steps",), [hung, PLAIN["steps"][0]])).hangs_beam
    assert not sequence_from(PLAIN).hangs_beam
    with pytest.raises(SequenceError, match="more than one hammer step on the suspended beam"):
        sequence_from(changed(("steps",), [hung, hung]))


@pytest.mark.parametrize(
    "path", [("article", "colour"), ("article", "beam", "lenght"), ("article", "joints", 1, "nodes")]
)
def test_a_key_that_the_article_does_not_have_is_named(path: tuple[Any, ...]) -> None:
    where = ".".join(map(str, path))
    with pytest.raises(SequenceError, match=f"sequence: {where}: there is no such key"):
        sequence_from(changed(path, 1.0))


def test_two_pieces_of_one_name_are_refused() -> None:
    with pytest.raises(SequenceError, match=r"blank\.piece: blank is another piece or a joint"):
        sequence_from(changed(("steps",), [{"step": "blank"}, {"step": "blank"}]))


def test_the_plan_of_a_sweep_is_in_si() -> None:
    plan = sweep_plan(SweepStep(step="sweep", amplitudes_pp_mm=(0.1, 0.01), preset_mm=0.4))
    assert plan.amplitudes_pp == pytest.approx((1e-4, 1e-5))
    assert plan.preset == pytest.approx(4e-4)


HAMMER, SWEEP = ("steps", 0), ("steps", 1)


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (("format",), "jointlab-sequence/2", "format: is 'jointlab-sequence/2'; it has to be 'jointlab-sequence/1'"),
        (("title",), "", "title: is ''; it needs 1 or more characters"),
        (("steps",), [], "steps: "),
        ((*HAMMER, "step"), "tickle", "steps.0: "),
        ((*HAMMER, "blows"), 0, "steps.0.hammer.blows: is 0; it has to be 2 or more"),
        ((*HAMMER, "blows"), "ten", "steps.0.hammer.blows: is 'ten', which is no whole number"),
        ((*HAMMER, "blow"), 10, "steps.0.hammer.blow: there is no such key"),
        ((*HAMMER, "points"), [], "steps.0.hammer.points: "),
        ((*HAMMER, "points"), ["3y", "3y"], "steps.0.hammer.points: a point comes twice"),
        ((*HAMMER, "points"), ["y3"], "'y3' is not a degree of freedom; write node and direction, such as 3y"),
        ((*HAMMER, "points"), ["3r"], "3r: a hammer strikes along x or y"),
        ((*HAMMER, "points"), ["3y", "12y"], "steps.0.hammer.points.1: no node for 12y; the article has 11 nodes"),
        ((*HAMMER, "sample_rate"), float("inf"), "steps.0.hammer.sample_rate: is inf, which is no finite number"),
        ((*HAMMER, "sample_rate"), 2000.0, "highest_frequency 1024 Hz is above half the sample_rate 2000 Hz"),
        ((*HAMMER, "pretrigger_seconds"), 0.0, "pretrigger_seconds 0 have to be between 0 and block_seconds 2"),
        ((*HAMMER, "pretrigger_seconds"), 2.0, "pretrigger_seconds 2 have to be between 0 and block_seconds 2"),
        ((*SWEEP, "specimens"), ["I", "III"], "steps.1.sweep.specimens.1: no joint III in the article"),
        (
            (*SWEEP, "configurations"),
            ["tension"],
            "steps.1.sweep.configurations.0: is 'tension'; it",
        ),
        (
            (*SWEEP, "amplitudes_pp_mm"),
            [0.1, -0.1],
            "steps.1.sweep.amplitudes_pp_mm.1: is -0.1; it",
        ),
        ((*SWEEP, "amplitudes_pp_mm"), [0.0], "steps.1.sweep.amplitudes_pp_mm.0: "),
        (
            (*SWEEP, "amplitudes_pp_mm"),
            [float("nan")],
            "steps.1.sweep.amplitudes_pp_mm.0: is nan, which",
        ),
        ((*SWEEP, "preset_mm"), -1, "steps.1.sweep.preset_mm: "),
        ((*SWEEP, "frequencies"), {"first": 9, "last": 5}, "last (5 Hz) is below first (9 Hz)"),
        ((*SWEEP, "frequencies", "step"), 1e-320, "makes more than 10000 frequencies"),
        ((*SWEEP, "sample_rate"), 1000, "sample_rate 1000 Hz is less than 10 times the highest frequency, 200 Hz"),
        (HAMMER, PLAIN["steps"][1], "steps.1: more than one sweep"),
        (("article", "beam", "youngs_modulus"), 207, "article.beam.youngs_modulus: "),
        (("article", "node_positions"), [0.0, 0.5, 0.4], "article: node_positions do not rise"),
        (("article", "joints", 0, "node"), 12, "article: joint I is at node 12; node_positions has 11"),
        (("article", "beam", "length"), 0.95, "nodes run from 0.0 m to 0.914 m, the beam from 0 to 0.95 m"),
        (("article", "node_positions", 0), 0.001, "nodes run from 0.001 m to 0.914 m, the beam from 0 to 0.914 m"),
        (("article", "beam", "free_damping_ratios"), [0.001, 2], "article.beam.free_damping_ratios.1: is 2"),
        (("article", "beam", "free_damping_ratios"), 60 * [0.1], "damping ratios of the free beam must lie in 0..1"),
        (("article", "joints", 0, "node"), 10, "joints need a node each of their own"),
        (("article", "accelerometer", "direction"), "z", "article.accelerometer.direction: "),
    ],
)
def test_an_error_is_named_with_its_place(path: tuple[Any, ...], value: Any, words: str) -> None:
    with pytest.raises(SequenceError, match=re.escape(words)) as refused:
        sequence_from(changed(path, value), "lab.yaml")
    assert str(refused.value).startswith("lab.yaml: ")
    assert "\n" not in str(refused.value)


def test_a_sweep_alone_needs_no_beam_between_its_nodes() -> None:
    document = changed(("article", "beam", "length"), 0.95)
    assert sequence_from(document | {"steps": document["steps"][1:]}).article.beam.length == 0.95


REQUIRED = [("format",), ("title",), ("article",), ("steps",), (*HAMMER, "step")] + [
    path for path in places(PLAIN["article"], ("article",)) if isinstance(path[-1], str) and len(path) > 1
]


@pytest.mark.parametrize("path", REQUIRED, ids=lambda path: ".".join(map(str, path)))
def test_a_missing_key_is_named(path: tuple[Any, ...]) -> None:
    with pytest.raises(SequenceError) as refused:
        sequence_from(without(path))
    assert path[-1] in str(refused.value)


def test_a_date_of_yaml_is_accepted_as_a_title(tmp_path: Path) -> None:
    file = tmp_path / "dated.yaml"
    file.write_text(PAPER.replace("title: Beam on two elastomeric joints, both experiments", "title: 2026-03-02"))
    assert load_sequence(file).title == "2026-03-02"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"title: 2026-13-45", "not valid YAML: month must be in 1..12"),
        (b"blows: !!bool maybe", "not valid YAML"),
        (b"blows: !!int ''", "not valid YAML"),
        (b"when: !!timestamp soon", "not valid YAML"),
        (b"a: [1, 2", "not valid YAML: while parsing a flow sequence"),
        (b"a: !!python/object/apply:os.system [true]", "could not determine a constructor"),
        (b"a: &a [*a]", "not valid YAML: the document holds itself"),
        (b"[" * 5000, "not valid YAML"),
        (b"? 2026-01-01\n: key", "has no JSON form: keys must be str"),
        (b"title: \xff\xfe", "is not UTF-8 text"),
        (b"", "document: is "),
        (b"just words", "document: is "),
    ],
)
def test_a_file_that_is_no_document_is_refused_in_one_line(tmp_path: Path, content: bytes, words: str) -> None:
    file = tmp_path / "bad.yaml"
    file.write_bytes(content)
    with pytest.raises(SequenceError, match=re.escape(words)) as refused:
        load_sequence(file)
    assert str(refused.value).startswith(str(file))
    assert "\n" not in str(refused.value)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(SequenceError, match=r"nowhere\.yaml cannot be read: No such file"):
        load_sequence(tmp_path / "nowhere.yaml")
    with pytest.raises(SequenceError, match="cannot be read: Is a directory"):
        load_sequence(tmp_path)


scalars = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | st.dates() | st.binary()
anything = st.recursive(
    scalars, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3)
)


def refusal(read: Callable[[], Sequence]) -> str | None:
    """The words of a refusal, None where a sequence was read that can be stored and asked for."""
    try:
        sequence = read()
    except SequenceError as error:
        return str(error)
    assert sequence_from(sequence.model_dump(mode="json")) == sequence
    return None


@given(st.sampled_from(places(PLAIN)), anything)
def test_any_change_is_accepted_whole_or_refused_with_its_place(path: tuple[Any, ...], value: Any) -> None:
    words = refusal(lambda: sequence_from(changed(path, value), "lab.yaml"))
    # a rule between parts of the document is broken in the document as a whole
    place = rf"({path[0]}|document)" if path else ""
    assert words is None or re.match(rf"lab\.yaml: (.*; )?{place}", words, re.DOTALL)


@settings(max_examples=60)
@given(
    st.integers(0, len(PAPER)),
    st.integers(0, 40),
    st.text(st.sampled_from("[]{}:,-!&*?|>'\"#% \t\n0.ey\x00é"), max_size=6),
)
def test_a_damaged_text_is_refused_as_a_sequence_or_read(
    tmp_path_factory: pytest.TempPathFactory, at: int, length: int, inserted: str
) -> None:
    file = tmp_path_factory.getbasetemp() / "damaged.yaml"
    file.write_text(PAPER[:at] + inserted + PAPER[at + length :], encoding="utf-8")
    words = refusal(lambda: load_sequence(file))
    assert words is None or words.startswith(str(file))


@given(st.floats(1, 50), st.floats(0.1, 4), st.integers(0, 200))
def test_frequencies_include_both_ends(first: float, step: float, count: int) -> None:
    values = Frequencies(first=first, last=first + count * step, step=step).values
    assert len(values) == count + 1
    assert values[0] == first
    assert values[-1] == pytest.approx(first + count * step)


@pytest.mark.parametrize(
    ("path", "value", "error"),
    [
        ((*SWEEP, "amplitudes_pp_mm"), [0.1, 0.4], LimitExceededError),
        ((*SWEEP, "preset_mm"), 2.0, LimitExceededError),
        ((*SWEEP, "frequencies"), {"first": 5, "last": 300}, LimitExceededError),
        ((*SWEEP, "amplitudes_pp_mm"), [0.1, 0.1], PlanError),
        ((*SWEEP, "specimens"), ["I", "I"], PlanError),
    ],
)
def test_a_plan_beyond_the_rig_is_found_before_anything_runs(
    path: tuple[Any, ...], value: Any, error: type[Exception]
) -> None:
    with pytest.raises(error):
        check_plan(sequence_from(changed(path, value)), TesterLimits())


HAMMER = ("steps", next(i for i, step in enumerate(PLAIN["steps"]) if step["step"] == "hammer"))


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ((*HAMMER, "sample_rate"), 1e9),
        ((*HAMMER, "block_seconds"), 1e6),
        ((*HAMMER, "blows"), 10**9),
        ((*HAMMER, "points"), [f"{1 + i % 11}y" for i in range(10_000)]),
        ((*SWEEP, "sample_rate"), 1e9),
        ((*SWEEP, "preset_mm"), 1e6),
        ((*SWEEP, "amplitudes_pp_mm"), [1e3]),
        ((*SWEEP, "amplitudes_pp_mm"), [0.001 * i for i in range(1, 1000)]),
        ((*SWEEP, "frequencies"), {"first": 1, "last": 1e6}),
        (("steps",), [{"step": "wait", "seconds": 1e9}]),
        (("steps",), [{"step": "soak", "seconds": 1e9, "limit_seconds": 2e9}]),
        (("steps",), [{"step": "wait", "seconds": 1.0}] * 10_000),
        (("title",), "x" * 10_000),
    ],
)
def test_nothing_in_a_sequence_is_without_an_upper_bound(path: tuple[Any, ...], value: Any) -> None:
    with pytest.raises(SequenceError):
        sequence_from(changed(path, value))


def test_a_block_of_many_samples_is_refused_with_its_length() -> None:
    step = {"step": "hammer", "sample_rate": 102_400, "block_seconds": 60, "highest_frequency": 1000}
    with pytest.raises(SequenceError, match=r"60 s at 102400 Hz are more than 4,000,000 samples"):
        sequence_from(changed(("steps",), [step]))
