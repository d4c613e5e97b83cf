"""A progress bar with a line of words under it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.text import Text

from api.commands.console import PlainConsole, visible

if TYPE_CHECKING:
    from rich.console import RenderableType


class WordedProgress(Progress):
    """One bar; nothing where the console is no terminal.

    Attributes:
        words: shown under the bar; empty for none.
    """

    def __init__(self, what: str, total: int, console: PlainConsole) -> None:
        columns = (
            TextColumn("{task.description:<28}"),
            BarColumn(bar_width=32),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
        )
        self.words = ""
        super().__init__(*columns, console=console, disable=not console.is_terminal)
        self._task = self.add_task(what, total=total)

    def get_renderables(self) -> Iterable[RenderableType]:
        """The bar, and the words under it."""
        yield from super().get_renderables()
        if self.words:
            yield Text(visible(self.words))

    def tell(self, done: int, now: str = "") -> None:
        """Move the bar by `done` steps, and show what is done now."""
        changed, self.words = now != self.words, now
        self.advance(self._task, done)
        if changed:
            self.refresh()

    @property
    def seconds(self) -> float:
        """Since the beginning."""
        return self.tasks[0].elapsed or 0.0
