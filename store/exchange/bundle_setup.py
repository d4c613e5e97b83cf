"""setup.json of a bundle, checked: the test article and its measurements."""

import json
from collections.abc import Iterator
from itertools import pairwise
from pathlib import PurePosixPath
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator

from store.dof import StoredDof
from store.errors import StoreError
from store.quantity import quantity
from store.states import HAMMER, Excitation
from store.validation import faults_text

FORMAT: Literal["jointlab-bundle/1"] = "jointlab-bundle/1"


def _plain_name(name: str) -> str:
    if not name or PurePosixPath(name).name != name or name in (".", "..") or any(c in name for c in "\\:\0"):
        raise ValueError("is not the plain name of a file in the bundle")
    return name


FileName = Annotated[str, AfterValidator(_plain_name)]
Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
UpToFifth = Annotated[float, Field(ge=0, le=0.2)]
Node = Annotated[int, Field(ge=1)]
Angle = Annotated[float, quantity("deg", ge=-360, le=360)]


LARGEST_ADDED = 10.0
"""Largest added mass of a joint, as a multiple of the mass of the beam."""


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, frozen=True, allow_inf_nan=False)


class BeamSetup(_Part):
    """The beam; the ranges catch values in other units, such as damping in per cent."""

    length: Annotated[float, quantity("m", gt=0, le=100)]
    height: Annotated[float, quantity("m", gt=0, le=10)]
    width: Annotated[float, quantity("m", gt=0, le=10)]
    youngs_modulus: Annotated[float, quantity("Pa", ge=1e6, le=2e12)]
    poisson_ratio: Annotated[float, quantity("1", ge=0, lt=0.5)]
    density: Annotated[float, quantity("kg/m^3", ge=10, le=3e4)]
    free_damping_ratios: Annotated[tuple[UpToFifth, ...], quantity("1", "of the free beam's modes")]


class JointSetup(_Part):
    """One joint: two inclined cylinders, lower and upper, with eccentricities -e and +e, at a node."""

    name: Annotated[str, Field(min_length=1)]
    node: Node
    inclinations_deg: Annotated[tuple[Angle, Angle], quantity("deg", "of the lower and the upper cylinder")]
    eccentricity: Annotated[float, quantity("m")]
    added_mass: Annotated[NotNegative, quantity("kg")]


class Accelerometer(_Part):
    """The accelerometer, its place and its mass."""

    node: Node
    direction: Literal["x", "y"]
    mass: Annotated[NotNegative, quantity("kg")]


class InverseSet(_Part):
    """One set and its file: of a roving hammer, or of a shaker that stays while the accelerometer roves."""

    file: FileName
    averages: Annotated[int, Field(ge=1, le=1_000_000)]
    peak_force: Annotated[Positive, quantity("N", "of the blows, or amplitude of the sine")]
    temperature_c: Annotated[float, quantity("degC", gt=-273.15, lt=1000)]
    window: str
    sample_rate: Annotated[Positive, quantity("Hz")]
    block_seconds: Annotated[Positive, quantity("s")]
    excitation: Excitation = HAMMER


class DirectTable(_Part):
    """The table of the elastomer tester, and its preset."""

    file: FileName
    preset_mm: Annotated[NotNegative, quantity("mm")]


class StatedTolerances(_Part):
    """Uncertainties, one standard deviation each; a unit of 1 is relative.

    The last three may be left out: a diagnosis then estimates them.
    """

    node_position: Annotated[NotNegative, quantity("m")]
    sensor_gain: Annotated[NotNegative, quantity("1")]
    youngs_modulus: Annotated[NotNegative, quantity("1")]
    density: Annotated[NotNegative, quantity("1")]
    impact_position: Annotated[NotNegative, quantity("m")]
    inclination_deg: Annotated[NotNegative, quantity("deg")]
    tester_gain: Annotated[NotNegative, quantity("1")]
    setup_scatter: Annotated[UpToFifth | None, quantity("1", "of a joint's stiffness between set-ups")] = None
    configuration_gain: Annotated[UpToFifth | None, quantity("1", "of the tester between configurations")] = None
    model_error: Annotated[UpToFifth | None, quantity("1", "of an accelerance, coherent over neighbouring lines")] = (
        None
    )


class RequestedPrediction(_Part):
    """A frequency response for the model to predict."""

    response: tuple[Node, Literal["x", "y"]]
    input: tuple[Node, Literal["x", "y"]]


class LeftOutPoint(_Part):
    """A sine point that the table of the tester cannot hold, left out of the bundle on request."""

    order: int
    specimen: str
    configuration: str
    amplitude_pp_mm: Annotated[float, quantity("mm", "peak to peak")]
    frequency_hz: Annotated[float, quantity("Hz")]
    why: str

    def __str__(self) -> str:
        conditions = f"{self.specimen}, {self.configuration}, {self.amplitude_pp_mm:g} mm p-p, {self.frequency_hz:g} Hz"
        return f"sine point {self.order} ({conditions}) was left out at the export: {self.why}"


