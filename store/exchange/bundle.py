"""Reading of a measurement bundle, a folder or a zip: all of it is checked first."""

import hashlib
import lzma
import math
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from store.dof import StoredDof
from store.errors import StoreError
from store.exchange.accelerance_file import read_accelerances
from store.exchange.blow_file import BundleBlow, read_blow
from store.exchange.blow_window import stated_window
from store.exchange.bundle_setup import BundleSetup, parse_setup
from store.exchange.direct_table import DirectPoint, read_direct
from store.exchange.uff import Position
from store.measurements.frequency_responses import FrequencyResponseSet
from store.states import HAMMER

SETUP, BLOWS = "setup.json", "blows"
_BLOW_SUFFIX = ".unv"
_ADDED_BY_MACS = "__MACOSX"
_SAME_PLACE = 1e-3
"""m by which a node of a file may lie elsewhere than in setup.json: the tolerance of marks on a beam."""
# A bundle has a few MB; more than this in a zip is a mistake, or an attempt to fill the disk.
_MOST_BYTES_IN_ZIP = 4 * 1024**3
# Errors of Python's zipfile for a damaged, encrypted or unusual archive.
_ZIP_ERRORS = (zipfile.BadZipFile, zlib.error, lzma.LZMAError, EOFError, NotImplementedError, RuntimeError)


@dataclass(frozen=True, eq=False)
class Bundle:
    """The measurements on one test article in both experiments.

    Attributes:
        setup: the article and its measurements; without checksums, which have been verified.
        inverse: the sets, in the order of setup.json; the first is the reference set. Empty where no beam was tested.
        direct: the rows of the tester's table, in the order of the file. Empty without a tester.
        blows: single blows, by file name.
        warnings: of unknown keys and columns, unnamed files, blows in files of another kind, and windows that cannot be
            corrected for, all ignored; of values that were converted, of nodes that lie elsewhere than in
            setup.json, and of sine points that were left out at the export.
    """

    setup: BundleSetup
    inverse: tuple[FrequencyResponseSet, ...]
    direct: tuple[DirectPoint, ...]
    blows: tuple[BundleBlow, ...]
    warnings: tuple[str, ...]


def read_bundle(path: Path) -> Bundle:
    """Read and check a bundle.

    Raises StoreError if a file is missing or damaged, a key is missing, a unit is wrong, a value is NaN or out of
    range, lengths differ, a node is unknown or a checksum differs; the message names the file, and the key or the line.
    """
    with _opened(path) as folder:
        setup, warnings = parse_setup(_content(folder, SETUP))
        _verify_checksums(folder, setup.checksums)
        setup = setup.model_copy(update={"checksums": {}})
        sets, set_warnings = _read_sets(folder, setup)
        table = setup.direct
        direct, direct_warnings = read_direct(_file(folder, table.file), setup.specimens) if table else ((), ())
        blows = tuple(_read_blow(file, setup) for file in sorted(folder.glob(f"{BLOWS}/*{_BLOW_SUFFIX}")))
        return Bundle(
            setup=setup,
            inverse=sets,
            direct=direct,
            blows=blows,
            warnings=(
                *warnings,
                *set_warnings,
                *direct_warnings,
                *_not_named(folder, setup),
                *map(str, setup.sine_points_left_out),
            ),
        )


ROUNDED = 1e-5
"""Share by which a frequency may be beyond half of the sample rate, as files have six digits or more."""


def _read_sets(folder: Path, setup: BundleSetup) -> tuple[tuple[FrequencyResponseSet, ...], tuple[str, ...]]:
    sets: list[FrequencyResponseSet] = []
    warnings: list[str] = []
    for number, entry in enumerate(setup.inverse, start=1):
        window, unknown = stated_window(entry.window, entry.block_seconds)
        measured = read_accelerances(_file(folder, entry.file), entry.excitation, window.decay)
        for dof in (measured.response, *measured.inputs):
            setup.check_node(dof, entry.file)
        if entry.excitation == HAMMER:
            _check_accelerometer(measured.response, setup, entry.file)
        if measured.frequency[-1] > entry.sample_rate / 2 * (1 + ROUNDED):
            raise StoreError(
                f"{entry.file}: frequencies reach {measured.frequency[-1]:g} Hz, more than half the sample rate "
                f"{entry.sample_rate:g} Hz of setup.json"
            )
        warnings += measured.warnings
        warnings += _misplaced(measured.nodes, setup, entry.file)
        if unknown is not None:
            warnings.append(f"{entry.file}: {unknown}")
        sets.append(
            FrequencyResponseSet(
                number=number,
                response=measured.response,
                inputs=measured.inputs,
                frequency=measured.frequency,
                accelerance=measured.accelerance,
                coherence=measured.coherence,
                source=entry.file,
                estimator="not stated",
                **entry.model_dump(exclude={"file"}),
            )
        )
    return tuple(sets), tuple(warnings)


