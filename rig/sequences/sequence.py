"""A sequence: the test article and the experiments on it, as a YAML document that is checked before anything moves."""

from __future__ import annotations

import json
import secrets
from collections.abc import Callable
from typing import Annotated, Literal, TypeVar

from pydantic import Field, ValidationError, field_validator, model_validator
from pydantic_core import InitErrorDetails

from analysis.dof import Direction, Dof
from analysis.errors import AnalysisError
from rig.article import check_identifiable
from rig.document import Document
from rig.errors import RequestError
from rig.registers import COMMAND
from rig.sequences.sweep_plan import Order
from rig.tester.detectors import StepDetectors
from store.exchange.bundle_setup import Article, unknown_keys
from store.quantity import quantity
from store.states import ConfigurationName
from store.validation import FieldPath, contradiction, faults_text, own_faults

DISPLACEMENT, FORCE = "displacement", "force"
"""Names of the tester's two channels."""
PAPER_POINTS = ("1y", "3y", "4y", "5y", "6y", "7y", "8y", "9y", "11y", "1x", "11x")
MOST_FREQUENCIES = 10_000
LARGEST_SEED = 2**53 - 1  # the largest integer that every reader of JSON keeps exactly
SAMPLES_A_CYCLE = 10  # so that five harmonics are below Nyquist
LARGEST_RATE = 204_800.0  # Hz, twice that of fast modules for sound and vibration (NI 9250: 102.4 kHz)
LONGEST_BLOCK = 120.0  # s; a resonance of 0.1 Hz in 12 periods
LARGEST_RECORD = 4_000_000  # samples of a channel: two channels in float64 are 64 MB
MOST_BLOWS = 1_000  # at a point
LONGEST_BEAM = 1_000.0  # m
LARGEST_MASS = 1e6  # kg
LARGEST_K = 1e12  # N/m, a thousand times a machine frame
LARGEST_FORCE = 50_000.0  # N, beyond the largest sledge hammers with a force sensor
LONGEST_WAIT = 7 * 86_400.0  # s, a week
LONGEST_PROMPT = 500  # characters
HIGHEST_FREQUENCY = COMMAND.range_of("frequency")[1]
LARGEST_MM = 1e3 * COMMAND.range_of("amplitude")[1]
MOST_POINTS = 1_000  # points of a hammer step, and steps of a sequence
MOST_ENTRIES = 100  # in a list that a person writes
LONGEST_NAME, LONGEST_TITLE = 100, 500  # characters

Amplitude = Annotated[float, Field(gt=0, le=LARGEST_MM)]
_Sines = TypeVar("_Sines", "SweepStep", "BlankStep")


class SequenceError(RequestError):
    """A sequence document that cannot be run as it stands.

    Attributes:
        faults: each of them with its line and place; empty where the document as a whole cannot be read.
    """

    def __init__(self, *said: object, faults: tuple[str, ...] = ()) -> None:
        super().__init__(*said)
        self.faults = faults


class Suspension(Document):
    """The cords of a suspended beam, as far as they are known."""

    bounce: Annotated[float, quantity("Hz", "frequency of the beam's bounce in its cords", gt=0, le=HIGHEST_FREQUENCY)]
    bounce_standard_error: Annotated[float, quantity("Hz", ge=0, le=HIGHEST_FREQUENCY)] = 0.1
    positions: Annotated[
        tuple[Annotated[float, Field(ge=0, le=LONGEST_BEAM)], ...],
        quantity("m", "of the cords along the beam, from its left end", max_length=MOST_ENTRIES),
    ] = ()
    loss_factor: Annotated[float, quantity("1", "of the cords", ge=0, le=10)] = 0.0


class Weight(Document):
    """The mass of the bare beam from a balance."""

    mass: Annotated[float, quantity("kg", gt=0, le=LARGEST_MASS)]
    standard_error: Annotated[float, quantity("kg", gt=0, le=LARGEST_MASS)] = 0.001


