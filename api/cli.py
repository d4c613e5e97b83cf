"""The command `jointlab`: what it offers, and how it says that something cannot be done."""

from __future__ import annotations

import sys

import typer
from rich.console import Console
from threadpoolctl import threadpool_limits

from api.commands import (
    configuration,
    demo,
    exchange,
    gap,
    identification,
    keys,
    plan,
    reporting,
    sequences,
    service,
    simulate,
    stiffness,
    store,
    worker,
)
from api.errors import EXPECTED, exit_code

INTERRUPTED = 130

app = typer.Typer(
    name="jointlab",
    help="Acquisition, rig control and identification for elastomeric joints.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    add_completion=False,
)
for module in (
    demo,
    simulate,
    sequences,
    plan,
    exchange,
    identification,
    stiffness,
    gap,
    reporting,
    service,
    worker,
    keys,
    store,
    configuration,
):
    module.register(app)


def main() -> None:
    """Run a command; expected errors become one line on standard error and an exit code.

    0 done, 2 wrong usage, 3 bad input, 4 an instrument, 130 interrupted.
    """
    try:
        # two BLAS threads on a busy machine cost more than they give
        with threadpool_limits(limits=1):
            app()
    except EXPECTED as error:
        Console(stderr=True, soft_wrap=True).print(f"jointlab: {error}", style="red", markup=False, highlight=False)
        sys.exit(exit_code(error))
    except SystemExit as ended:
        if ended.code == INTERRUPTED:  # typer's code for Ctrl-C, of which it says nothing
            Console(stderr=True).print("jointlab: interrupted", style="red")
        raise


if __name__ == "__main__":
    main()
