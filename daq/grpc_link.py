"""The line to an NI gRPC device server: every call on it ends, even when the server hangs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import grpc

from daq.errors import InstrumentAbsentError

MARGIN = 10.0  # s, for the server to answer, beyond what the call itself is meant to wait


@dataclass(frozen=True)
class _CallDetails(grpc.ClientCallDetails):  # type: ignore[misc]  # grpc ships no types
    method: str
    timeout: float | None
    metadata: Any
    credentials: Any
    wait_for_ready: bool | None
    compression: Any


class _Deadline(grpc.UnaryUnaryClientInterceptor):  # type: ignore[misc]  # grpc ships no types
    """Gives each call the time that it asks the server to wait, and a margin.

    nidaqmx sets no deadline, so without this a server that hangs would hang its clients for ever.
    """

    def intercept_unary_unary(self, continuation: Callable[[Any, Any], Any], details: Any, request: Any) -> Any:
        wait = getattr(request, "timeout", None) or getattr(request, "time_to_wait", None) or 0.0
        limited = _CallDetails(
            details.method, wait + MARGIN, details.metadata, details.credentials, details.wait_for_ready, None
        )
        return continuation(limited, request)


def open_line(target: str, timeout: float) -> tuple[grpc.Channel, Callable[[], None]]:
    """A channel to the server at `target` ("host:port"), and what closes it.

    Raises:
        InstrumentAbsentError: nobody answers within `timeout` s.
    """
    bare = grpc.insecure_channel(
        target,
        options=[("grpc.max_receive_message_length", -1), ("grpc.max_send_message_length", -1)],
    )
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
    return grpc.intercept_channel(bare, _Deadline()), bare.close