class HammerStep(Document):
    """Roving hammer: `blows` accepted blows at each point, one accelerometer."""

    step: Literal["hammer"]
    points: tuple[str, ...] = Field(
        default=PAPER_POINTS, min_length=1, max_length=MOST_POINTS, description="points struck, such as 3y"
    )
    blows: int = Field(default=10, ge=2, le=MOST_BLOWS, description="accepted blows at each point")
    peak_force: Annotated[
        float, quantity("N", "hammer level that the operator is asked for", gt=0, le=LARGEST_FORCE)
    ] = 100.0
    weakest_peak: Annotated[float, quantity("N", "a blow below this peak is refused", gt=0, le=LARGEST_FORCE)] = 30.0
    trigger_level: Annotated[float, quantity("N", gt=0, le=LARGEST_FORCE)] = 10.0
    sample_rate: Annotated[float, quantity("Hz", gt=0, le=LARGEST_RATE)] = 5120.0
    block_seconds: Annotated[float, quantity("s", gt=0, le=LONGEST_BLOCK)] = 2.0
    pretrigger_seconds: Annotated[float, quantity("s", ge=0, le=LONGEST_BLOCK)] = 0.05
    highest_frequency: Annotated[float, quantity("Hz", "of the accelerances kept", gt=0, le=LARGEST_RATE)] = 1024.0
    hammer: str = Field(default="hammer", max_length=LONGEST_NAME, description="name of the hammer's channel")
    accelerometer: str = Field(
        default="accelerometer", max_length=LONGEST_NAME, description="name of the accelerometer's channel"
    )
    beam: Literal["supported", "suspended"] = Field(
        default="supported", description="on its joints, or free of them in soft cords"
    )
    suspension: Suspension | None = Field(default=None, description="of a suspended beam, where it is known")
    weight: Weight | None = Field(default=None, description="of the bare beam, where it was weighed")

    @model_validator(mode="after")
    def _check_cords(self) -> HammerStep:
        if self.beam == "supported" and (self.suspension or self.weight):
            raise ValueError("suspension and weight are of a suspended beam; say beam: suspended, or leave them out")
        return self

    @model_validator(mode="after")
    def _check_forces(self) -> HammerStep:
        if self.weakest_peak > self.peak_force:
            raise ValueError(
                f"weakest_peak {self.weakest_peak:g} N is above peak_force {self.peak_force:g} N: a blow that is "
                "struck as asked for would be refused"
            )
        if self.trigger_level > self.weakest_peak:
            raise ValueError(
                f"trigger_level {self.trigger_level:g} N is above weakest_peak {self.weakest_peak:g} N: a blow that "
                "counts would not be seen"
            )
        return self

    @model_validator(mode="after")
    def _check_block(self) -> HammerStep:
        if not 0 < self.pretrigger_seconds < self.block_seconds:
            raise ValueError(
                f"pretrigger_seconds {self.pretrigger_seconds:g} have to be between 0 and block_seconds "
                f"{self.block_seconds:g}"
            )
        if self.sample_rate * self.block_seconds > LARGEST_RECORD:
            raise ValueError(
                f"{self.block_seconds:g} s at {self.sample_rate:g} Hz are more than {LARGEST_RECORD:,} samples; "
                "sample more slowly, or shorter blocks"
            )
        if self.highest_frequency > self.sample_rate / 2:
            raise ValueError(
                f"highest_frequency {self.highest_frequency:g} Hz is above half the sample_rate {self.sample_rate:g} Hz"
            )
        return self

    @field_validator("points")
    @classmethod
    def _check_points(cls, points: tuple[str, ...]) -> tuple[str, ...]:
        for point in points:
            try:
                dof = Dof.parse(point)
            except AnalysisError as error:
                raise ValueError(str(error)) from error
            if dof.direction is Direction.ROTATION:
                raise ValueError(f"{point}: a hammer strikes along x or y")
        if len(set(points)) < len(points):
            raise ValueError("a point comes twice")
        return points


