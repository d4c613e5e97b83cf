"""Questions that a diagnosis cannot answer because something was not measured."""

from collections.abc import Iterator, Sequence

import numpy as np

from analysis.gap.catalogue import effect_ids, laws
from analysis.gap.effect import acts_on_rig
from analysis.gap.measurement import Configuration, HammerSet, Measurement, Rig, TesterPoints

BY_AMPLITUDE = "amplitude_dependence, cubic_stiffness and coulomb_friction"


def missing_evidence(measurement: Measurement) -> tuple[str, ...]:
    """One sentence for each gap in the evidence.

    There is none where both rigs were measured at several points, hammer levels and amplitudes, in all configurations,
    with coherence and temperatures.
    """
    return tuple(_sentences(measurement.sets, measurement.points))


def _sentences(sets: Sequence[HammerSet], points: TesterPoints | None) -> Iterator[str]:
    if points is None or not sets:
        missing, name, other = (Rig.TESTER, "tester", "beam") if points is None else (Rig.BEAM, "beam", "tester")
        own = ", ".join(each for each in effect_ids() if each in _of_one_rig(missing))
        yield (
            f"no {name}: it is not known whether an effect shows in both rigs, which is the strongest evidence for "
            f"or against the rubber, and the {other} stands alone; these effects cannot be found: {own}"
        )
    if len({dof for each in sets for dof in each.inputs}) == 1:
        yield (
            f"one row, {sets[0].inputs[0]}: where along the beam an effect sits, and the gap on rows that no fit saw, "
            "is not known"
        )
    bare = [str(number) for number, each in enumerate(sets, start=1) if each.coherence is None]
    if bare:
        yield (
            f"no coherence in hammer set {', '.join(bare)}: noise is judged by how neighbouring lines differ, and "
            "hum in averages cannot be seen"
        )
    if len({each.peak_force for each in sets}) == 1:
        yield f"one hammer level, {sets[0].peak_force:.3g} N: the beam does not show what depends on amplitude"
    temperatures = [each.temperature for each in sets]
    if points is not None:
        temperatures += points.temperature.tolist()
        amplitudes = np.unique(np.round(2e3 * points.amplitude, 6))
        if amplitudes.size == 1:
            size = f"{amplitudes[0]:g} mm"
            yield f"one amplitude in the tester, {size}: {BY_AMPLITUDE} cannot be distinguished there"
        absent = [each.name.lower() for each in Configuration if not np.any(points.configuration == each)]
        if absent:
            ways = " or ".join(absent)
            yield f"no points of the tester in {ways}: only the other configurations tell of its cylinders"
    if not np.all(np.isfinite(temperatures)):
        yield "no temperatures: temperature_shift and preload_stiffening cannot be distinguished by a thermometer"


def _of_one_rig(rig: Rig) -> frozenset[str]:
    """Ids of effects that show in this rig alone."""
    (other,) = set(Rig) - {rig}
    return frozenset(law.id for law in laws() if acts_on_rig(law, rig) and not acts_on_rig(law, other))
