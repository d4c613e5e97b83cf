"""The key Enter at the terminal, asked for without waiting, so that other things are shown meanwhile."""

import os
import select
import sys

if sys.platform == "win32":
    import msvcrt

    def discard_keys() -> None:
        """Forget what was typed before: it answers no later question."""
        while msvcrt.kbhit():
            msvcrt.getwch()

    def is_enter_pressed() -> bool:
        """Whether Enter was pressed since the last call."""
        pressed = False
        while msvcrt.kbhit():
            pressed |= msvcrt.getwch() in "\r\n"
        return pressed
else:
    import termios

    def discard_keys() -> None:
        """Forget what was typed before: it answers no later question."""
        termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)

    def is_enter_pressed() -> bool:
        """Whether Enter was pressed since the last call. Raises EOFError where the terminal was closed."""
        if not select.select([sys.stdin], [], [], 0.0)[0]:
            return False
        # a terminal gives a line when Enter is pressed; not by readline, which would keep further lines to itself
        if not os.read(sys.stdin.fileno(), 4096):
            raise EOFError
        return True