class Frequencies(Document):
    """Evenly spaced frequencies, both ends included."""

    first: Annotated[float, quantity("Hz", gt=0, le=HIGHEST_FREQUENCY)] = 5.0
    last: Annotated[float, quantity("Hz", gt=0, le=HIGHEST_FREQUENCY)] = 200.0
    step: Annotated[float, quantity("Hz", gt=0, le=HIGHEST_FREQUENCY)] = 5.0

    @model_validator(mode="after")
    def _ordered(self) -> Frequencies:
        if self.last < self.first:
            raise ValueError(f"last ({self.last:g} Hz) is below first ({self.first:g} Hz)")
        if (self.last - self.first) / self.step >= MOST_FREQUENCIES:
            raise ValueError(f"a step of {self.step:g} Hz makes more than {MOST_FREQUENCIES} frequencies")
        return self

    @property
    def values(self) -> tuple[float, ...]:
        """The frequencies in Hz, rising."""
        count = int((self.last - self.first) / self.step + 1e-9) + 1
        return tuple(self.first + index * self.step for index in range(count))


def _check_sines(step: _Sines) -> _Sines:
    """Check that the sample rate resolves the harmonics, and that the detectors leave room for every cycle."""
    if step.sample_rate < SAMPLES_A_CYCLE * step.frequencies.last:
        raise ValueError(
            f"sample_rate {step.sample_rate:g} Hz is less than {SAMPLES_A_CYCLE} times the highest frequency, "
            f"{step.frequencies.last:g} Hz"
        )
    if step.detectors is not None:
        reach = (step.amplitude_pp_mm if isinstance(step, BlankStep) else max(step.amplitudes_pp_mm)) / 2
        step.detectors.check_room(step.preset_mm - reach, step.preset_mm + reach)
    return step


BESIDE = "points at its multiples are measured a few hertz beside them, clear of hum; null: at them, as planned"
TASK = "what the operator is asked to do, as a command"
TIGHTER = "limit detectors of the tester that are tighter while the step lasts than at the instrument"
Mains = Annotated[Literal[50, 60] | None, quantity("Hz", BESIDE)]


class SweepStep(Document):
    """Swept sine in the tester: every specimen in every configuration at every amplitude and frequency, once."""

    step: Literal["sweep"]
    specimens: tuple[str, ...] = Field(default=("I", "II"), min_length=1, max_length=MOST_ENTRIES)
    configurations: tuple[ConfigurationName, ...] = Field(
        default=("compression", "shear", "angled"), min_length=1, max_length=3
    )
    amplitudes_pp_mm: Annotated[
        tuple[Amplitude, ...], quantity("mm", "peak to peak", min_length=1, max_length=MOST_ENTRIES)
    ] = (0.1, 0.05, 0.01)
    preset_mm: Annotated[float, quantity("mm", ge=0, le=LARGEST_MM)] = 0.5
    frequencies: Frequencies = Frequencies()
    sample_rate: Annotated[float, quantity("Hz", gt=0, le=LARGEST_RATE)] = 5000.0
    mains_frequency: Mains = 50
    order: Order = Field(
        default=Order.SEQUENTIAL,
        description="what is shuffled: nothing; amplitudes; mountings and amplitudes; all, frequencies too",
    )
    seed: int | None = Field(
        default=None, ge=0, le=LARGEST_SEED, description="of the shuffling; drawn and recorded where it is not given"
    )
    detectors: StepDetectors | None = Field(default=None, description=TIGHTER)

    @model_validator(mode="after")
    def _check_seed(self) -> SweepStep:
        if self.order is Order.SEQUENTIAL and self.seed is not None:
            raise ValueError("a seed shuffles nothing in sequential order; leave it out, or name another order")
        return self

    _checked = model_validator(mode="after")(_check_sines)

    @property
    def points(self) -> int:
        """Number of sine points."""
        series = len(self.specimens) * len(self.configurations) * len(self.amplitudes_pp_mm)
        return series * len(self.frequencies.values)


