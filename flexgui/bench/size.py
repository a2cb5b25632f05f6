"""How much is measured: enough for firm numbers, or a short run for the test suite."""

from __future__ import annotations

from dataclasses import dataclass


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
QUICK = Size(0.1, 20, 1, 1, 0.04, 0.4, 200_000, 1, 2)
