"""An implausible status stops the machine like a trip, whatever its checksum says."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest

from rig.errors import RigError
from rig.registers import STATUS, State
from rig.tester import driver as tester
from rig.tester.monitor import monitored, poll_tester
from rig.tester.status import ImplausibleStatusError, StatusFault, TesterStatus, status_from
from rig.tester.status_watch import StatusReading, StatusWatch
from simlab.bench import ordinary_bench
from simlab.clock import Clock
from tests.mutated_tester import (
    IMPOSSIBLE,
    AnsweringProxy,
    Lie,
    MutatedDevice,
    Mutation,
    frozen_values,
    mutated_tester,
    says,
    says_rest,
    scaled,
    stale,
)
from tests.rig.tester.test_rest_judge import CYCLING, HELD, set_cycling
from tests.waiting import until


@pytest.fixture
def wrong() -> Iterator[tuple[MutatedDevice, AnsweringProxy]]:
    bench = ordinary_bench(3, Clock(1.0))
    bench.mount("I", "shear")
    with mutated_tester(bench) as both:
        yield both


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_a_value_outside_of_the_map_is_refused_although_its_checksum_is_right(name: str) -> None:
    bench = ordinary_bench(3, Clock(1.0))
    with mutated_tester(bench) as (device, line):
        poll_tester(line.url)
        device.mutate(Mutation(lie=says(**{name: IMPOSSIBLE[name]})))
        with pytest.raises(ImplausibleStatusError, match=name.replace("_", " ")) as refused:
            poll_tester(line.url)
        assert refused.value.fault is StatusFault.RANGE


def test_the_block_that_is_read_names_every_value_that_is_out_of_range() -> None:
    device, _ = sound_device()
    with pytest.raises(ImplausibleStatusError) as refused:
        status_from({**device.status(), **IMPOSSIBLE})
    assert all(name.replace("_", " ") in str(refused.value) for name in IMPOSSIBLE)


def sound_device() -> tuple[MutatedDevice, AnsweringProxy]:
    with mutated_tester(ordinary_bench(3, Clock(1.0))) as (device, line):
        return device, line


def watched(*statuses: tuple[float, TesterStatus], fresh: bool = True) -> StatusFault | None:
    """What the watch finds in statuses at these times, s."""
    watch = StatusWatch()
    try:
        for now, status in statuses:
            watch.check(
                StatusReading(
                    status, ours=True, fresh=fresh, asked={"amplitude": CYCLING.amplitude_pp, "frequency": 50.0}
                ),
                now,
            )
    except ImplausibleStatusError as error:
        return error.fault
    return None


CYCLE = replace(CYCLING, command=CYCLING.command.CYCLE)


def later(status: TesterStatus, cycles: int) -> TesterStatus:
    return replace(status, cycles=status.cycles + cycles)


def measuring(status: TesterStatus, amplitude_pp: float) -> TesterStatus:
    return replace(status, displacement_pp=(amplitude_pp,) * 16)


@pytest.mark.parametrize(
    ("statuses", "fault"),
    [
        ([(0.0, CYCLE), (0.1, measuring(later(CYCLE, 5), 1.01e-4))], None),
        ([(0.0, HELD), (1.0, HELD)], None),
        ([(0.0, CYCLE), (0.2, CYCLE), (0.4, CYCLE)], StatusFault.FROZEN),
        ([(0.0, CYCLE), (0.2, later(CYCLE, 10)), (0.4, later(CYCLE, 500))], None),  # an instrument without noise
        ([(0.0, replace(CYCLE, state=State.HELD))], StatusFault.STATE),
        ([(0.0, replace(CYCLE, amplitude_pp=0.0))], StatusFault.STATE),
        ([(0.0, replace(CYCLE, amplitude_pp=2e-4))], StatusFault.COMMAND),
        ([(0.0, replace(CYCLE, frequency=60.0))], StatusFault.COMMAND),
        ([(t, measuring(later(HELD, int(50 * t)), 1e-4)) for t in (0.0, 0.2, 0.4)], StatusFault.STATE),
        ([(t, measuring(HELD, 1e-4)) for t in (0.0, 0.2, 0.4)], None),  # cycles from before
    ],
)
def test_what_a_sound_instrument_does_not_report_is_found(
    statuses: list[tuple[float, TesterStatus]], fault: StatusFault | None
) -> None:
    assert watched(*statuses) is fault


def test_a_status_without_the_latest_heartbeat_is_an_old_one() -> None:
    assert watched((0.0, HELD), fresh=False) is StatusFault.HEARTBEAT


LIES: dict[str, tuple[Lie, StatusFault]] = {
    "force": (says(force_mean=-50e3), StatusFault.RANGE),
    "interlocks": (says(interlocks=0xFFFF), StatusFault.RANGE),
    "rest": (says_rest, StatusFault.COMMAND),
    "amplitude": (scaled(2.0, "amplitude"), StatusFault.COMMAND),
    "cycles": (frozen_values("cycles"), StatusFault.FROZEN),
    "heartbeat": (frozen_values("heartbeat"), StatusFault.HEARTBEAT),
}


@pytest.mark.parametrize("name", LIES)
def test_a_lie_within_the_checksum_stops_the_machine_like_a_trip(
    wrong: tuple[MutatedDevice, AnsweringProxy], name: str
) -> None:
    device, line = wrong
    lie, fault = LIES[name]
    with pytest.raises(RigError) as refused:
        drive_until_found(line.url, lambda: device.mutate(Mutation(lie=lie)), device)
    assert isinstance(refused.value, ImplausibleStatusError)
    assert refused.value.fault is fault


def test_a_frozen_status_stops_the_machine(wrong: tuple[MutatedDevice, AnsweringProxy]) -> None:
    device, line = wrong
    with pytest.raises(ImplausibleStatusError):
        drive_until_found(line.url, lambda: device.mutate(Mutation(frozen=True)), device)


def test_replayed_replies_stop_the_machine(wrong: tuple[MutatedDevice, AnsweringProxy]) -> None:
    device, line = wrong

    def replay() -> None:
        line.answer = stale()

    with pytest.raises(ImplausibleStatusError):
        drive_until_found(line.url, replay, device)


def drive_until_found(url: str, go_wrong: Callable[[], None], device: MutatedDevice) -> None:
    """Cycle under the monitor's eyes, let it go wrong, and check that the actuator rests within a second of that."""
    with tester.connect(url) as driver, monitored(driver):
        set_cycling(driver)
        go_wrong()
        began = time.monotonic()
        until(device.rests)
        assert time.monotonic() - began < 1.0
        until(lambda: driver.failure is not None)


def test_ranges_are_checked_in_every_value_of_a_list() -> None:
    device, _ = sound_device()
    values = device.status() | {"displacement_pp": (1e-4,) * 15 + (float("nan"),)}
    assert STATUS.out_of_range(values) == ["displacement pp nan, outside 0 to 0.02 m"]


def test_cycles_that_are_alike_are_named_once() -> None:
    beyond = {"displacement_pp": (1.0, 1.0, 2.0, 1.0)}
    assert STATUS.out_of_range(beyond) == [
        "displacement pp 1, outside 0 to 0.02 m",
        "displacement pp 2, outside 0 to 0.02 m",
    ]