class BlankStep(Document):
    """Sines on a known piece in place of a specimen: they show the contribution of the tester itself."""

    step: Literal["blank"]
    piece: str = Field(
        default="blank",
        min_length=1,
        max_length=LONGEST_NAME,
        description="what the operator is to put in: blank, empty, mass",
    )
    stiffness: Annotated[
        float | None,
        quantity("N/m", "0 where there is none; leave it out where it is rigid beside the frame", ge=0, le=LARGEST_K),
    ] = None
    stiffness_standard_error: Annotated[float, quantity("N/m", ge=0, le=LARGEST_K)] = 0.0
    mass: Annotated[float, quantity("kg", "of the piece, that moves with the fixture", ge=0, le=LARGEST_MASS)] = 0.0
    amplitude_pp_mm: Annotated[float, quantity("mm", "peak to peak", gt=0, le=LARGEST_MM)] = 0.01
    preset_mm: Annotated[float, quantity("mm", ge=0, le=LARGEST_MM)] = 0.0
    frequencies: Frequencies = Frequencies(first=20.0, last=200.0, step=20.0)
    sample_rate: Annotated[float, quantity("Hz", gt=0, le=LARGEST_RATE)] = 5000.0
    mains_frequency: Mains = 50
    detectors: StepDetectors | None = Field(default=None, description=TIGHTER)

    _checked = model_validator(mode="after")(_check_sines)

    @model_validator(mode="after")
    def _check_stiffness(self) -> BlankStep:
        if self.stiffness_standard_error and not self.stiffness:
            raise ValueError("stiffness_standard_error belongs to a stiffness; give that, too")
        return self

    @property
    def points(self) -> int:
        """Number of sine points."""
        return len(self.frequencies.values)


class WaitStep(Document):
    """Wait, for example until the specimens have recovered."""

    step: Literal["wait"]
    seconds: Annotated[float, quantity("s", gt=0, le=LONGEST_WAIT)]


class SoakStep(Document):
    """Wait until the temperature has stayed within a band for a time."""

    step: Literal["soak"]
    seconds: Annotated[float, quantity("s", "so long within the band", gt=0, le=LONGEST_WAIT)] = 1800.0
    band_celsius: Annotated[float, quantity("K", "highest less lowest reading", gt=0, le=100)] = 0.5
    celsius: Annotated[
        float | None, quantity("degC", "middle of the band; wherever it settles if not given", ge=-100, le=300)
    ] = None
    limit_seconds: Annotated[float, quantity("s", "the run fails when this is not enough", gt=0, le=LONGEST_WAIT)] = (
        14400.0
    )

    @model_validator(mode="after")
    def _check_limit(self) -> SoakStep:
        if self.limit_seconds < self.seconds:
            raise ValueError(f"limit_seconds {self.limit_seconds:g} are over before seconds {self.seconds:g} are")
        return self


class PromptStep(Document):
    """Ask the operator for a task, and wait until it is done."""

    step: Literal["prompt"]
    text: str = Field(min_length=1, max_length=LONGEST_PROMPT, description=TASK)


Step = Annotated[HammerStep | SweepStep | BlankStep | WaitStep | SoakStep | PromptStep, Field(discriminator="step")]
SineStep = SweepStep | BlankStep


class Compound(Document):
    """How the elastomer depends on temperature, near the reference that results are wanted at."""

    reference_celsius: Annotated[float, quantity("degC")] = 23.0
    stiffness_per_kelvin: Annotated[float, quantity("1/K", "relative change of k; negative where it softens")]
    stiffness_per_kelvin_error: Annotated[float, quantity("1/K", "one standard deviation", ge=0)]
    loss_factor_per_kelvin: Annotated[float, quantity("1/K", "relative change of gamma")]
    loss_factor_per_kelvin_error: Annotated[float, quantity("1/K", "one standard deviation", ge=0)]
    thermometer_error: Annotated[float, quantity("K", "one standard deviation", ge=0)] = 0.1


