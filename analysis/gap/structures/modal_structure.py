"""Any linear structure from its modes at named degrees of freedom, with lumped parts attached to it.

The structure itself is diagonal in its modes; an attached part adds a dynamic stiffness at one degree of freedom, so
that responses follow from receptances there (R. E. D. Bishop, D. C. Johnson, The Mechanics of Vibration, 1960).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.gap.parameter import Parameter
from analysis.gap.structures.attached_effects import attached_effects
from analysis.gap.structures.chain_effects import chain_effects
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.effect import Acting, Properties, StructureEffect, properties_under, read_by
from analysis.gap.structures.equal_values import equal_values
from analysis.gap.structures.measured_amplitude import Amplitudes, amplitude_range, displacements
from analysis.gap.structures.modes import Attached, NormalModes
from analysis.gap.structures.simulator import Values
from analysis.gap.structures.steady_response import steady_response

FREQUENCIES, POLES = "frequencies", "poles"
"""Observables. Natural frequencies without damping, Hz, real; poles, i times angular frequency less decay rate, rad/s,
complex. The condition `mode` counts modes from 1, including the mode that an absorber adds."""
RESPONSES = {"receptance": 0, "mobility": 1, "accelerance": 2}
"""Observables `accelerance(response,force)` and the like: order of the time derivative of displacement over force."""
OF_A_LINE = frozenset({"modulus", "loss_factor", "damping_ratio", "mass", "stiffness", "damping"})
"""Properties, of the structure and of attached parts, that may differ from line to line at no cost in responses."""
STIFFNESS, LOSS = Parameter("modulus", "1", 1.0, 0.05, positive=True), Parameter("loss_factor", "1", 0.01, 1.0, True)
"""Parameters of the structure: its stiffness over that of the model, and its structural loss factor."""


@dataclass(frozen=True)
class ModalStructure:
    """A linear structure.

    Properties that effects may change: `modulus` (its stiffness, relative), `loss_factor` (beside those of the modes),
    `damping_ratio` (viscous, of every mode), `attached` (a tuple of `Attached`), `support` (displacement of the first
    attached part, m), and `part:NAME` (stiffness of a substructure, relative). Each may differ from value to value.

    Observables: `frequencies` and `poles` with the condition `mode`; `receptance(a,b)`, `mobility(a,b)` and
    `accelerance(a,b)` of response a over force b with the condition `frequency`, and `force` (N, at b) where an
    attached part depends on amplitude. Without a force, and in natural frequencies, it has its stiffness at rest.

    Attributes:
        modes: of the structure alone.
        attached: parts that the model has attached to it, such as supports.
        parameters: `modulus` and `loss_factor`, or one of them.
        local: `gain` (relative to one) of each part.
    """

    modes: NormalModes
    attached: tuple[Attached, ...] = ()
    parameters: tuple[Parameter, ...] = (STIFFNESS, LOSS)
    local: tuple[Parameter, ...] = ()
    name: str = "modal structure"

    def effects(self, curves: Sequence[Curve]) -> tuple[StructureEffect, ...]:
        """Parts attached at every degree of freedom, substructures, the support, and the measuring chain."""
        largest = _largest(self.modes, curves)
        return (*attached_effects(self.modes, self.attached, curves, largest), *chain_effects(curves))

    def predict(self, values: Values, acting: Sequence[Acting], curve: Curve) -> Complex:
        """(n,) readings of a curve.

        Raises:
            AnalysisError: the observable or a place of it does not exist.
        """
        known = {"loss_factor": 0.0, "damping_ratio": 0.0, "modulus": 1.0, "attached": self.attached, "support": 0.0}
        known |= {f"part:{name}": 1.0 for name in self.modes.parts} | dict(values)
        properties = properties_under(acting, known, curve.conditions)
        if curve.observable in (FREQUENCIES, POLES):
            return read_by(acting, self._natural(properties, curve), curve)
        if (asked := _response_of(curve)) is None:
            raise AnalysisError(f"{self.name} has no observable {curve.observable!r}")
        order, response, force = asked
        pole = np.asarray(2j * np.pi * curve.conditions["frequency"], dtype=complex)
        found, size = np.empty(pole.size, dtype=complex), curve.conditions.get("force")
        for each in equal_values(properties, pole.size, OF_A_LINE):
            own = each.places
            receptance = self._receptance(
                each.properties, pole[own], response, force, None if size is None else size[own]
            )
            found[own] = receptance * pole[own] ** order
        return read_by(acting, np.asarray((1 + values.get("gain", 0.0)) * found, dtype=complex), curve)

    def _stiffness(self, properties: Properties) -> Real:
        """(modes, modes) stiffness of the structure with its substructures, for a modulus of one."""
        found = np.diag((2 * np.pi * self.modes.frequencies) ** 2)
        for name, own in self.modes.parts.items():
            found = found + (properties[f"part:{name}"] - 1) * own
        return np.asarray(found)

    def _losses(self) -> Real:
        """(modes, modes) modal loss stiffness by the loss factors of the modes."""
        squares = (2 * np.pi * self.modes.frequencies) ** 2
        return np.diag(squares * (0.0 if self.modes.losses is None else self.modes.losses))

    def _natural(self, properties: Properties, curve: Curve) -> Complex:
        """Natural frequencies or poles; each value may have properties of its own."""
        found, mode = np.empty(curve.values.size, dtype=complex), curve.conditions["mode"].astype(int)
        for each in equal_values(properties, curve.values.size):
            spectrum, asked = self._spectrum(each.properties, damped=curve.observable == POLES), mode[each.places]
            wrong = asked[(asked < 1) | (asked > spectrum.size)]
            if wrong.size:
                raise AnalysisError(f"{self.name} has no mode {wrong[0]}; it has {spectrum.size}")
            found[each.places] = spectrum[asked - 1]
        return found

    def _spectrum(self, properties: Properties, *, damped: bool) -> Complex:
        """All natural frequencies or poles; every absorber has a coordinate in addition to those of the modes."""
        attached = _moved(properties["attached"], properties["support"])
        count = own = self.modes.frequencies.size
        size = count + sum(bool(each.tuned and each.mass) for each in attached)
        mass, damping = np.eye(size), np.zeros((size, size))
        stiffness = np.zeros((size, size), dtype=complex)
        plain, modulus = properties["modulus"] * self._stiffness(properties), properties["modulus"]
        loss, ratio = properties["loss_factor"], properties["damping_ratio"]
        stiffness[:count, :count] = plain * (1 + 1j * loss) + 1j * modulus * self._losses()
        squares, turned = np.linalg.eigh(plain)
        damping[:count, :count] = 2 * ratio * (turned * np.sqrt(np.maximum(squares, 0.0))) @ turned.T
        for each in attached:
            shape = np.concatenate([self.modes.at(each.place), np.zeros(size - count)])
            stiffness += each.stiffness * np.outer(shape, shape)
            damping += each.damping * np.outer(shape, shape)
            if not each.tuned:
                mass += each.mass * np.outer(shape, shape)
            elif each.mass:
                mass[own, own], shape[own], own = each.mass, -1.0, own + 1
                spring = each.mass * (2 * np.pi * each.tuned) ** 2 * (1 + 1j * each.tuned_loss)
                stiffness += spring * np.outer(shape, shape)
        if not damped:
            squares = eigh(stiffness.real, mass, eigvals_only=True)
            return np.asarray(np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi), dtype=complex)
        lower = -np.linalg.solve(mass, np.hstack([stiffness, damping]))
        roots = np.linalg.eigvals(np.vstack([np.hstack([np.zeros((size, size)), np.eye(size)]), lower]))
        return np.asarray(np.sort_complex(-1j * roots)[size:] * 1j)

    def _receptance(
        self, properties: Properties, pole: Complex, response: str, force: str, size: Real | None
    ) -> Complex:
        """(lines,) m/N at `pole` (lines,), under a force of `size` (lines,) in N, where it is known.

        `OF_A_LINE` are numbers or (lines,); all other properties are numbers.
        """
        loss, ratio, modulus = (properties[name] for name in ("loss_factor", "damping_ratio", "modulus"))
        plain, turned = np.linalg.eigh(self._stiffness(properties))
        squares = modulus * plain[:, None]
        lost = modulus * np.einsum("im,ij,jm->m", turned, self._losses(), turned)[:, None]
        roots = np.sqrt(np.maximum(squares, 0.0))
        denominator = squares * (1 + 1j * loss) + pole**2 + 2 * ratio * roots * pole + 1j * lost
        attached = _moved(properties["attached"], properties["support"])
        follows = [] if size is None else [each for each in attached if each.follows_amplitude]
        if len(follows) > 1:
            raise AnalysisError(
                f"{self.name} has {len(follows)} attached things that follow amplitude; one is possible"
            )
        linear = [each for each in attached if size is None or not each.follows_amplitude]
        places = np.array([self.modes.at(each.place) for each in linear]).reshape(len(linear), plain.size) @ turned
        stiff = np.array([each.dynamic_stiffness(pole) for each in linear]).reshape(len(linear), pole.size).T

        def between(out: Real, into: Real) -> Complex:
            """(lines,) receptance of the structure with all linear parts."""
            alone = np.einsum("m,ml->l", out * into, 1 / denominator)
            if not linear:
                return np.asarray(alone)
            own = np.einsum("am,bm,ml->lab", places, places, 1 / denominator)
            to, back = (np.einsum("am,m,ml->la", places, each, 1 / denominator) for each in (into, out))
            inner = np.eye(len(linear)) + stiff[:, :, None] * own
            joined = np.linalg.solve(inner, (stiff * to)[..., None])[..., 0]
            return np.asarray(alone - np.einsum("la,la->l", back, joined))

        out, into = self.modes.at(response) @ turned, self.modes.at(force) @ turned
        if not follows or size is None:
            return between(out, into)
        (thing,), place = follows, self.modes.at(follows[0].place) @ turned
        own, to = between(place, place), between(place, into)
        applied = size * to

        def moving(amplitude: Real | None) -> Complex:
            """(..., lines) m of its place."""
            return np.asarray(applied / (1 + thing.dynamic_stiffness(pole, amplitude) * own))

        amplitude = np.abs(steady_response(moving, np.abs(moving(None))))
        added = thing.dynamic_stiffness(pole, amplitude)
        return np.asarray(between(out, into) - between(out, place) * added * to / (1 + added * own))


def _response_of(curve: Curve) -> tuple[int, str, str] | None:
    """Order of the derivative, place of response and place of force of `accelerance(a,b)` and the like; else None."""
    kind, _, rest = curve.observable.partition("(")
    if kind not in RESPONSES or not rest.endswith(")") or rest.count(",") != 1:
        return None
    response, force = rest[:-1].split(",")
    return RESPONSES[kind], response.strip(), force.strip()


def _largest(modes: NormalModes, curves: Sequence[Curve]) -> float | None:
    """Largest displacement under a known force, over the largest shape at its place, m kg^1/2.

    Zero if none is other than zero; None where no force is known.
    """
    found = list[Amplitudes]()
    for each in curves:
        asked = _response_of(each)
        if asked is not None and {"force", "frequency"} <= set(each.conditions):
            order, response, _ = asked
            if shape := float(np.max(np.abs(modes.at(response)))):
                found.append(displacements(each, order, each.conditions["force"] / shape))
    if not found:
        return None
    return (amplitude_range(found) or (0.0, 0.0))[1]


def _moved(attached: Sequence[Attached], shift: float) -> Sequence[Attached]:
    """The attached parts, the first of them displaced along the line of the structure."""
    if not attached or not shift:
        return attached
    first = attached[0]
    if isinstance(first.place, str):
        raise AnalysisError(f"the support at {first.place} has no coordinate, so it cannot move")
    return (replace(first, place=first.place + shift), *attached[1:])
