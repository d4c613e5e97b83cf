"""Named tasks on an NI gRPC device server.

When a client dies, the server keeps its task and the reserved modules. So tasks are named after this computer and their
modules: the next process of this computer clears a task that was left over, and no other computer's.
"""

import re
import socket
from collections.abc import Sequence
from contextlib import suppress

import nidaqmx
import nidaqmx.errors
from nidaqmx import GrpcSessionOptions
from nidaqmx.grpc_session_options import SessionInitializationBehavior

from daq.channels import Channel

_open_here: set[str] = set()  # names in use in this process


def open_task(options: GrpcSessionOptions | None, channels: Sequence[Channel]) -> tuple[nidaqmx.Task, str]:
    """A new task for `channels`, and its name for `forget`.

    Over a network, a task that a dead process of this computer has left on the same modules is cleared first.

    Raises:
        nidaqmx.errors.Error: the instrument cannot be reached, or refuses.
    """
    name = _name(channels)
    if options is None or name in _open_here:
        # a second task on the same modules: the instrument decides whether it is possible
        return nidaqmx.Task(grpc_options=options), ""
    try:
        task = nidaqmx.Task(name, grpc_options=_named(options, name, new=True))
    except nidaqmx.errors.Error:
        _clear_left_over(options, name)
        task = nidaqmx.Task(name, grpc_options=_named(options, name, new=True))
    _open_here.add(name)
    return task, name


def forget(name: str) -> None:
    """Note that the task called `name` is no longer used here, cleared or not."""
    _open_here.discard(name)


def _clear_left_over(options: GrpcSessionOptions, name: str) -> None:
    # without such a task the second attempt shows again why the first one failed
    with suppress(nidaqmx.errors.Error):
        nidaqmx.Task(name, grpc_options=_named(options, name, new=False)).close()


def _named(options: GrpcSessionOptions, name: str, *, new: bool) -> GrpcSessionOptions:
    behaviour = SessionInitializationBehavior
    return GrpcSessionOptions(
        options.grpc_channel,
        name,
        initialization_behavior=behaviour.INITIALIZE_SERVER_SESSION if new else behaviour.ATTACH_TO_SERVER_SESSION,
    )


def _name(channels: Sequence[Channel]) -> str:
    modules = sorted({channel.physical.partition("/")[0] for channel in channels})
    return re.sub(r"\W+", "_", f"jointlab {socket.gethostname()} {' '.join(modules)}")