class Article(_Part):
    """The test article, and the uncertainties of its values."""

    beam: BeamSetup
    node_positions: Annotated[tuple[NotNegative, ...], quantity("m", "from the left end, rising", min_length=2)]
    joints: Annotated[tuple[JointSetup, ...], Field(min_length=1)]
    accelerometer: Accelerometer
    tolerances: StatedTolerances

    @model_validator(mode="after")
    def _is_one_beam(self) -> Self:
        positions = self.node_positions
        if any(right <= left for left, right in pairwise(positions)):
            raise ValueError("node_positions do not rise")
        if positions[-1] > self.beam.length * (1 + 1e-9):
            raise ValueError(f"node_positions end at {positions[-1]} m, beyond the beam's length {self.beam.length} m")
        mass = self.beam.length * self.beam.height * self.beam.width * self.beam.density
        for joint in self.joints:
            self.check_known(joint.node, f"joint {joint.name}")
            _in_si(f"the eccentricity of joint {joint.name}", abs(joint.eccentricity), "m", self.beam.length)
            _in_si(f"the mass added at joint {joint.name}", joint.added_mass, "kg", LARGEST_ADDED * mass)
        self.check_known(self.accelerometer.node, "the accelerometer")
        _in_si("the mass of the accelerometer", self.accelerometer.mass, "kg", mass)
        _once("joints: a name", [joint.name for joint in self.joints])
        return self

    def check_known(self, node: int, what: str) -> None:
        """ValueError for a node that the beam does not have."""
        if node > len(self.node_positions):
            raise ValueError(f"{what} is at node {node}; node_positions has {len(self.node_positions)}")

    def check_node(self, dof: StoredDof, where: str) -> None:
        """StoreError for a point that the beam does not have: an unknown node, or a direction other than x and y."""
        if dof.node > len(self.node_positions) or dof.direction not in ("x", "y"):
            raise StoreError(f"{where}: unknown point {dof}; nodes are 1 to {len(self.node_positions)}, x or y")

    @property
    def specimens(self) -> tuple[str, ...]:
        """Names of the joints, which are also the names of their cylinders."""
        return tuple(joint.name for joint in self.joints)


class BundleSetup(Article):
    """All of setup.json; one of the two experiments may be missing.

    `checksums` maps file names to SHA-256 in hexadecimal digits, for any of the files; `sine_points_left_out` are those
    that were measured and are not in the table.
    """

    format: Literal["jointlab-bundle/1"]
    title: str
    inverse: tuple[InverseSet, ...] = ()
    direct: DirectTable | None = None
    predict: tuple[RequestedPrediction, ...] = ()
    sine_points_left_out: tuple[LeftOutPoint, ...] = ()
    checksums: dict[str, Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]] = {}

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if not self.inverse and self.direct is None:
            raise ValueError("there is neither a hammer set in inverse nor a table of the tester in direct")
        for prediction in self.predict:
            self.check_known(prediction.response[0], "a predicted response")
            self.check_known(prediction.input[0], "a predicted input")
        _once("a file", [*self.files, "setup.json"])
        return self

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files with measurements."""
        return (*(entry.file for entry in self.inverse), *(() if self.direct is None else (self.direct.file,)))


def _in_si(what: str, value: float, unit: str, largest: float) -> None:
    """ValueError for a value that is too large for this beam, and so in another unit."""
    if value > largest:
        raise ValueError(f"{what} is {value:g} {unit}; with this beam it has to be {largest:.3g} {unit} or less")


def _once(what: str, names: list[str]) -> None:
    if len(set(names)) != len(names):
        raise ValueError(f"{what} comes twice among {', '.join(names)}")


def parse_setup(content: bytes) -> tuple[BundleSetup, tuple[str, ...]]:
    """Read setup.json; also gives a warning for each unknown key.

    Raises StoreError if it is no JSON, a key is missing or comes twice, or a value is wrong; the message names the key.
    """
    try:
        document = json.loads(content, parse_constant=_refuse_constant, object_pairs_hook=_with_each_key_once)
    except (ValueError, RecursionError) as error:
        raise StoreError(f"setup.json is not JSON: {error}") from error
    if not isinstance(document, dict):
        raise StoreError("setup.json does not hold an object with named values")
    setup = setup_from(document)
    unknown = unknown_keys(document, setup.model_dump(mode="json"))
    return setup, tuple(f"setup.json: unknown key {key} is ignored" for key in unknown)


def unknown_keys(given: Any, known: Any, at: str = "") -> Iterator[str]:
    """Keys in `given`, by their path such as ``beam.lenght``, that are not in `known`; `at` begins every path."""
    if isinstance(given, dict) and isinstance(known, dict):
        for key, value in given.items():
            if key not in known:
                yield f"{at}{key}"
            else:
                yield from unknown_keys(value, known[key], f"{at}{key}.")
    elif isinstance(given, list) and isinstance(known, list):
        for index, (value, other) in enumerate(zip(given, known, strict=False)):
            yield from unknown_keys(value, other, f"{at}{index}.")


def setup_from(document: dict[str, Any]) -> BundleSetup:
    """A document in the form of setup.json; StoreError, which names the key, if a value is missing or wrong."""
    if document.get("format") != FORMAT:
        raise StoreError(f"setup.json: format is {document.get('format')!r}, expected {FORMAT!r}")
    return _checked(BundleSetup, document)


def article_from(document: dict[str, Any]) -> Article:
    """The article of a stored setup, whose other keys are ignored; errors as for `setup_from`."""
    return _checked(Article, document)


_Model = TypeVar("_Model", bound=_Part)


def _checked(model: type[_Model], document: dict[str, Any]) -> _Model:
    try:
        # Strict models take a JSON array for a tuple, but not a Python list: so the document becomes JSON text.
        return model.model_validate_json(json.dumps(document, allow_nan=False))
    except ValidationError as error:
        first = error.errors()[0]
        raise StoreError(f"setup.json: {faults_text([first], 'setup')}") from error
    except (TypeError, ValueError, RecursionError) as error:
        raise StoreError(f"setup.json has no JSON form: {error}") from error


def _with_each_key_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The object; Python would take the last of two values under one key."""
    found = dict(pairs)
    if len(found) < len(pairs):
        key = next(key for index, (key, _) in enumerate(pairs) if key in dict(pairs[:index]))
        raise ValueError(f"the key {key!r} comes twice in one object")
    return found


def _refuse_constant(text: str) -> float:
    raise ValueError(f"{text} is not a number")
