"""Background work: a warm pool of spawned processes, and a fair queue in front of it.

    page -> JobPool.submit -> FairQueue -> WorkerSupervisor (a thread) -> worker (a process)
    page <- callback <- Inbox (a thread) <- Job <- WorkerSupervisor <- pipe <- Reporter

Nothing heavy runs in the process of the page: a supervisor only waits, a callback is called on one
of the crew's threads, never by `submit`, `stop` or whoever holds a lock.
"""

from flexgui.jobs.job import Job
from flexgui.jobs.messages import Event, Failed, Finished, Partial, Stopped, Task, WorkerLost
from flexgui.jobs.pool import JobPool

__all__ = [
    "Event",
    "Failed",
    "Finished",
    "Job",
    "JobPool",
    "Partial",
    "Stopped",
    "Task",
    "WorkerLost",
]
