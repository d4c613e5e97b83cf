"""An NI-DAQmx gRPC device server in front of the bench: what NI's own server is to a real chassis.

Clients of NI-DAQmx talk to it over the wire as they would to NI's. A call that fails ends with NI's convention: the
status code in the trailing metadata ``ni-error``.
"""

from collections.abc import Callable
from concurrent import futures
from typing import Any

import grpc
from nidaqmx._stubs import nidaqmx_pb2 as pb

from simlab.daq_errors import DaqFaults, StatusError
from simlab.daq_modules import laboratory_chassis
from simlab.daq_service import NiDaqmx
from simlab.daq_tasks import AcquisitionBench

SERVICE = pb.DESCRIPTOR.services_by_name["NiDAQmx"]
THREADS = 32  # a waiting read and a registered event hold one each


class DaqServer:
    """A server that runs.

    Attributes:
        address: ``grpc://host:port`` for a client to connect to.
        faults: set by tests.
        given: the latest records, counts (channels, samples), for tests that compare.
    """

    def __init__(self, server: grpc.Server, address: str, service: NiDaqmx, faults: DaqFaults) -> None:
        self._server = server
        self._service = service
        self.given = service.given
        self.address = address
        self.faults = faults

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names of the tasks that clients have made and not cleared."""
        return self._service.tasks

    def stop(self) -> None:
        """Drop every client and close the port; returns when that is done."""
        self._server.stop(grace=None).wait()


def start_daq_server(bench: AcquisitionBench, address: str = "127.0.0.1:0") -> DaqServer:
    """Serve the laboratory's chassis in front of `bench` at `address`; port 0 takes a free one.

    Raises:
        OSError: the address is in use or not this computer's.
    """
    faults = DaqFaults()
    service = NiDaqmx(laboratory_chassis(), bench, faults)
    server = grpc.server(
        futures.ThreadPoolExecutor(THREADS, thread_name_prefix="daq"),
        options=[("grpc.max_send_message_length", -1), ("grpc.so_reuseport", 0)],
    )
    handlers = {method.name: _handler(method, service, faults) for method in SERVICE.methods}
    server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(SERVICE.full_name, handlers),))
    try:
        port = server.add_insecure_port(address)
    except RuntimeError as error:
        raise OSError(f"cannot serve at {address}: {error}") from error
    server.start()
    return DaqServer(server, f"grpc://{address.rpartition(':')[0]}:{port}", service, faults)


def _handler(method: Any, service: NiDaqmx, faults: DaqFaults) -> grpc.RpcMethodHandler:
    """The method on the wire: `service`'s, with its faults told as NI tells them, or UNIMPLEMENTED."""
    make = grpc.unary_stream_rpc_method_handler if method.server_streaming else grpc.unary_unary_rpc_method_handler
    response_type = getattr(pb, method.output_type.name)
    call: Callable[[Any, grpc.ServicerContext], Any] | None = getattr(service, method.name, None)

    def serve(request: Any, context: grpc.ServicerContext) -> Any:
        if call is None:
            context.abort(grpc.StatusCode.UNIMPLEMENTED, f"NI-DAQmx method {method.name} is not simulated")
            raise AssertionError("abort raises")
        try:
            faults.check_call(method.name)
            response = call(request, context)
            return response_type() if response is None else response
        except StatusError as error:
            metadata = [("ni-error", str(error.code))]
            if method.name.startswith("Read"):
                metadata.append(("ni-samps-per-chan-read", "0"))
            context.set_trailing_metadata(metadata)
            context.abort(grpc.StatusCode.UNKNOWN, str(error))
            raise AssertionError("abort raises") from error

    return make(
        serve,
        request_deserializer=getattr(pb, method.input_type.name).FromString,
        response_serializer=response_type.SerializeToString,
    )
