"""Run a program that ends with the process that started this one: ``python bound_program.py PROGRAM ARGUMENTS``.

Standard input is a pipe that the starter alone holds open and never writes into. The system closes it when the starter
ends, in whatever way, SIGKILL included. Then this process, which is begun as the leader of a group of its own, ends the
group: itself, the program, and what that started. The signal goes to the own group, so it can reach no other process.

It is run as a file and imports nothing of Jointlab, so that it starts within some 50 ms.
"""

import os
import signal
import subprocess
import sys
import threading


def main() -> int:
    """Run the program; returns its exit code, 128 and the signal where one ended it, as shells do."""
    program = subprocess.Popen(sys.argv[1:], stdin=subprocess.DEVNULL)
    threading.Thread(target=_end_with_starter, daemon=True).start()
    code = program.wait()
    return code if code >= 0 else 128 - code


def _end_with_starter() -> None:
    os.read(0, 1)  # not sys.stdin, whose lock a thread that waits would hold when the interpreter ends
    os.killpg(0, signal.SIGKILL)


if __name__ == "__main__":
    sys.exit(main())