def _misplaced(nodes: Mapping[int, Position], setup: BundleSetup, file: str) -> Iterator[str]:
    """Nodes that the file has at another distance from the first than setup.json, or on its other side."""
    places = {node: place for node, place in enumerate(setup.node_positions, start=1) if node in nodes}
    if not places:
        return
    first = min(places)
    for node, place in places.items():
        drawn, stated = math.dist(nodes[node], nodes[first]), place - places[first]
        if abs(drawn - stated) > _SAME_PLACE:
            yield f"{file}: node {node} is {drawn:.4g} m from node {first} there, {stated:.4g} m in setup.json"
    last = max(places)
    if (places[last] - places[first]) * (nodes[last][0] - nodes[first][0]) < -(_SAME_PLACE**2):
        yield (
            f"{file}: direction x runs from node {last} to node {first} there, and the other way in setup.json; "
            "check the signs of rows along the beam"
        )


def _read_blow(file: Path, setup: BundleSetup) -> BundleBlow:
    blow = read_blow(file)
    setup.check_node(blow.point, file.name)
    _check_accelerometer(blow.response, setup, file.name)
    return blow


def _check_accelerometer(response: StoredDof, setup: BundleSetup, where: str) -> None:
    expected = StoredDof(setup.accelerometer.node, setup.accelerometer.direction)
    if response != expected:
        raise StoreError(f"{where}: the response is at {response}, the accelerometer of setup.json at {expected}")


def _verify_checksums(folder: Path, checksums: dict[str, str]) -> None:
    for name, expected in checksums.items():
        found = hashlib.sha256(_content(folder, name)).hexdigest()
        if found != expected:
            raise StoreError(
                f"{name}: checksum differs from setup.json (SHA-256 {found[:12]}..., not {expected[:12]}...)"
            )


def _not_named(folder: Path, setup: BundleSetup) -> tuple[str, ...]:
    named = {SETUP, *setup.files}
    others = [file.name for file in sorted(folder.iterdir()) if file.is_file() and file.name not in named]
    blows = [file.name for file in sorted(folder.glob(f"{BLOWS}/*")) if file.suffix != _BLOW_SUFFIX]
    return (
        *(f"{name} is not named in setup.json and is ignored" for name in others),
        *(f"{BLOWS}/{name} does not end in {_BLOW_SUFFIX} and is ignored" for name in blows),
    )


def _file(folder: Path, name: str) -> Path:
    file = folder / name
    if not file.is_file():
        raise StoreError(f"{name} is missing from the bundle")
    return file


def _content(folder: Path, name: str) -> bytes:
    if not (folder / name).resolve().is_relative_to(folder.resolve()):
        raise StoreError(f"{SETUP}: checksums: {name!r} is not a file of the bundle")
    try:
        return _file(folder, name).read_bytes()
    except OSError as error:
        raise StoreError(f"{name} cannot be read: {error.strerror or error}") from error


@contextmanager
def _opened(path: Path) -> Iterator[Path]:
    """The bundle's folder; a zip is unpacked while the context lasts."""
    if path.is_dir():
        yield path
        return
    if not path.is_file():
        raise StoreError(f"there is no bundle {path}")
    with TemporaryDirectory() as folder:
        try:
            with zipfile.ZipFile(path) as archive:
                if sum(member.file_size for member in archive.infolist()) > _MOST_BYTES_IN_ZIP:
                    raise StoreError(f"{path.name} unpacks to more than {_MOST_BYTES_IN_ZIP // 1024**3} GB")
                archive.extractall(folder)
        except _ZIP_ERRORS as error:
            raise StoreError(f"{path.name} is neither a folder nor a whole zip file: {error}") from error
        except (OSError, ValueError) as error:
            raise StoreError(f"{path.name} cannot be unpacked: {error}") from error
        inside = [each for each in Path(folder).iterdir() if each.name != _ADDED_BY_MACS]
        # Most programs put the folder itself into the zip.
        yield inside[0] if len(inside) == 1 and inside[0].is_dir() else Path(folder)
