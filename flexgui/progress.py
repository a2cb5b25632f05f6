"""Progress for whoever watches stderr: bars on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TaskID, TextColumn, TimeElapsedColumn

from flexgui.core.progress import Progress as Listener
from flexgui.core.progress import Silent, counted_simulations
from flexgui.core.results import Generation

EVERY = 10.0
"""s between plain lines: what ends sooner needs none, and an hour fills no log."""


@contextmanager
def shown_progress(quiet: bool = False) -> Iterator[Listener]:
    """What a long computation reports, on stderr; `quiet`: nothing."""
    if quiet:
        yield Silent()
    elif sys.stderr.isatty():
        with TerminalProgress() as bars, counted_simulations(bars):
            yield bars
    else:
        with PlainProgress() as lines, counted_simulations(lines):
            yield lines


class PlainProgress(Silent):
    """A line from time to time that says what is done, for logs and notebooks."""

    def __init__(self, every: float = EVERY) -> None:
        self._every, self._ended = every, threading.Event()
        self._begun, self._title, self._done = time.monotonic(), "Preparing", 0
        self._total: int | None = None
        self._simulated = 0

    def __enter__(self) -> PlainProgress:
        threading.Thread(target=self._print_lines, daemon=True).start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ended.set()

    def stage(self, title: str, total: int | None = None) -> None:
        """From now on this is being done."""
        self._title, self._total, self._done, self._simulated = title, total, 0, 0

    def advance(self, n: int = 1, text: str = "") -> None:
        """So many steps more."""
        self._done += n

    def simulated(self, n: int) -> None:
        """So many simulations more."""
        self._simulated += n

    def _print_lines(self) -> None:
        while not self._ended.wait(self._every):
            count = f", {self._done} of {self._total}" if self._total else ""
            count += f", {self._simulated:,} simulations" if self._simulated else ""
            seconds = time.monotonic() - self._begun
            print(f"flexgui: {self._title}{count} ({seconds:.0f} s)", file=sys.stderr, flush=True)


class TerminalProgress(Silent):
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
        self._text, self._simulated = "", 0

    def __enter__(self) -> TerminalProgress:
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
        self._bars.start()  # not before: what has no stage leaves no empty line
        self._task = self._bars.add_task(title, total=total, text="")
        self._text, self._simulated = "", 0

    def advance(self, n: int = 1, text: str = "") -> None:
        """Move the bar on."""
        self._text = text
        if self._task is not None:
            self._bars.update(self._task, advance=n, text=text)

    def simulated(self, n: int) -> None:
        """Say how many simulations the stage has taken."""
        self._simulated += n
        if self._task is not None:
            parts = filter(None, (self._text, f"{self._simulated:,} simulations"))
            self._bars.update(self._task, text=", ".join(parts))

    def generation(self, fit_label: str, generation: Generation) -> None:
        """Say how far the evolution is."""
        if self._task is not None:
            text = f"{fit_label}, generation {generation.number}, cost {generation.best:.6g}"
            self._bars.update(self._task, text=text)

    def _finish(self) -> None:
        if self._task is not None:
            self._bars.update(self._task, total=1, completed=1, text="")
            self._task = None
