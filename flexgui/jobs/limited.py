"""How much memory and time a worker's job may take: the limits of the operating system."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path

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
