"""The operator as a line protocol: strike, mount and, when all is measured, reveal the truth.

A real laboratory has a person in this place. Requests and answers are JSON, one a line, over TCP on the loopback
address: ``{"do": "strike", "node": 3, "direction": "y"}`` is answered by ``{"ok": null}`` or ``{"error": "..."}``.
"""

import json
import socket
import socketserver
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

ANSWER_TIMEOUT = 30.0  # s
Command = Callable[..., Any]


class OperatorServer:
    """Serves named actions on a loopback port until it is stopped."""

    def __init__(self, actions: Mapping[str, Command], port: int = 0) -> None:
        self._server = _Server(("127.0.0.1", port), _Connection)
        self._server.actions = dict(actions)
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.05,), name="operator", daemon=True)
        self._thread.start()

    @property
    def address(self) -> str:
        """``host:port`` to connect a `OperatorClient` to."""
        host, port = self._server.server_address[:2]
        return f"{host!s}:{port}"

    def stop(self) -> None:
        """Close the port and end the thread."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


class _Server(socketserver.ThreadingTCPServer):
    allow_reuse_address = True
    daemon_threads = True
    actions: dict[str, Command]


class _Connection(socketserver.StreamRequestHandler):
    server: _Server
    disable_nagle_algorithm = True

    def handle(self) -> None:
        """Answer requests until the client hangs up, or is cut off."""
        with suppress(ConnectionError):
            for line in self.rfile:
                self.wfile.write(json.dumps(_answer(self.server.actions, line)).encode() + b"\n")

    def finish(self) -> None:
        """Let go of the line, also where the client is gone."""
        with suppress(ConnectionError):
            super().finish()


def _answer(actions: Mapping[str, Command], line: bytes) -> dict[str, Any]:
    try:
        request = json.loads(line)
        name = request.pop("do")
        return {"ok": actions[name](**request)}
    except KeyError as error:
        return {"error": f"no such action {error}; there are {', '.join(sorted(actions))}"}
    except (ValueError, TypeError, AttributeError) as error:
        return {"error": str(error)}


class OperatorClient:
    """The other end of the line: what a script calls in place of a person.

    Raises:
        OSError: nobody serves an operator at `address`.
    """

    def __init__(self, address: str) -> None:
        host, _, port = address.rpartition(":")
        self._socket = socket.create_connection((host, int(port)), timeout=ANSWER_TIMEOUT)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._file = self._socket.makefile("rwb")
        self._lock = threading.Lock()

    def do(self, action: str, **arguments: Any) -> Any:
        """Ask for `action` and wait for its answer.

        Raises:
            ValueError: the bench says why it cannot be done.
            ConnectionError: the laboratory has gone.
        """
        with self._lock:
            self._file.write(json.dumps({"do": action, **arguments}).encode() + b"\n")
            self._file.flush()
            line = self._file.readline()
        if not line:
            raise ConnectionError("the simulated laboratory has closed the line")
        answer = json.loads(line)
        if "error" in answer:
            raise ValueError(answer["error"])
        return answer["ok"]

    def close(self) -> None:
        """Hang up."""
        self._file.close()
        self._socket.close()
