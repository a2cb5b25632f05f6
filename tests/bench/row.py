"""The lines of the benchmark: how much is measured, how times are taken, and their table."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from rich.table import Table


@dataclass(frozen=True)
class Row:
    """Times in seconds; `same` tells whether both sides gave the same answer (None: no peer)."""

    what: str
    ours: float
    peer: float | None = None
    target: float | None = None
    same: bool | None = None
    value: str = ""
    """What is printed where there is no peer."""
    note: str = ""

    @property
    def ratio(self) -> float | None:
        """How many times faster than the peer; None without one."""
        return None if self.peer is None else self.peer / self.ours


def seconds(work: Callable[[], object]) -> float:
    """Of one run."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def median_seconds(work: Callable[[], object], repeats: int) -> float:
    """After one run that does not count."""
    work()
    return float(np.median([seconds(work) for _ in range(repeats)]))


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
    return row.value if row.ratio is None else f"{row.ratio:.0f} x"


def table(rows: Sequence[Row], quick: bool) -> Table:
    """What, our time, the peer's, the ratio, the target, whether the answers agree."""
    title = "FlexGUI benchmark" + (" (quick: short recordings, few repeats)" if quick else "")
    shown = Table(title=title, show_lines=True)
    shown.add_column("comparison", overflow="fold")
    for name in ("ours", "peer", "ratio", "target", "same answer"):
        shown.add_column(name, justify="right")
    shown.add_column("remark", overflow="fold")
    for row in rows:
        target = "" if row.target is None else f">= {row.target:.0f} x"
        peer = duration(row.peer)
        cells = (duration(row.ours), peer, ratio(row), target, _SAME[row.same])
        shown.add_row(row.what, *cells, row.note)
    return shown


@dataclass(frozen=True)
class Size:
    """Lengths in s, numbers of runs."""

    seconds: float
    """Length of the recordings of the linear comparisons."""
    repeats: int
    """Runs of our side, of which the median is taken."""
    peer_repeats: int
    peer_generations: int
    """Generations that the peer's search really runs; the rest is extrapolated."""
    nonlinear_seconds: float
    """Length of the record that the peer integrates; its time is scaled to `record`."""
    record: float
    """Length of the record that our non-linear simulator runs."""
    peak_loops: int
    study_runs: int
    """Monte Carlo runs that are really made; the rest of the paper's 20 is extrapolated."""
    modes: int
    """Of each segment, in the recordings that a rig would hand over."""


FULL = Size(3.0, 200, 5, 2, 0.3, 3.0, 3_000_000, 20, 3)
QUICK = Size(0.1, 20, 1, 1, 0.02, 0.2, 200_000, 1, 2)
