"""One line of the benchmark's table, and how times are taken."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


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
