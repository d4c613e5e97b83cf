"""Simulators and effects that others wrote: by module and name, by file and name, or as entry points.

A package offers them in its pyproject.toml:

    [project.entry-points."jointlab.gap.simulators"]
    bridge = "our_bridge.model:bridge"
    [project.entry-points."jointlab.gap.effects"]
    loose_bolt = "our_bridge.effects:LooseBolt"
"""

from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from analysis.errors import AnalysisError
from analysis.gap.structures.checks import check_declared, check_simulator
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.effect import StructureEffect
from analysis.gap.structures.search import Failure
from analysis.gap.structures.simulator import Simulator
from jointlab.errors import JointlabError
from jointlab.plug_ins import loaded, object_named, plug_in
from jointlab.structures.uff_modes import structure_of_uff

SIMULATORS, EFFECTS = "jointlab.gap.simulators", "jointlab.gap.effects"
"""Groups of entry points."""
PROTOCOL = "see docs/any_structure.md for the protocol"


def simulator_named(name: str) -> Simulator:
    """A simulator: `package.module:object`, `file.py:object`, the name of an entry point, or a UFF file with modes.

    Raises:
        JointlabError: there is none of that name, or it is no simulator.
        StoreError: the UFF file cannot be read, or holds no modes.
    """
    if name.lower().endswith((".unv", ".uff")):
        return structure_of_uff(Path(name))
    found = plug_in(SIMULATORS, name, "simulator")
    if isinstance(found, type):
        raise JointlabError(f"{name} is a class, not a simulator; name an object that was made of it")
    missing = [each for each in ("name", "parameters", "local", "effects", "predict") if not _has(found, each)]
    if missing:
        raise JointlabError(f"{name} is no simulator: it lacks {', '.join(missing)}; {PROTOCOL}")
    try:
        check_simulator(found)
    except AnalysisError as error:
        raise JointlabError(f"{name} is no simulator: {error}; {PROTOCOL}") from error
    simulator: Simulator = found
    return simulator


def offered_effects() -> tuple[list[StructureEffect], list[Failure]]:
    """Effects of installed packages, and those that cannot be imported or are none."""
    found, failures = list[StructureEffect](), list[Failure]()
    for each in entry_points(group=EFFECTS):
        try:
            found.append(_as_effect(each.name, loaded(each)))
        except JointlabError as error:
            failures.append(Failure(each.name, str(error)))
    return found, failures


def effect_named(name: str) -> StructureEffect:
    """An effect: `package.module:Class` or `file.py:Class`, a class without arguments or an object.

    Raises:
        JointlabError: there is none of that name, or it is no effect.
    """
    return _as_effect(name, object_named(name, "effect", []))


def curves_read(data: Path, reader: str) -> tuple[Curve, ...]:
    """Curves of a file, by a reader `package.module:function` or `file.py:function`.

    Raises:
        JointlabError: there is no such reader, or it fails or gives something else.
    """
    read = object_named(reader, "reader", [])
    try:
        found = tuple(read(data))
    except Exception as error:  # a reader of others may raise anything
        raise JointlabError(f"reader {reader} fails for {data}: {type(error).__name__}: {error}") from error
    if not found or not all(isinstance(each, Curve) for each in found):
        raise JointlabError(f"reader {reader} finds no curves in {data}; it is to give analysis.gap.structures Curves")
    return found


def _has(found: Any, attribute: str) -> bool:
    try:
        return hasattr(found, attribute)
    except Exception:  # noqa: BLE001 - it is there and fails, whatever with; `check_simulator` reports it
        return True


def _as_effect(name: str, found: Any) -> StructureEffect:
    try:
        made = found() if isinstance(found, type) and issubclass(found, StructureEffect) else found
    except Exception as error:  # a class of others may raise anything
        raise JointlabError(f"the effect {name} cannot be made: {type(error).__name__}: {error}") from error
    if not isinstance(made, StructureEffect):
        raise JointlabError(
            f"{name} is no effect: make it a subclass of analysis.gap.structures.effect.StructureEffect"
        )
    try:
        check_declared(made, name)
    except AnalysisError as error:
        raise JointlabError(str(error)) from error
    return made
