"""Progress on a terminal."""

from __future__ import annotations

from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TaskID, TextColumn, TimeElapsedColumn

from core.results import Generation


class TerminalProgress:
    """One bar per stage, on stderr; a context manager that leaves the terminal tidy."""

    def __init__(self, console: Console | None = None) -> None:
        self._bars = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.fields[text]}", style="dim"),
            TimeElapsedColumn(),
            console=console or Console(stderr=True),
        )
        self._task: TaskID | None = None

    def __enter__(self) -> TerminalProgress:
        self._bars.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is None:
            self._finish()
        self._bars.stop()

    def stage(self, title: str, total: int | None = None) -> None:
        """End the bar of the last stage and start one."""
        self._finish()
        self._task = self._bars.add_task(title, total=total, text="")

    def advance(self, n: int = 1, text: str = "") -> None:
        """Move the bar on."""
        if self._task is not None:
            self._bars.update(self._task, advance=n, text=text)

    def generation(self, fit_label: str, generation: Generation) -> None:
        """Say how far the evolution is."""
        if self._task is not None:
            text = f"{fit_label}, generation {generation.number}, cost {generation.best:.6g}"
            self._bars.update(self._task, text=text)

    def stopped(self) -> bool:
        """Never: Ctrl-C ends the program instead."""
        return False

    def _finish(self) -> None:
        if self._task is not None:
            self._bars.update(self._task, total=1, completed=1, text="")
            self._task = None
