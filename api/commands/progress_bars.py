"""Progress bars on a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bars

from store.progress import Advance, Progress


def on_terminal(console: Console) -> Progress:
    """Bars on `console`; where it is no terminal, one line when each piece of work is done."""

    @contextmanager
    def show(what: str, total: int) -> Iterator[Advance]:
        columns = (
            TextColumn("{task.description:<28}"),
            BarColumn(bar_width=32),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
        )
        with Bars(*columns, console=console, disable=not console.is_terminal) as bars:
            task = bars.add_task(what, total=total)
            yield lambda done: bars.advance(task, done)
            elapsed = bars.tasks[0].elapsed or 0.0
        if not console.is_terminal:
            console.print(f"{what}: {total} in {elapsed:.1f} s")

    return show
