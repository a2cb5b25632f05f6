"""Background work: a warm pool of spawned processes, and a fair queue in front of it.

    page -> JobPool.submit -> FairQueue -> Slot (a thread) -> worker (a process)
    page <- listener <- Courier (threads) <- Mailbox <- Slot <- pipe <- Reporter in the worker

Nothing heavy runs in the process of the page: a slot only waits, a listener is called on one of
the courier's threads, never by `submit`, `stop` or whoever holds a lock.
"""

from flexgui.jobs.events import (
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
    WorkerLost,
)
from flexgui.jobs.job import Job, State
from flexgui.jobs.pool import JobPool
from flexgui.jobs.settings import PoolSettings
from flexgui.jobs.task import Task

__all__ = [
    "Advanced",
    "Event",
    "Failed",
    "Finished",
    "Job",
    "JobPool",
    "NewGeneration",
    "Partial",
    "Paused",
    "PoolSettings",
    "Queued",
    "Resumed",
    "Stage",
    "Started",
    "State",
    "Stopped",
    "Task",
    "WorkerLost",
]
