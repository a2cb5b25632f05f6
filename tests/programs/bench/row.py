"""The lines of the benchmark: how much is measured, how times are taken, and their table."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rich.markup import escape
from rich.table import Table


@dataclass(frozen=True)
class Row:
    """Times in seconds; `same` tells whether both sides gave the same answer (None: no peer)."""

    question: str
    """What both sides are asked for."""
    ours: float
    peer: float | None = None
    target: float | None = None
    same: bool | None = None
    value: str = ""
    """What is printed where there is no peer."""
    note: str = ""
    rival: str = ""
    errors: str = ""
    """Of both sides, ours first: differences to a reference solution."""

    @property
    def what(self) -> str:
        """The question and the rival that it is asked with."""
        return f"{self.question}: {self.rival}" if self.rival else self.question

    @property
    def ratio(self) -> float | None:
        """How many times faster than the peer; None without one."""
        return None if self.peer is None else self.peer / self.ours


def seconds(work: Callable[[], object]) -> float:
    """Of one run."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def least_seconds(work: Callable[[], object], repeats: int) -> float:
    """Of the quickest run, which nothing else on the machine disturbed; one more comes before."""
    work()
    return min(seconds(work) for _ in range(repeats))


_UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"))
_SAME = {None: "", True: "yes", False: "NO"}


def duration(seconds: float | None) -> str:
    """Three digits in the unit that suits."""
    if seconds is None:
        return ""
    size, unit = next((u for u in _UNITS if seconds >= u[0]), _UNITS[-1])
    return f"{seconds / size:.3g} {unit}"


def ratio(row: Row) -> str:
    """How many times faster, or what stands in its place."""
    if row.ratio is None:
        return row.value
    return f"{row.ratio:.0f} x" if row.ratio >= 10.0 else f"{row.ratio:.2g} x"


def least_flattering_first(rows: Sequence[Row]) -> list[Row]:
    """The questions as they come; of each, the rival that we beat by least comes first."""
    questions = list(dict.fromkeys(row.question for row in rows))
    return sorted(rows, key=lambda row: (questions.index(row.question), row.ratio or float("inf")))


def table(rows: Sequence[Row], quick: bool) -> Table:
    """What, our time, the peer's, the ratio, the target, both errors, whether the answers agree."""
    title = "FlexGUI benchmark" + (" (quick: short recordings, few repeats)" if quick else "")
    shown = Table(title=title, show_lines=True)
    shown.add_column("comparison", overflow="fold")
    for name in ("ours", "peer", "ratio", "target", "errors, ours / peer", "same answer"):
        shown.add_column(name, justify="right")
    shown.add_column("remark", overflow="fold")
    for row in least_flattering_first(rows):
        target = "" if row.target is None else f">= {row.target:g} x"
        peer = duration(row.peer)
        cells = (duration(row.ours), peer, ratio(row), target, row.errors, _SAME[row.same])
        shown.add_row(*map(escape, (row.what, *cells, row.note)))
    return shown


@dataclass(frozen=True)
class Size:
    """Lengths in s, numbers of runs."""

    seconds: float
    """Length of the recordings of the linear comparisons."""
    repeats: int
    """Runs of our side, of which the quickest counts."""
    peer_repeats: int
    peer_generations: int
    """Generations that the peer's search really runs; the rest is extrapolated."""
    record: float
    """Length of the records of the non-linear comparisons."""
    modes: int
    """Of each segment, in the recordings that a rig would hand over."""


FULL = Size(3.0, 200, 5, 2, 3.0, 3)
QUICK = Size(0.1, 20, 1, 1, 0.2, 2)
