"""How a pool behaves, and how much memory and time a job of its workers may take."""

from __future__ import annotations

import contextlib
import re
from dataclasses import dataclass
from pathlib import Path


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
    warm_up: str | None = "flexgui.jobs.worker:warm_up"
    """What a worker calls before its first job, as "package.module:name"."""


DEFAULT = PoolSettings()


TOO_LARGE = (
    "needs more memory than is allowed; cut the recordings, keep fewer columns or simulate fewer "
    "samples."
)
TOO_LONG = (
    "took longer than {:.0f} s; cut the recordings, keep fewer columns or simulate fewer samples."
)
"""How a sentence about the work goes on."""

SPARE = 5.0
"""s of a processor beyond the limit: the server, which can say why, ends the job first."""


def limit_memory(more: int | None) -> None:
    """This process gets `more` bytes than it has now, then MemoryError; Linux only.

    Data, not address space: compilers and allocators reserve much more than they ever touch.
    """
    used = _data_bytes()
    if more is None or used is None:
        return
    import resource

    with contextlib.suppress(ValueError, OSError):  # a lower limit stands already
        resource.setrlimit(resource.RLIMIT_DATA, (used + more, resource.RLIM_INFINITY))


def limit_time(seconds: float | None) -> None:
    """This process dies after so many more seconds of a processor, where the system can do it."""
    if seconds is None:
        return
    try:
        import resource
    except ImportError:
        return
    usage = resource.getrusage(resource.RUSAGE_SELF)
    until = int(usage.ru_utime + usage.ru_stime + seconds + SPARE)
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CPU, (until, resource.RLIM_INFINITY))


def _data_bytes() -> int | None:
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
    except OSError:
        return None
    found = re.search(r"VmData:\s+(\d+) kB", status)
    return None if found is None else int(found[1]) * 1024
