"""The hammer session, on the simulated bench over NI's wire: which blows count, and what happens when they do not."""

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from analysis.dof import Direction, Dof
from analysis.modal.blow_check import BlowFault, BlowVerdict
from daq.block import Block
from daq.channels import Channel
from daq.device import Chassis, connect
from daq.errors import ChannelError, InstrumentAbsentError
from rig.events import (
    BlowAccepted,
    BlowInconsistent,
    BlowMissed,
    BlowRefused,
    Event,
    PointFinished,
    PointStarted,
    RateCoerced,
)
from rig.hammer.session import BlowSink, HammerError, PointGivenUpError, run_hammer_session
from rig.operator import Operator
from rig.sequences.sequence import HammerStep
from simlab.bench import SimulatedBench, ordinary_bench
from simlab.clock import Clock
from simlab.daq_server import DaqServer, start_daq_server
from simlab.ordinary import BenchConditions
from tests.channels import ACCELEROMETER, CHARGE_ACCELEROMETER, CHARGE_HAMMER, HAMMER, HAMMER_CHANNELS

SPEED = 100.0
POINT = Dof(5, Direction.Y)
END = Dof(1, Direction.X)


class Hand(Operator):
    """Strikes the bench when asked; `script` says what the first blows are like, clean ones follow.

    "" strikes not, "at 6y" strikes cleanly at another point.
    """

    def __init__(self, bench: SimulatedBench, *script: str) -> None:
        self.bench = bench
        self.script = list(script)
        self.asked: list[tuple[Dof, int]] = []

    def strike(self, point: Dof, blow: int) -> None:
        self.asked.append((point, blow))
        what = self.script.pop(0) if self.script else "clean"
        if what.startswith("at "):
            point, what = Dof.parse(what.removeprefix("at ")), "clean"
        if what:
            self.bench.strike(point.node, str(point.direction), what=what)

    def mount(self, specimen: str, configuration: str) -> None:
        raise AssertionError("a hammer session mounts nothing")


class Blows(BlowSink):
    """Keeps every blow."""

    def __init__(self) -> None:
        self.taken: list[tuple[Dof, int, Block, BlowVerdict]] = []

    def add_blow(self, point: Dof, number: int, block: Block, verdict: BlowVerdict) -> None:
        self.taken.append((point, number, block, verdict))

    def accepted(self, point: Dof) -> int:
        return sum(verdict.accepted for at, _, _, verdict in self.taken if at == point)


@pytest.fixture
def bench() -> SimulatedBench:
    return ordinary_bench(7, Clock(SPEED), BenchConditions(double_hits=0.0))


@pytest.fixture
def server(bench: SimulatedBench) -> Iterator[DaqServer]:
    server = start_daq_server(bench)
    yield server
    server.stop()


@pytest.fixture
def chassis(server: DaqServer) -> Iterator[Chassis]:
    with connect(server.address) as chassis:
        yield chassis


def step(*points: Dof, **changes: Any) -> HammerStep:
    """A step whose changes are not checked, as one blow a point is too few for a document."""
    named = tuple(map(str, points or (POINT,)))
    return HammerStep(step="hammer", points=named, trigger_level=5.0).model_copy(update=changes)


def test_each_point_gets_ten_accepted_blows_faster_than_the_bench_s_own_time(
    chassis: Chassis, bench: SimulatedBench
) -> None:
    blows, events = Blows(), list[Event]()
    before = time.monotonic()
    run_hammer_session(chassis, HAMMER_CHANNELS, step(POINT, END), Hand(bench), blows, events.append)
    assert time.monotonic() - before < 20  # s, for at least 40 s of blocks
    assert (blows.accepted(POINT), blows.accepted(END)) == (10, 10)
    assert [e for e in events if isinstance(e, PointStarted)] == [PointStarted(POINT, 1, 2), PointStarted(END, 2, 2)]
    assert [e.accepted for e in events if isinstance(e, PointFinished)] == [10, 10]
    counted = [e.accepted for e in events if isinstance(e, BlowAccepted)]
    assert counted == [*range(1, 11), *range(1, 11)]


@pytest.mark.parametrize("channels", [HAMMER_CHANNELS, (CHARGE_HAMMER, CHARGE_ACCELEROMETER)], ids=["IEPE", "charge"])
def test_a_block_holds_two_seconds_of_hammer_and_accelerometer_around_the_trigger(
    chassis: Chassis, bench: SimulatedBench, channels: tuple[Channel, ...]
) -> None:
    blows = Blows()
    run_hammer_session(chassis, channels, step(blows=1), Hand(bench), blows)
    ((point, number, block, verdict),) = blows.taken
    assert (point, number) == (POINT, 1)
    assert (block.duration, block.trigger_index) == (2.0, 256)
    assert block.names == ("hammer", "accelerometer")
    force = block.value("hammer")
    assert verdict.peak_force == pytest.approx(np.max(force), abs=0.1)
    assert force[255] < 5.0 <= force[256] + 1e-3  # half a count
    assert np.std(block.value("accelerometer")[:200]) < 0.1 < np.std(block.value("accelerometer")[256:])


