"""Background work: a warm pool of spawned processes, and a fair queue in front of it.

    page -> JobPool.submit -> FairQueue -> WorkerSupervisor (a thread) -> worker (a process)
    page <- callback <- Inbox (a thread) <- Job <- WorkerSupervisor <- pipe <- Reporter

Nothing heavy runs in the process of the page: a supervisor only waits. A callback runs on a thread
of the thread pool, never inside `submit` or `stop` and never under a lock.
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
