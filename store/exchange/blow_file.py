"""A single blow in one UFF file: force and acceleration on one clock."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from store.dof import StoredDof
from store.errors import StoreError
from store.exchange.accelerance_file import read_in_plane, stated_unit, to_dof, to_uff
from store.exchange.uff import FunctionKind, UffFunction, write_uff
from store.exchange.uff_units import FORCES, UffQuantity
from store.waveforms.waveform import Waveform, WaveformChannel

Real = NDArray[np.float64]

FORCE_UNIT, ACCELERATION_UNIT = "N", "m/s^2"


@dataclass(frozen=True, eq=False)
class BundleBlow:
    """One blow.

    Attributes:
        file: its name in the bundle's folder of blows.
        point: of the hammer; response: of the accelerometer.
        force: (samples,) N; acceleration: (samples,) m/s^2; along positive directions.
        sample_rate: Hz.
        trigger_index: index of the sample at time zero.
    """

    file: str
    point: StoredDof
    response: StoredDof
    force: Real
    acceleration: Real
    sample_rate: float
    trigger_index: int


def read_blow(path: Path) -> BundleBlow:
    """Read a blow.

    Raises StoreError if the file is not readable as UFF, does not hold one force and one acceleration, or
    these differ in length, clock or point.
    """
    functions = read_in_plane(path, (FunctionKind.TIME_RESPONSE,)).functions
    units = [stated_unit(function.unit, function.quantity) for function in functions]
    in_si = [
        (unit.quantity, replace(function, values=unit.factor * function.values))
        for function, unit in zip(functions, units, strict=True)
        if unit is not None
    ]
    forces = [function for quantity, function in in_si if quantity in FORCES]
    accelerations = [function for quantity, function in in_si if quantity == UffQuantity.ACCELERATION]
    if len(functions) != 2 or len(forces) != 1 or len(accelerations) != 1:
        found = ", ".join(function.unit or "no unit" for function in functions)
        raise StoreError(f"{path.name}: expected one force (N, lbf) and one acceleration (m/s^2, g), found: {found}")
    force, acceleration = forces[0], accelerations[0]
    if force.values.size != acceleration.values.size:
        raise StoreError(
            f"{path.name}: {force.values.size} samples of force, {acceleration.values.size} of acceleration"
        )
    if (force.start, force.step) != (acceleration.start, acceleration.step):
        raise StoreError(f"{path.name}: force and acceleration are not on one clock")
    for function in functions:
        if function.abscissa_unit.lower() not in ("", "s", "sec", "seconds"):
            raise StoreError(f"{path.name}: time is in {function.abscissa_unit!r}, expected s")
        if np.iscomplexobj(function.values):
            raise StoreError(f"{path.name}: a time history is complex")
    point = to_dof(force.response, path.name)
    # a reference of zero is none, as time histories need none
    if acceleration.reference.node and to_dof(acceleration.reference, path.name) != point:
        raise StoreError(f"{path.name}: the force is at {point}, the acceleration is for a blow elsewhere")
    return BundleBlow(
        file=path.name,
        point=point,
        response=to_dof(acceleration.response, path.name),
        force=force.response.sign * force.values,
        acceleration=acceleration.response.sign * acceleration.values,
        sample_rate=1 / force.step,
        trigger_index=_trigger_index(path.name, force),
    )


def write_blow(folder: Path, blow: BundleBlow) -> None:
    """Write a blow as UFF58b; StoreError if the file cannot be written."""

    def history(response: StoredDof, values: Real, name: str, unit: str, quantity: UffQuantity) -> UffFunction:
        step = 1 / blow.sample_rate
        return UffFunction(
            kind=FunctionKind.TIME_RESPONSE,
            response=to_uff(response),
            reference=to_uff(blow.point),
            start=-blow.trigger_index * step,
            step=step,
            values=values,
            abscissa_unit="s",
            unit=unit,
            quantity=quantity,
            name=name,
        )

    functions = [
        history(blow.point, blow.force, "force", FORCE_UNIT, UffQuantity.FORCE),
        history(blow.response, blow.acceleration, "acceleration", ACCELERATION_UNIT, UffQuantity.ACCELERATION),
    ]
    write_uff(folder / blow.file, functions)


def to_waveform(blow: BundleBlow) -> Waveform:
    """The blow as a waveform: values of the file, without counts."""
    return Waveform(
        channels=(WaveformChannel("force", FORCE_UNIT), WaveformChannel("acceleration", ACCELERATION_UNIT)),
        samples=np.stack([blow.force, blow.acceleration]),
        sample_rate=blow.sample_rate,
        trigger_index=blow.trigger_index,
    )


def from_waveform(waveform: Waveform, file: str, point: StoredDof, response: StoredDof) -> BundleBlow:
    """The blow of a stored waveform; StoreError if it does not have one channel in N and one in m/s^2."""
    names = {}
    for unit in (FORCE_UNIT, ACCELERATION_UNIT):
        found = [channel.name for channel in waveform.channels if channel.unit == unit]
        if len(found) != 1:
            raise StoreError(f"{file}: the waveform has {len(found)} channels in {unit}, expected one")
        names[unit] = found[0]
    return BundleBlow(
        file=file,
        point=point,
        response=response,
        force=waveform.value(names[FORCE_UNIT]),
        acceleration=waveform.value(names[ACCELERATION_UNIT]),
        sample_rate=waveform.sample_rate,
        trigger_index=waveform.trigger_index or 0,
    )


def _trigger_index(name: str, function: UffFunction) -> int:
    samples = -function.start / function.step
    if samples < 0 or samples >= function.values.size:
        raise StoreError(f"{name}: time runs from {function.start:g} s; expected a record that holds time zero")
    return round(samples)
