"""Detectors that a step sets tighter: in force while it lasts, never looser than the others, restored afterwards."""

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from jointlab.runs.carry_out import run_sequence
from rig.control import RunControl
from rig.errors import RigError
from rig.instruments import Instruments
from rig.registers import DETECTED, Action, CommandCode, Interlock, Refusal, State, Value, float32
from rig.sequences.sequence import SequenceError, sequence_from
from rig.sequences.steps import check_plan, sweep_plan
from rig.sequences.sweep_plan import SweepPlan
from rig.sweep.driven_sweep import SinePoint
from rig.tester.detectors import DetectorError, TighterDetector, check_tighter
from rig.tester.limits import LimitExceededError, TesterLimits
from rig.tester.status import ActuatorNotAtRestError, Detector, TesterTrippedError
from simlab.detectors import Detectors, SimulatedDetector
from simlab.laboratory import Laboratory
from simlab.tester_device import DeviceLimits
from store.catalogue import Catalogue
from store.measurements.runs import list_runs
from tests.rig.person import Person
from tests.rig.sweeping import SweepLaboratory, sweeping

WANTED = {
    Interlock.FORCE: TighterDetector(900.0, Action.HYDRAULIC_INTERLOCK),
    Interlock.UPPER_DISPLACEMENT: TighterDetector(8e-4),
    Interlock.UNDERPEAK: TighterDetector(0.8, Action.HOLD),
}
PLAN = SweepPlan(
    frequencies=(40.0,), amplitudes_pp=(1e-4,), configurations=("shear",), specimens=("I",), detectors=WANTED
)
SPEED = 200.0


class Deaf(SweepLaboratory):
    """Its tester stops for nothing once a point is measured; only its watchdog acts."""

    def add_sine(self, point: SinePoint) -> None:
        super().add_sine(point)
        self.tester.script.set("HOLD", Refusal.FAULT)
        self.tester.faults.set("dead_emergency_stop")


class Looking(SweepLaboratory):
    """Looks at the detectors in force when a point is measured."""

    seen_in_force: dict[str, Value]

    def add_sine(self, point: SinePoint) -> None:
        super().add_sine(point)
        self.seen_in_force = self.tester.device.detectors()


def test_detectors_of_a_step_are_in_force_while_it_lasts_and_put_back_afterwards() -> None:
    with sweeping(PLAN, SPEED) as laboratory:
        before = laboratory.tester.device.detectors()
        looking = Looking(**vars(laboratory))
        looking.sweep(RunControl())
        during = looking.seen_in_force
        assert (during["force_limit"], during["force_action"]) == (900.0, Action.HYDRAULIC_INTERLOCK)
        assert during["upper_displacement_limit"] == float32(8e-4)
        assert during["upper_displacement_action"] == before["upper_displacement_action"]
        assert during["underpeak_action"] == Action.HOLD
        assert during["error_limit"] == before["error_limit"]
        assert {name: float32(float(str(value))) for name, value in laboratory.tester.device.detectors().items()} == {
            name: float32(float(str(value))) for name, value in before.items()
        }
        applied = laboratory.tester.device.applied
    first, last = applied.index(CommandCode.DETECTOR), len(applied) - 1 - applied[::-1].index(CommandCode.DETECTOR)
    moving = applied.index(CommandCode.HYDRAULICS_ON)
    assert first < moving
    assert CommandCode.HYDRAULICS_OFF in applied[moving:last]  # nothing moves while they are loosened


def test_a_tighter_detector_stops_a_motion_within_the_limits_of_the_instrument_and_is_restored() -> None:
    with sweeping(PLAN, SPEED) as laboratory:
        laboratory.tester.faults.set("weak_servo")
        with pytest.raises(TesterTrippedError, match="underpeak"):
            laboratory.sweep(RunControl())
        assert laboratory.tester.device.detectors()["underpeak_action"] == Action.INDICATE
        assert laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF


@pytest.mark.parametrize(
    ("interlock", "looser", "words"),
    [
        (Interlock.FORCE, TighterDetector(4000.0, Action.STOP), "stop is asked for, looser than program_interlock"),
        (Interlock.ERROR, TighterDetector(6e-5), "6e-05 is asked for, looser than 5e-05"),
        (Interlock.UNDERPEAK, TighterDetector(0.4), "0.4 is asked for, looser than 0.5"),
    ],
)
def test_a_detector_that_would_be_looser_than_at_the_instrument_is_refused_before_anything_is_sent(
    interlock: Interlock, looser: TighterDetector, words: str
) -> None:
    with sweeping(replace(PLAN, detectors=WANTED | {interlock: looser}), SPEED) as laboratory:
        with pytest.raises(DetectorError, match=words):
            laboratory.sweep(RunControl())
        assert CommandCode.DETECTOR not in laboratory.tester.device.applied
        assert CommandCode.HYDRAULICS_ON not in laboratory.tester.device.applied


@pytest.mark.parametrize("after", [0, 1, 2])
def test_a_detector_that_the_tester_refuses_ends_the_sweep_before_it_moves_with_the_others_put_back(after: int) -> None:
    with sweeping(PLAN, SPEED) as laboratory:
        before = laboratory.tester.device.detectors()
        laboratory.tester.script.set("DETECTOR", Refusal.DETECTOR_LIMIT, times=1, after=after)
        with pytest.raises(RigError, match="refused detector"):
            laboratory.sweep(RunControl())
        assert laboratory.tester.device.detectors() == pytest.approx(before)
        assert CommandCode.HYDRAULICS_ON not in laboratory.tester.device.applied


def test_detectors_that_cannot_be_put_back_are_said_to_stay_tight() -> None:
    with sweeping(PLAN, SPEED) as laboratory:
        laboratory.tester.script.set("DETECTOR", Refusal.FAULT, after=len(WANTED))
        with pytest.raises(RigError, match=r"stay as tight as the step had them .* set them at the instrument"):
            laboratory.sweep(RunControl())
        assert len(laboratory.points) == 1
        assert laboratory.tester.device.status()["state"] == State.HYDRAULICS_OFF
        assert laboratory.tester.device.detectors()["force_limit"] == 900.0


def test_detectors_stay_tight_where_the_actuator_is_not_confirmed_at_rest() -> None:
    with sweeping(PLAN, SPEED) as laboratory:
        with pytest.raises(ActuatorNotAtRestError) as ended:
            Deaf(**vars(laboratory)).sweep(RunControl())
        assert "stay as tight as the step had them" in " ".join(ended.value.__notes__)
        assert laboratory.tester.device.applied.count(CommandCode.DETECTOR) == len(WANTED)
        assert laboratory.tester.device.detectors()["force_limit"] == 900.0


@given(st.sampled_from(DETECTED), st.floats(-1e-2, 1e4), st.sampled_from([None, *Action]))
def test_rig_and_instrument_accept_the_same_detectors(
    interlock: Interlock, limit: float, action: Action | None
) -> None:
    set_at_instrument = {one: DeviceLimits().detector(one) for one in DETECTED}
    in_force = {one: Detector(float32(each.limit), each.action) for one, each in set_at_instrument.items()}
    wanted = TighterDetector(limit, action)
    try:
        check_tighter({interlock: wanted}, in_force)
    except DetectorError:
        return
    put = wanted.replacing(in_force[interlock])
    detectors = Detectors({one: SimulatedDetector(each.limit, each.action) for one, each in set_at_instrument.items()})
    assert detectors.may_be(interlock, float32(put.limit), put.action)


# -- in a sequence


def with_detectors(document: dict[str, Any], **detectors: Any) -> dict[str, Any]:
    document["steps"] = [document["steps"][1] | {"detectors": detectors}]
    return document


