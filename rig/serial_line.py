"""What goes wrong on a serial line."""

import sys

if sys.platform == "win32":  # which has no termios, and raises only the others
    LINE_ERRORS: tuple[type[Exception], ...] = (OSError,)
else:
    import termios

    LINE_ERRORS = (OSError, termios.error)  # the second from each setting and flush of an unplugged port
"""Raised by pyserial where a port was unplugged or cannot be used; `serial.SerialException` is an OSError."""

OPENING_ERRORS: tuple[type[Exception], ...] = (*LINE_ERRORS, ValueError)
"""Raised by pyserial where a port cannot be opened; the last one for a URL or setting that makes no sense."""
