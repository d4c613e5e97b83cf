"""The simulated NI-DAQmx server on a bench that tells the time, and tasks of NI's own client."""

from collections.abc import Iterator

import grpc
import nidaqmx
import pytest
from nidaqmx import GrpcSessionOptions

from simlab.daq_server import DaqServer, start_daq_server
from tests.simlab.daq_client import NewTask, Ramps, add


@pytest.fixture
def bench() -> Ramps:
    return Ramps()


@pytest.fixture
def server(bench: Ramps) -> Iterator[DaqServer]:
    server = start_daq_server(bench)
    yield server
    server.stop()


@pytest.fixture
def line(server: DaqServer) -> Iterator[grpc.Channel]:
    with grpc.insecure_channel(server.address.removeprefix("grpc://")) as channel:
        yield channel


@pytest.fixture
def new_task(line: grpc.Channel) -> Iterator[NewTask]:
    made = []

    def make(*kinds: str) -> nidaqmx.Task:
        task = nidaqmx.Task(grpc_options=GrpcSessionOptions(line, ""))
        made.append(task)
        for kind in kinds:
            add(task, kind)
        return task

    yield make
    for task in made:
        if task._handle is not None:  # NI's mark of a task that is not yet closed
            task.close()