@pytest.mark.parametrize(
    ("what", "fault", "reason"),
    [
        ("double", BlowFault.DOUBLE_HIT, "double hit: a second contact of"),
        ("weak", BlowFault.WEAK, " N"),
        ("overload", BlowFault.OVERLOAD, "overload"),
        ("late", BlowFault.LATE_TRIGGER, " ms"),
        ("soft", BlowFault.SOFT, " Hz"),
    ],
)
def test_a_bad_blow_is_refused_with_its_reason_and_repeated(
    chassis: Chassis, bench: SimulatedBench, what: str, fault: BlowFault, reason: str
) -> None:
    blows, events, hand = Blows(), list[Event](), Hand(bench, "clean", what, "clean")
    run_hammer_session(chassis, HAMMER_CHANNELS, step(blows=2), hand, blows, events.append)
    assert [verdict.accepted for *_, verdict in blows.taken] == [True, False, True]
    assert fault in blows.taken[1][3].faults
    (refused,) = (e for e in events if isinstance(e, BlowRefused))
    assert refused.blow == 2
    assert reason in refused.reason
    assert refused.faults == blows.taken[1][3].faults
    assert hand.asked == [(POINT, 1), (POINT, 2), (POINT, 3)]
    assert events[-1] == PointFinished(POINT, accepted=2, refused=1)


def test_a_blow_at_another_point_is_refused_once_three_are_there(chassis: Chassis, bench: SimulatedBench) -> None:
    blows, events, hand = Blows(), list[Event](), Hand(bench, "clean", "clean", "at 6y")
    run_hammer_session(chassis, HAMMER_CHANNELS, step(blows=3), hand, blows, events.append)
    assert [verdict.accepted for *_, verdict in blows.taken] == [True, True, False, True]
    assert blows.taken[2][3].faults == (BlowFault.INCONSISTENT,)
    (refused,) = (e for e in events if isinstance(e, BlowRefused))
    assert refused.blow == 3
    assert "was another point struck?" in refused.reason
    assert events[-1] == PointFinished(POINT, accepted=3, refused=1)


def test_an_earlier_blow_at_another_point_is_reported_and_replaced(chassis: Chassis, bench: SimulatedBench) -> None:
    blows, events, hand = Blows(), list[Event](), Hand(bench, "at 6y")
    run_hammer_session(chassis, HAMMER_CHANNELS, step(blows=3), hand, blows, events.append)
    (inconsistent,) = (e for e in events if isinstance(e, BlowInconsistent))
    assert (inconsistent.point, inconsistent.blow) == (POINT, 1)
    assert "was another point struck?" in inconsistent.reason
    assert [verdict.accepted for *_, verdict in blows.taken] == [True] * 4
    assert events[-1] == PointFinished(POINT, accepted=3, refused=0)


def test_a_point_is_given_up_where_later_blows_do_not_fit_the_first_two(
    chassis: Chassis, bench: SimulatedBench
) -> None:
    hand = Hand(bench, "clean", "clean", "at 6y")
    with pytest.raises(
        PointGivenUpError, match=r"the last: inconsistent with the others at its point: .* was another point struck\?"
    ):
        run_hammer_session(chassis, HAMMER_CHANNELS, step(blows=3), hand, Blows(), refusals_in_a_row=1)


def test_an_overload_of_the_instrument_refuses_the_blow(
    chassis: Chassis, bench: SimulatedBench, server: DaqServer
) -> None:
    server.faults.set("cable_open", "cDAQ1Mod1/ai1")
    blows = Blows()
    with pytest.raises(PointGivenUpError, match="overload"):
        run_hammer_session(chassis, HAMMER_CHANNELS, step(), Hand(bench), blows, refusals_in_a_row=1)
    assert BlowFault.OVERLOAD in blows.taken[0][3].faults


def test_a_point_is_given_up_after_too_many_refusals_in_a_row(chassis: Chassis, bench: SimulatedBench) -> None:
    blows, hand = Blows(), Hand(bench, "weak", "clean", "weak", "double", "weak")
    with pytest.raises(
        PointGivenUpError, match=r"point 5y: given up after 3 blows in a row.*with 1 of 10 accepted; the last: "
    ):
        run_hammer_session(chassis, HAMMER_CHANNELS, step(), hand, blows, refusals_in_a_row=3)
    assert [verdict.accepted for *_, verdict in blows.taken] == [False, True, False, False, False]


