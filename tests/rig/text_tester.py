"""A controller that speaks a protocol of text lines, and the codec for it.

`R 3 512 16` reads 16 holding registers from 512, `W 256 1` writes one, `C 3 1` writes a coil. The answer to a read is
`= 1 2 3`, to a write `ok`, to what is refused `no` or `busy`.
"""

import socket
import threading
from contextlib import suppress

from rig.registers import Kind
from rig.tester.codec import ReadRegisters, RegisterRefusedError, RegisterRequest, WriteCoil, WriteRegisters
from rig.tester.modbus import ModbusLink, ModbusRefusedError


class TextCodec:
    """The codec."""

    def encode(self, request: RegisterRequest) -> bytes:
        match request:
            case ReadRegisters(kind, address, count):
                return f"R {4 if kind is Kind.INPUT else 3} {address} {count}\n".encode()
            case WriteRegisters(address, words):
                return f"W {address} {' '.join(map(str, words))}\n".encode()
            case WriteCoil(address, value):
                return f"C {address} {value:d}\n".encode()

    def decode(self, request: RegisterRequest, received: bytes) -> list[int] | None:
        if not received.endswith(b"\n"):
            return None
        head, *words = received.decode().split()
        if head in ("no", "busy"):
            raise RegisterRefusedError("it says no", busy=head == "busy")
        if head != ("=" if isinstance(request, ReadRegisters) else "ok"):
            raise ValueError(f"{received!r} answers something else")
        return list(map(int, words))


class TextTester:
    """Speaks text on one side and Modbus to a simulated tester on the other, each with a line of its own.

    Attributes:
        url: for a driver with the codec.
        lines: that came.
        answer: in place of its own, where it is not empty.
    """

    def __init__(self, modbus_url: str) -> None:
        self._modbus_url = modbus_url
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"text+tcp://127.0.0.1:{self._listener.getsockname()[1]}"
        self.lines = list[str]()
        self.answer = b""
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self) -> None:
        self._listener.close()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                threading.Thread(target=self._serve, args=(near,), daemon=True).start()

    def _serve(self, near: socket.socket) -> None:
        link = ModbusLink(self._modbus_url, 1.0)
        with suppress(OSError), near, near.makefile("rb") as lines:
            near.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            for line in lines:
                self.lines.append(line.decode().strip())
                answer = self.answer or self._answered(link, line.decode().split())
                for piece in (answer[:3], answer[3:]):
                    near.sendall(piece)
        link.close()

    def _answered(self, link: ModbusLink, words: list[str]) -> bytes:
        what, numbers = words[0], list(map(int, words[1:]))
        try:
            match what:
                case "R":
                    read = link.read_input if numbers[0] == 4 else link.read_holding
                    return f"= {' '.join(map(str, read(*numbers[1:])))}\n".encode()
                case "W":
                    link.write_holding(numbers[0], numbers[1:])
                case _:
                    link.write_coil(numbers[0], bool(numbers[1]))
        except ModbusRefusedError as error:
            return b"busy\n" if error.busy else b"no\n"
        return b"ok\n"
