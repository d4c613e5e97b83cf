"""The connection to an NI gRPC device server: every call on it ends, even when the server hangs."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import grpc

from daq.errors import InstrumentAbsentError

TIMEOUT_AFTER_FAILURE = 0.1  # s, for the answer of a server that has just failed to answer
OPTIONS = (
    ("grpc.max_receive_message_length", -1),
    ("grpc.max_send_message_length", -1),
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.max_reconnect_backoff_ms", 1000),
    ("grpc.use_local_subchannel_pool", 1),  # a connection of its own, not one that has failed elsewhere
)


@dataclass(frozen=True)
class _CallDetails(grpc.ClientCallDetails):  # type: ignore[misc]  # grpc ships no types
    method: str
    timeout: float | None
    metadata: Any
    credentials: Any
    wait_for_ready: bool | None
    compression: Any


class _Deadline(grpc.UnaryUnaryClientInterceptor):  # type: ignore[misc]  # grpc ships no types
    """Gives each call the time that it asks the server to wait, and `timeout` s for the answer.

    nidaqmx sets no deadline, so without this a server that hangs would hang its clients for ever. After a call without
    an answer the next calls get little time, until one is answered: cleaning up after a failure must not take long.
    """

    def __init__(self, timeout: float) -> None:
        self._timeout = timeout
        self._failed = False

    def intercept_unary_unary(self, continuation: Callable[[Any, Any], Any], details: Any, request: Any) -> Any:
        wait = getattr(request, "timeout", None) or getattr(request, "time_to_wait", None) or 0.0
        deadline = wait + (min(TIMEOUT_AFTER_FAILURE, self._timeout) if self._failed else self._timeout)
        limited = _CallDetails(
            details.method, deadline, details.metadata, details.credentials, details.wait_for_ready, None
        )
        call = continuation(limited, request)
        if call.code() is grpc.StatusCode.OK and call.result() is None:
            raise ValueError("it is empty")  # gRPC gives None for a damaged reply
        self._failed = call.code() in (grpc.StatusCode.DEADLINE_EXCEEDED, grpc.StatusCode.UNAVAILABLE)
        return call


def open_channel(target: str, timeout: float) -> tuple[grpc.Channel, Callable[[], None]]:
    """A channel to the server at `target` ("host:port"), and the function that closes it; `timeout` s for every answer.

    Raises:
        InstrumentAbsentError: no answer within `timeout` s, or `target` is no NI gRPC device server with NI-DAQmx.
    """
    bare = grpc.insecure_channel(target, options=OPTIONS)
    ask = bare.unary_unary("/nidaqmx_grpc.NiDAQmx/GetErrorString")
    try:
        ask(b"", timeout=timeout, wait_for_ready=True)  # an empty request: the meaning of status 0
    except grpc.RpcError as error:
        bare.close()
        if error.code() is grpc.StatusCode.DEADLINE_EXCEEDED:
            reason = f"no NI gRPC device server at {target} after {timeout:g} s; check address and that it runs"
        else:
            reason = f"{target} is no NI gRPC device server with NI-DAQmx ({error.code().name}: {error.details()})"
        raise InstrumentAbsentError(reason) from None
    return grpc.intercept_channel(bare, _Deadline(timeout)), bare.close
