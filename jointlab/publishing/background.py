"""Work in a thread that ends with the program, and whose error is not lost."""

import threading
from collections.abc import Callable
from concurrent.futures import Future


def in_background(work: Callable[[], object]) -> Future[None]:
    """Do work in a thread that ends with the program; the future has the error that ended it."""
    ended = Future[None]()

    def do() -> None:
        try:
            work()
        except BaseException as error:  # noqa: BLE001 - who looks at the future raises it
            ended.set_exception(error)
        else:
            ended.set_result(None)

    threading.Thread(target=do, name=__name__, daemon=True).start()
    return ended
