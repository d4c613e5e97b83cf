"""Looking at channels through the drive process: by the holder of the lease, and never in the way of anything else."""

import socket
import threading
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from daq.channels import Channel
from daq.errors import ChannelError, DaqError
from jointlab.drive.endpoint import connect
from jointlab.drive.protocol import INPUT_RANGE, LIVE_BLOCK, AskInputRange, LookAtChannel
from jointlab.drive.rig import DrivenRig
from jointlab.errors import ConflictError
from jointlab.settings import Settings, drive_folder
from jointlab.supervision.drive_link import DriveLink
from rig.checks.live import LiveBlock
from rig.instruments import Instruments
from rig.runs.records import RunOrder
from rig.tester.stop_latch import LeaseLostError
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from tests.channels import ACCELEROMETER, DISPLACEMENT, HAMMER, LOAD_CELL
from tests.jointlab.drive.conftest import Heard, Kept, begin
from tests.rig.conftest import CHANNELS
from tests.waiting import LONG, until


def look(link: DriveLink, channel: str, lease: int) -> LiveBlock:
    return LIVE_BLOCK.validate_python(link.ask(LookAtChannel(channel=channel, lease=lease)).value)


def input_range(link: DriveLink, channel: Channel, lease: int) -> tuple[float, float]:
    return INPUT_RANGE.validate_python(link.ask(AskInputRange(channel=channel, lease=lease)).value)


def test_a_block_has_every_channel_of_the_module_and_the_samples_of_one(link: DriveLink) -> None:
    block = look(link, "accelerometer", link.take_lease("test"))
    assert [each.name for each in block.levels] == ["hammer", "accelerometer"]
    assert len(block.samples) == round(0.1 * block.sample_rate)
    level = block.levels[1]
    assert level.lowest == min(block.samples)
    assert level.rms == pytest.approx(0.008, rel=0.5)  # the noise of its data sheet
    assert level.input_high == pytest.approx(5.0 / 10.2e-3, rel=0.2)
    assert level.dc_coupled is False
    assert not level.overloaded
    assert look(link, "force", link.take_lease("test")).levels[0].dc_coupled is True


def test_a_program_that_dies_leaves_no_task_at_the_instrument(
    link: DriveLink, laboratory: Laboratory, drive_settings: Settings
) -> None:
    request = LookAtChannel(channel="hammer", lease=link.take_lease("test"))
    with closing(connect(drive_folder(drive_settings), LONG)) as dying:
        dying.sendall(request.model_dump_json().encode() + b"\n")
        until(lambda: laboratory.daq.tasks != ())
    until(lambda: laboratory.daq.tasks == ())


def test_an_open_cable_is_overloaded(link: DriveLink, laboratory: Laboratory) -> None:
    laboratory.daq.faults.set("cable_open", "cDAQ1Mod1/ai1")
    hammer, accelerometer = look(link, "hammer", link.take_lease("test")).levels
    assert (hammer.overloaded, accelerometer.overloaded) == (False, True)


def test_who_does_not_drive_sees_no_channel_and_an_unknown_one_is_named(link: DriveLink) -> None:
    lease = link.take_lease("test")
    with pytest.raises(LeaseLostError):
        look(link, "hammer", lease - 1)
    with pytest.raises(ChannelError, match="no channel brake"):
        look(link, "brake", lease)


@pytest.mark.parametrize(
    ("channel", "high"),
    [
        (replace(HAMMER, name="soft_hammer", sensitivity=1e-3), 5000.0),
        (replace(DISPLACEMENT, physical="cDAQ1Mod2/ai3"), 5e-3),
        (LOAD_CELL, 62.5e3),
    ],
)
def test_the_range_of_an_input_is_told_for_a_channel_that_is_in_no_table(
    link: DriveLink, channel: Channel, high: float
) -> None:
    assert input_range(link, channel, link.take_lease("test")) == pytest.approx((-high, high))


def test_a_channel_that_the_module_does_not_take_is_refused_in_its_words(link: DriveLink) -> None:
    lease = link.take_lease("test")
    for wrong, said in (
        (replace(ACCELEROMETER, maximum=1000), "AI.Max"),
        (replace(ACCELEROMETER, physical="cDAQ1Mod9/ai0"), "there is no device 'cDAQ1Mod9'"),
        (replace(HAMMER, physical="cDAQ1Mod2/ai0"), "check the channel table against the instrument"),
    ):
        with pytest.raises(ChannelError, match=said):
            input_range(link, wrong, lease)
    with pytest.raises(LeaseLostError):
        input_range(link, HAMMER, lease - 1)


def test_a_program_that_steers_is_told_the_channels_that_are_in_force(link: DriveLink) -> None:
    assert [each.name for each in link.welcome.channels] == ["hammer", "accelerometer", "displacement", "force"]
    assert all(isinstance(each, Channel) and each.sensitivity > 0 for each in link.welcome.channels)


def test_a_run_begins_between_two_blocks_and_nothing_is_looked_at_beside_it(
    link: DriveLink, heard: Heard, order: RunOrder, hand: OperatorClient
) -> None:
    lease, said = link.take_lease("test"), list[str]()

    def look_on() -> None:
        while not said:
            try:
                look(link, "hammer", lease)
            except ConflictError as error:
                if "run 1 is in progress" in str(error):
                    said.append(str(error))

    looking = [threading.Thread(target=look_on) for _ in range(3)]
    for each in looking:
        each.start()
    begin(link, heard, order, lease)
    for each in looking:
        each.join()
    assert heard.now.state.run_id == 1


def test_stop_waits_for_no_acquisition_that_does_not_answer(laboratory: Laboratory, kept: Kept) -> None:
    where, failed = laboratory.addresses, list[DaqError]()
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"grpc://127.0.0.1:{silent.getsockname()[1]}"
        rig = DrivenRig(Instruments(address, where.tester, where.thermometer, CHANNELS), partial(kept.open, Path()))
        lease = rig.take_lease("test")

        def look_in_vain() -> None:
            try:
                rig.look("hammer", lease)
            except DaqError as error:
                failed.append(error)

        looking = threading.Thread(target=look_in_vain)
        looking.start()
        with silent.accept()[0]:
            outcome = rig.halter.wait(rig.halter.press("test", "it was pressed"), LONG)
            assert looking.is_alive()  # it waits for an answer still
        looking.join()
        rig.close()
    assert outcome is not None
    assert outcome.at_rest
    assert failed
