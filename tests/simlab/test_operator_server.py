import contextlib
import socket
import threading
from collections.abc import Iterator

import pytest

from simlab.operator_server import OperatorClient, OperatorServer


def refuse_node_two(node: int) -> str:
    if node == 2:
        raise ValueError("no hammer reaches node 2")
    return f"struck {node}"


@pytest.fixture
def server() -> Iterator[OperatorServer]:
    served = OperatorServer({"strike": refuse_node_two})
    yield served
    served.stop()


@pytest.fixture
def operator(server: OperatorServer) -> Iterator[OperatorClient]:
    held = OperatorClient(server.address)
    yield held
    held.close()


def test_a_action_is_done_and_answered(operator: OperatorClient) -> None:
    assert operator.do("strike", node=3) == "struck 3"


def test_what_the_bench_refuses_comes_back_in_its_own_words(operator: OperatorClient) -> None:
    with pytest.raises(ValueError, match="no hammer reaches node 2"):
        operator.do("strike", node=2)
    assert operator.do("strike", node=4) == "struck 4"


@pytest.mark.parametrize(("action", "arguments", "words"), [("fly", {}, "strike"), ("strike", {"foot": 1}, "foot")])
def test_an_unknown_action_or_argument_is_named(
    operator: OperatorClient, action: str, arguments: dict[str, int], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        operator.do(action, **arguments)


def test_a_laboratory_that_hangs_up_is_a_connection_error() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        operator = OperatorClient(f"127.0.0.1:{listener.getsockname()[1]}")
        connection, _ = listener.accept()
        with connection.makefile("rb") as requests, contextlib.closing(operator):

            def hang_up() -> None:
                requests.readline()
                connection.shutdown(socket.SHUT_RDWR)

            answered = threading.Thread(target=hang_up)
            answered.start()
            with pytest.raises(ConnectionError, match="closed the line"):
                operator.do("strike", node=3)
            answered.join()
        connection.close()