class Sequence(Document):
    """The whole document."""

    format: Literal["jointlab-sequence/1"]
    title: str = Field(min_length=1, max_length=LONGEST_TITLE)
    article_name: str = Field(
        min_length=1, max_length=LONGEST_TITLE, description="by which its joints are known over the years"
    )
    article: Article = Field(description="what was built, in the words of a bundle's setup.json")
    compound: Compound | None = Field(
        default=None, description="with it, sine points are given at its reference temperature"
    )
    steps: tuple[Step, ...] = Field(min_length=1, max_length=MOST_POINTS)

    @property
    def hammer_steps(self) -> tuple[HammerStep, ...]:
        """The hammer steps; the n-th of them measures set n."""
        return tuple(step for step in self.steps if isinstance(step, HammerStep))

    @property
    def hangs_beam(self) -> bool:
        """Whether a step has the beam off its joints."""
        return any(step.beam == "suspended" for step in self.hammer_steps)

    @property
    def sweep(self) -> SweepStep | None:
        """The sweep, if there is one."""
        return next((step for step in self.steps if isinstance(step, SweepStep)), None)

    @property
    def sine_steps(self) -> tuple[tuple[SineStep, int], ...]:
        """The steps on the tester in order, each with the order number of its first sine point."""
        found, first = list[tuple[SineStep, int]](), 1
        for step in self.steps:
            if isinstance(step, SineStep):
                found.append((step, first))
                first += step.points
        return tuple(found)

    def with_seed(self) -> Sequence:
        """The sequence, to be stored, with a seed drawn for a sweep that is shuffled and has none."""
        drawn = tuple(
            step.model_copy(update={"seed": secrets.randbelow(LARGEST_SEED + 1)})
            if isinstance(step, SweepStep) and step.order is not Order.SEQUENTIAL and step.seed is None
            else step
            for step in self.steps
        )
        return self.model_copy(update={"steps": drawn})

    @model_validator(mode="after")
    def _check_article(self) -> Sequence:
        if self.hammer_steps:
            try:
                check_identifiable(self.article)
            except AnalysisError as error:
                raise contradiction(str(error), "article") from error
        nodes = len(self.article.node_positions)
        joints = {joint.name for joint in self.article.joints}
        names = set(joints)
        for number, step in enumerate(self.steps):
            at = ("steps", number, step.step)
            if isinstance(step, HammerStep):
                beyond = [index for index, point in enumerate(step.points) if Dof.parse(point).node > nodes]
                if beyond:
                    named = ", ".join(step.points[index] for index in beyond)
                    raise contradiction(f"no node for {named}; the article has {nodes} nodes", *at, "points", beyond[0])
            elif isinstance(step, SweepStep):
                unknown = [index for index, name in enumerate(step.specimens) if name not in joints]
                if unknown:
                    named = ", ".join(step.specimens[index] for index in unknown)
                    raise contradiction(f"no joint {named} in the article", *at, "specimens", unknown[0])
            elif isinstance(step, BlankStep):
                if step.piece in names:
                    raise contradiction(f"{step.piece} is another piece or a joint; names have to differ", *at, "piece")
                names.add(step.piece)
        hung = [n for n, step in enumerate(self.steps) if isinstance(step, HammerStep) and step.beam == "suspended"]
        if len(hung) > 1:
            raise contradiction("more than one hammer step on the suspended beam; put all into one", "steps", hung[1])
        swept = [n for n, step in enumerate(self.steps) if isinstance(step, SweepStep)]
        if len(swept) > 1:
            raise contradiction("more than one sweep; put all specimens and amplitudes into one", "steps", swept[1])
        return self


def validated_sequence(document: object) -> Sequence:
    """The sequence that a document of plain values describes; every reader of one comes this way.

    Raises ValidationError where it describes none; other ValueErrors, TypeError, RecursionError where it has no JSON
    form.
    """
    # through JSON text, where an array is a tuple, and a date of YAML becomes the text that was written
    sequence = Sequence.model_validate_json(json.dumps(document, default=str))
    # a bundle ignores unknown keys of its article; here a misspelt key would be lost
    assert isinstance(document, dict), "nothing else is a sequence"
    unknown = unknown_keys(document["article"], sequence.article.model_dump(mode="json"))
    faults = [
        InitErrorDetails(type="extra_forbidden", loc=("article", *path.split(".")), input=None) for path in unknown
    ]
    if faults:
        raise ValidationError.from_exception_data(Sequence.__name__, faults)
    return sequence


def sequence_from(
    document: object, source: str = "sequence", line: Callable[[FieldPath], str] = lambda _: ""
) -> Sequence:
    """Check a document that is already plain values; `source` names it in errors, `line` the line of a place in it.

    Raises SequenceError where it does not describe a sequence; says what is wrong, where.
    """
    try:
        return validated_sequence(document)
    except ValidationError as error:
        faults = tuple(faults_text([each], where=line) for each in own_faults(error.errors()))
        raise SequenceError(f"{source}: {'; '.join(faults)}", faults=faults) from error
    except (TypeError, ValueError, RecursionError) as error:
        raise SequenceError(f"{source}: has no JSON form: {error}") from error
