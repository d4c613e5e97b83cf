"""Four recordings of structures that are not ours: the effect that their simulation lacks is named, and held-out data
are predicted. The simulations are those of `docs/examples/recordings`; no name of an effect is among what they say.

Records are thinned here, to take seconds; `docs/real_gaps.md` has the figures of all data.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.gap.structures.curve import Curve
from analysis.gap.structures.diagnosis import CurveDiagnosis, diagnose_curves
from jointlab.structures.picture import write_picture
from jointlab.structures.plug_ins import curves_read, simulator_named
from tests.recordings import Recording

EXAMPLES = Path(__file__).resolve().parents[2] / "docs" / "examples" / "recordings"


def diagnosed(
    example: str,
    data: Path,
    hold_out: Sequence[str],
    change: Callable[[Curve], Curve],
    parts: int = 100,
    fitted_to: Sequence[str] = (),
) -> CurveDiagnosis:
    file = EXAMPLES / f"{example}.py"
    curves = [change(each) for each in curves_read(data, f"{file}:read")[:parts]]
    return diagnose_curves(simulator_named(f"{file}:model"), curves, hold_out=hold_out, fitted_to=fitted_to)


def some(step: int) -> Callable[[Curve], Curve]:
    """Every so many values of a curve."""

    def thinned(curve: Curve) -> Curve:
        own = slice(None, None, step)
        conditions = {name: each[own] for name, each in curve.conditions.items()}
        return replace(curve, values=curve.values[own], deviation=curve.deviation[own], conditions=conditions)

    return thinned


def first(count: int) -> Callable[[Curve], Curve]:
    def shortened(curve: Curve) -> Curve:
        conditions = {name: each[:count] for name, each in curve.conditions.items()}
        return replace(curve, values=curve.values[:count], deviation=curve.deviation[:count], conditions=conditions)

    return shortened


def never_shown(found: CurveDiagnosis) -> float:
    """What is left of the gap on parts that no fit has seen, as a share of it."""
    assert found.never_shown is not None
    return found.never_shown[1] / found.never_shown[0]


def mechanisms(found: CurveDiagnosis) -> set[str]:
    return {str(each.mechanism) for each in found.model.effects}


def test_micro_slip_of_a_bolted_joint_is_an_effect_of_amplitude(recording: Recording) -> None:
    data = recording("data/jointed_beam/force_control.csv")
    found = diagnosed("jointed_beam", data, ("3",), some(4), fitted_to=("1",))
    assert mechanisms(found) == {"joint_amplitude"}
    assert "amplitude_dependence" in found.effects
    assert found.after < 0.5 * found.before
    assert never_shown(found) < 0.2


@pytest.mark.parametrize("held", ["1", "3"])
def test_a_decay_tells_the_same_of_the_joint_and_its_loudest_part_is_predicted(recording: Recording, held: str) -> None:
    data = recording("data/jointed_beam/ring_down.npz")
    found = diagnosed("jointed_beam", data, (held,), some(1), fitted_to=("6",))
    assert found.effects == ("amplitude_dependence",)
    assert never_shown(found) < 0.2
    assert found.model.fit.per_datum < 2


def test_a_decay_is_drawn_as_frequency_and_loss_over_amplitude(recording: Recording, tmp_path: Path) -> None:
    file, data = f"{EXAMPLES / 'jointed_beam.py'}", recording("data/jointed_beam/ring_down.npz")
    curves = curves_read(data, f"{file}:read")
    found = diagnose_curves(simulator_named(f"{file}:model"), curves, (), hold_out=("1",))
    write_picture(tmp_path / "decay.svg", found, curves)
    text = (tmp_path / "decay.svg").read_text(encoding="utf-8")
    assert all(each in text for each in ("frequency (Hz)", "loss factor", "amplitude (µm)", "never shown"))


def test_records_of_another_length_are_read_in_pieces_with_a_lead(recording: Recording, tmp_path: Path) -> None:
    data = recording("data/oscillator/multisine.npz")
    read = f"{EXAMPLES / 'oscillator.py'}:read"
    with np.load(data) as file:
        whole = {name: file[name] for name in file}
    for count, parts in ((3000, 1), (20_000, 2), (86_300, 10)):
        short = {name: each[:count] if each.ndim else each for name, each in whole.items()}
        np.savez(tmp_path / "short.npz", **short)
        curves = curves_read(tmp_path / "short.npz", read)
        assert [each.part for each in curves] == [str(n + 1) for n in range(parts)]
        assert sum(int(np.count_nonzero(each.counted)) for each in curves) == count - 305  # the first half second
        rate = float(whole["sample_rate"])
        ends = [each.conditions["time"][-1] * rate for each in curves]
        assert ends == pytest.approx(np.linspace(0, count, parts + 1)[1:] - 1, abs=1)


def test_an_oscillator_has_a_cubic_spring_and_viscous_damping(recording: Recording) -> None:
    data = recording("data/oscillator/multisine.npz")
    found = diagnosed("oscillator", data, ("2", "3", "4"), first(1500), parts=4)
    assert found.effects == ("cubic_stiffness", "viscous_damping")
    assert never_shown(found) < 0.2


def test_a_roller_that_moved_is_a_support_elsewhere(recording: Recording) -> None:
    found = diagnosed("roller_beam", recording("data/roller_beam/three_stations.npz"), ("3",), some(1))
    assert found.effects == ("support_position",)
    assert found.ranking[0].laws == ("moves with a sensor",)
    assert never_shown(found) < 0.2


def test_an_elastomer_follows_frequency_and_temperature(recording: Recording) -> None:
    data = recording("data/elastomer_dma/frequency_sweeps.csv")
    found = diagnosed("elastomer", data, ("5", "12", "18"), some(1))
    assert set(found.effects) == {"frequency_dependence", "temperature_shift"}
    assert never_shown(found) < 0.2


@pytest.mark.parametrize("station", ["1", "2"])
def test_frequencies_of_the_roller_beam_are_those_that_others_found(recording: Recording, station: str) -> None:
    data = recording("data/roller_beam/three_stations.npz")
    curves = {each.part: each for each in curves_read(data, f"{EXAMPLES / 'roller_beam.py'}:read")}
    assert sorted(curves) == ["1", "2", "3"]
    expected = {"1": 25.9, "2": 28.1}[station]
    assert float(np.real(curves[station].values[0])) == pytest.approx(expected, abs=0.15)