def test_a_missing_blow_is_reported_and_asked_for_again(chassis: Chassis, bench: SimulatedBench) -> None:
    blows, events, hand = Blows(), list[Event](), Hand(bench, "", "clean")
    run_hammer_session(
        chassis, HAMMER_CHANNELS, step(blows=1, block_seconds=0.2), hand, blows, events.append, blow_timeout=0.5
    )
    assert BlowMissed(POINT, 1, 0.5) in events
    assert [number for _, number, _, _ in blows.taken] == [2]


def test_a_point_without_blows_is_given_up(chassis: Chassis, bench: SimulatedBench) -> None:
    with pytest.raises(PointGivenUpError, match=r"the last: nobody struck within 0\.05 s"):
        run_hammer_session(
            chassis,
            HAMMER_CHANNELS,
            step(block_seconds=0.2),
            Hand(bench, "", ""),
            Blows(),
            blow_timeout=0.05,
            refusals_in_a_row=2,
        )


def test_a_coerced_rate_is_reported_and_the_block_keeps_its_duration(chassis: Chassis, bench: SimulatedBench) -> None:
    blows, events = Blows(), list[Event]()
    run_hammer_session(chassis, HAMMER_CHANNELS, step(blows=1, sample_rate=4096.0), Hand(bench), blows, events.append)
    assert events[0] == RateCoerced(4096.0, 51200 / 12)
    assert blows.taken[0][2].duration == pytest.approx(2.0, abs=1e-3)


@pytest.mark.parametrize(
    ("table", "reason"),
    [
        ((ACCELEROMETER,), r"no channel 'hammer' among accelerometer \(acceleration_iepe\)"),
        ((HAMMER,), r"no accelerometer among hammer \(force_iepe\)"),
    ],
)
def test_a_table_without_hammer_or_accelerometer_is_refused(
    chassis: Chassis, bench: SimulatedBench, table: tuple[Channel, ...], reason: str
) -> None:
    hand = Hand(bench)
    with pytest.raises(HammerError, match=reason):
        run_hammer_session(chassis, table, step(), hand, Blows())
    assert hand.asked == []


def test_a_wrong_channel_is_found_before_the_first_blow(chassis: Chassis, bench: SimulatedBench) -> None:
    hand = Hand(bench)
    with pytest.raises(ChannelError, match="'hammer' is on cDAQ1Mod1/ai9"):
        run_hammer_session(chassis, (replace(HAMMER, physical="cDAQ1Mod1/ai9"), ACCELEROMETER), step(), hand, Blows())
    assert hand.asked == []


def test_an_instrument_that_disappears_ends_the_session_and_keeps_the_blows(
    chassis: Chassis, bench: SimulatedBench, server: DaqServer
) -> None:
    blows = Blows()

    class Unplugger(Hand):
        def strike(self, point: Dof, blow: int) -> None:
            if blow == 3:
                server.faults.set("device_gone")
            super().strike(point, blow)

    with pytest.raises(InstrumentAbsentError, match="check power and cable"):
        run_hammer_session(chassis, HAMMER_CHANNELS, step(), Unplugger(bench), blows)
    assert blows.accepted(POINT) == 2


def test_a_repeated_point_is_not_compared_with_its_withdrawn_blows(chassis: Chassis, bench: SimulatedBench) -> None:
    class Repeated(Blows):
        """Three blows went to another point, all alike; then they are withdrawn."""

        def withdrawn(self, point: Dof) -> int:
            return 3 if len(self.taken) >= 3 else 0

    hand, blows, events = Hand(bench, "at 9y", "at 9y", "at 9y"), Repeated(), list[Event]()
    run_hammer_session(chassis, HAMMER_CHANNELS, step(POINT, blows=4), hand, blows, events.append)
    assert [verdict.accepted for *_, verdict in blows.taken] == [True] * 7
    assert [event.accepted for event in events if isinstance(event, BlowAccepted)] == [1, 2, 3, 1, 2, 3, 4]


def test_a_withdrawn_blow_is_replaced_although_its_point_was_left(chassis: Chassis, bench: SimulatedBench) -> None:
    class Withdrawn(Blows):
        """The first point's blow is withdrawn when the second point has been struck."""

        def withdrawn(self, point: Dof) -> int:
            return int(point == POINT and self.accepted(END) > 0)

    hand, blows, events = Hand(bench), Withdrawn(), list[Event]()
    run_hammer_session(chassis, HAMMER_CHANNELS, step(POINT, END, blows=1), hand, blows, events.append)
    assert hand.asked == [(POINT, 1), (END, 1), (POINT, 2)]
    assert [event.point for event in events if isinstance(event, PointStarted)] == [POINT, END, POINT]
