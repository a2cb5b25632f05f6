"""How a pool behaves; the defaults suit a teacher's laptop with two cores."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PoolSettings:
    """Limits and times of a pool."""

    queued_per_session: int = 4
    """Jobs of one session that may wait."""
    grace: float = 8.0
    """s that a task may take to end by itself once it was stopped; then its worker is killed."""
    silence: float = 60.0
    """s without a sign of life, of which there is one every two, after which a worker hangs: one
    large function that is compiled has held up a busy machine's interpreter for fifteen."""
    pause_limit: float = 600.0
    """s that a paused job may keep its worker while others wait; then it is stopped."""
    recycle_after: int = 200
    """Jobs, after which a worker is replaced: whatever memory it gathered is given back."""
    calm: float = 6.0
    """s after a worker's or a job's start in which no further worker is started that nobody waits
    for: it would take the cores from the first ranking of whoever clicks at once."""
    start_limit: float = 300.0
    """s that a worker may need to be ready; on a new machine everything is compiled first."""
    niceness: int = 10
    """Of the workers, so that the page answers first (POSIX)."""
    memory: int | None = 3_000_000_000
    """Bytes that a job may take beyond what its warm worker has (Linux); None: all there are. The
    diagnosis of seven recordings takes a tenth of that; two such jobs still fit into a laptop."""
    seconds: float | None = None
    """That a job may take, in all and of a processor; then its worker is replaced. None: no end."""
    warm_up: str | None = "flexgui.jobs.warm:warm_up"
    """What a worker calls before its first job, as "package.module:name"."""


DEFAULT = PoolSettings()