def test_a_sequence_states_them_in_its_own_units(document: dict[str, Any]) -> None:
    said = {"force": {"limit": 900, "action": "hydraulic_interlock"}, "error": {"limit_mm": 0.02}}
    sequence = sequence_from(with_detectors(document, **said))
    ((step, _),) = sequence.sine_steps
    assert sweep_plan(step).detectors == {
        Interlock.FORCE: TighterDetector(900.0, Action.HYDRAULIC_INTERLOCK),
        Interlock.ERROR: TighterDetector(2e-5),
    }
    assert sequence_from(sequence.model_dump(mode="json")) == sequence


@pytest.mark.parametrize(
    ("detectors", "words"),
    [
        ({"force": {"limit": 0.5}}, "detectors.force.limit"),
        ({"force": {"limit_mm": 1}}, "detectors.force.limit"),
        ({"force": {"limit": float("nan")}}, "detectors.force.limit"),
        ({"force": {"limit": 900, "action": "explode"}}, "detectors.force.action"),
        ({"underpeak": {"limit": 80}}, "detectors.underpeak.limit"),
        ({"watchdog": {"limit": 1}}, "detectors.watchdog"),
        ({"upper_displacement": {"limit_mm": 0.55}}, "upper_displacement at 0.55 mm would fire in every cycle"),
        ({"lower_displacement": {"limit_mm": 0.1}}, "lower_displacement at 0.1 mm would fire as the actuator comes"),
    ],
)
@pytest.mark.parametrize("kind", ["sweep", "blank"])
def test_detectors_that_make_no_sense_are_refused_with_their_place(
    document: dict[str, Any], kind: str, detectors: dict[str, Any], words: str
) -> None:
    with_detectors(document, **detectors)
    if kind == "blank":
        document["steps"] = [{"step": "blank", "preset_mm": 0.5, "amplitude_pp_mm": 0.1, "detectors": detectors}]
    with pytest.raises(SequenceError) as refused:
        sequence_from(document)
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("detectors", "words"),
    [
        ({"force": {"limit": 4500}}, "detector force 4500 N is outside the rig's limits of 0 to 4000 N"),
        ({"upper_displacement": {"limit_mm": 1.4}}, "detector upper_displacement 1.4 mm is outside"),
        ({"lower_displacement": {"limit_mm": -0.4}}, "detector lower_displacement -0.4 mm is outside"),
    ],
)
def test_a_detector_beyond_the_rigs_own_limit_is_refused_before_anything_is_connected_to(
    document: dict[str, Any], detectors: dict[str, Any], words: str
) -> None:
    with pytest.raises(LimitExceededError, match=words):
        check_plan(sequence_from(with_detectors(document, **detectors)), TesterLimits())


def test_a_sequence_that_would_loosen_a_detector_is_found_before_a_run_is_stored(
    document: dict[str, Any], instruments: Instruments, catalogue: Catalogue, person: Person
) -> None:
    sequence = sequence_from(with_detectors(document, error={"limit_mm": 0.1}))
    with pytest.raises(DetectorError, match="detector error"):
        run_sequence(sequence, instruments, catalogue, person)
    with catalogue.reading() as session:
        assert list_runs(session) == []


def test_the_detectors_of_a_run_are_stored(
    document: dict[str, Any],
    instruments: Instruments,
    catalogue: Catalogue,
    person: Person,
    whole_laboratory: Laboratory,
) -> None:
    before = whole_laboratory.tester.device.detectors()
    sequence = sequence_from(with_detectors(document, force={"limit": 900}))
    run_sequence(sequence, instruments, catalogue, person)
    assert whole_laboratory.tester.device.detectors() == pytest.approx(before)
    assert CommandCode.DETECTOR in whole_laboratory.tester.device.applied
    with catalogue.reading() as session:
        (run,) = list_runs(session)
    assert sequence_from(run.sequence) == sequence
