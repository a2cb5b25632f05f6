"""Background work: a warm pool of spawned processes, and a fair queue in front of it.

    page -> JobPool.submit -> FairQueue -> WorkerSupervisor (a thread) -> worker (a process)
    page <- callback <- Inbox (a thread) <- Job <- WorkerSupervisor <- pipe <- Reporter

Nothing heavy runs in the process of the page: a supervisor only waits, a callback is called on one
of the crew's threads, never by `submit`, `stop` or whoever holds a lock.
"""

from flexgui.jobs.job import Job, JobState
from flexgui.jobs.messages import (
    Advanced,
    Event,
    Failed,
    Finished,
    NewGeneration,
    Partial,
    Paused,
    Queued,
    Resumed,
    Stage,
    Started,
    Stopped,
    Task,
    WorkerLost,
)
from flexgui.jobs.pool import JobPool
from flexgui.jobs.settings import PoolSettings

__all__ = [
    "Advanced",
    "Event",
    "Failed",
    "Finished",
    "Job",
    "JobPool",
    "JobState",
    "NewGeneration",
    "Partial",
    "Paused",
    "PoolSettings",
    "Queued",
    "Resumed",
    "Stage",
    "Started",
    "Stopped",
    "Task",
    "WorkerLost",
]
