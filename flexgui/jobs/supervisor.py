"""One place where a job can run: a light thread that looks after one worker process."""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING

from flexgui.jobs.job import PAUSED, Job
from flexgui.jobs.messages import (
    Answer,
    Begin,
    Crashed,
    Ended,
    Event,
    Failed,
    Finished,
    Order,
    Ready,
    Refused,
    Stopped,
    WorkerLost,
)
from flexgui.jobs.process import WorkerGoneError, WorkerProcess
from flexgui.jobs.settings import TOO_LONG

if TYPE_CHECKING:
    from flexgui.jobs.pool import JobPool

TICK = 0.05
"""s between two looks at what the user wishes of a running job."""

IDLE = 1.0
"""s between two looks at whether an idle worker is still there."""

EXIT_PATIENCE = 1.5
"""s that a worker has to leave by itself."""

HOPELESS = 3
"""Failed starts in a row after which waiting jobs are told instead of left waiting."""

LONGEST_PAUSE = 30.0
"""s between two attempts to start a worker that does not start."""

log = logging.getLogger(__name__)


class WorkerSupervisor:
    """Runs job after job; whatever happens to the worker, this goes on."""

    def __init__(self, pool: JobPool, number: int) -> None:
        self._pool, self._settings = pool, pool.settings
        self._worker: WorkerProcess | None = None
        self._jobs = 0
        self._failures = 0
        self._working = False
        self.thread = threading.Thread(
            target=self._run, name=f"jobs-supervisor-{number}", daemon=True
        )

    @property
    def pid(self) -> int | None:
        """Of a worker that is ready."""
        worker = self._worker
        return None if worker is None else worker.pid

    @property
    def free(self) -> bool:
        """Whether its worker is ready and would begin a job at once: one that was stopped may keep
        its worker for a while, and then it is replaced."""
        return self._worker is not None and not self._working

    def _run(self) -> None:
        while not self._pool.closing.is_set():
            try:
                if self._has_worker():
                    job = self._pool.next_job(IDLE)
                    if job is not None:
                        self._look_after(job)
                        self._working = False
            except Exception:
                log.exception("A worker's supervisor met an error and goes on")
                self._dismiss(0.0)
                self._working = False
                self._pool.closing.wait(IDLE)
        self._dismiss(EXIT_PATIENCE)

    def _has_worker(self) -> bool:
        """Whether a warm worker is there, after starting one where it was not."""
        if self._worker is not None and not self._idles(self._worker):
            log.warning("Idle worker %s is gone; another takes its place", self._worker.pid)
            self._dismiss(0.0)
        if self._jobs >= self._settings.recycle_after:
            self._dismiss(EXIT_PATIENCE)
        if self._worker is None:
            # One after the other: on a new machine the first compiles what the next only load.
            with self._pool.warming:
                self._worker = self._started() if self._pool.wants_worker else None
        if self._worker is None:
            pause = min(2.0**self._failures / 2.0, LONGEST_PAUSE) if self._failures else TICK
            self._pool.closing.wait(pause)
        return self._worker is not None

    def _idles(self, worker: WorkerProcess) -> bool:
        """Whether it is there and shows signs of life; they are read, or the pipe would be full."""
        try:
            worker.receive(0.0)
        except WorkerGoneError:
            return False
        return worker.alive and not worker.hangs

    def _started(self) -> WorkerProcess | None:
        if self._pool.closing.is_set():
            return None
        try:
            worker = WorkerProcess(self._settings)
        except OSError as error:
            self._start_failed(str(error))
            return None
        reason = self._not_ready(worker)
        if reason is None:
            self._failures = 0
            self._pool.stir()
            return worker
        worker.end(0.0)
        if not self._pool.closing.is_set():
            self._start_failed(reason)
        return None

    def _not_ready(self, worker: WorkerProcess) -> str | None:
        """Waits until the worker is warm; otherwise why it is not."""
        until = time.monotonic() + self._settings.start_limit
        try:
            while time.monotonic() < until and not self._pool.closing.is_set():
                message = worker.receive(TICK)
                if isinstance(message, Ready):
                    if message.trouble:
                        log.error("A worker failed to warm up\n%s", message.trouble)
                    return None
        except WorkerGoneError:
            return worker.ending
        return "not ready in time"

    def _start_failed(self, reason: str) -> None:
        self._failures += 1
        log.error("A worker process could not be started (%s)", reason)
        if self._failures >= HOPELESS:
            self._pool.give_up_waiting(
                "No worker process can be started; details are in the log of the server."
            )

    def _dismiss(self, patience: float) -> None:
        worker, self._worker, self._jobs = self._worker, None, 0
        if worker is not None:
            worker.end(patience)

    def _look_after(self, job: Job) -> None:
        assert self._worker is not None
        self._working = True
        self._jobs += 1
        ending: Ended = _failed(job, "an error in its supervisor")
        try:
            ending = self._ending(job, self._worker)
        except WorkerGoneError:
            log.warning("Worker %s is gone in the middle of a job", self._worker.pid)
            ending = (_hung if self._worker.hangs else _lost)(job, self._worker)
            self._dismiss(0.0)
        except Exception as error:  # a task or a result that no pipe can carry
            log.exception("%s could not be sent or received", job.task.title)
            ending = _failed(job, " ".join(f"{type(error).__name__}: {error}".split()))
            self._dismiss(0.0)
        finally:
            self._pool.job_over(job, ending)

    def _ending(self, job: Job, worker: WorkerProcess) -> Ended:
        """Relays both ways until there is an answer, or none is to be expected."""
        worker.send(Begin(job.task))
        wishes, begun = _Wishes(job, worker), time.monotonic()
        while True:
            message = worker.receive(TICK)
            if isinstance(message, Event):
                with self._pool.lock:
                    job.observe(message)
            elif message is not None:
                return _verdict(job, message)
            if self._pool.closing.is_set():
                return Stopped()
            wishes.pass_on()
            if self._too_long(begun):
                log.warning("%s took too long; its worker is replaced", job.task.title)
                self._dismiss(0.0)
                return Failed(f"{job.task.title} {TOO_LONG.format(self._settings.seconds)}")
            if worker.hangs:
                log.warning("Worker %s hangs; another takes its place", worker.pid)
                self._dismiss(0.0)
                return _hung(job, worker)
            if self._overdue(job):
                log.warning("%s did not stop in time; its worker is replaced", job.task.title)
                self._dismiss(0.0)
                return Stopped()

    def _too_long(self, begun: float) -> bool:
        limit = self._settings.seconds
        return limit is not None and time.monotonic() - begun > limit

    def _overdue(self, job: Job) -> bool:
        """Whether a stopped job had its time; one that pauses too long is stopped."""
        now, paused, stopped = time.monotonic(), job.paused_since, job.stop_wished
        if paused is not None and now - paused > self._settings.pause_limit and self._pool.waiting:
            job.stop()
        return stopped is not None and now - stopped > self._settings.grace


class _Wishes:
    """Passes on what the user wishes of a job, each wish once."""

    def __init__(self, job: Job, worker: WorkerProcess) -> None:
        self._job, self._worker = job, worker
        self._paused = self._stopped = False

    def pass_on(self) -> None:
        paused = self._job.state.phase == PAUSED
        if paused is not self._paused:
            self._paused = paused
            self._worker.send(Order.PAUSE if paused else Order.RESUME)
        if self._job.stop_wished is not None and not self._stopped:
            self._stopped = True
            self._worker.send(Order.STOP)


def _verdict(job: Job, answer: Answer) -> Ended:
    if isinstance(answer, Refused) and job.stop_wished is not None:
        return Stopped()
    if isinstance(answer, Refused):
        return Failed(answer.sentence)
    if isinstance(answer, Crashed):
        log.error("%s failed unexpectedly\n%s", job.task.title, answer.traceback)
        return _failed(job, answer.error)
    return Stopped(answer.result) if answer.stopped else Finished(answer.result)


def _failed(job: Job, error: str) -> Failed:
    return Failed(f"{job.task.title} failed unexpectedly ({error}); details are in the log.")


def _hung(job: Job, worker: WorkerProcess) -> Ended:
    if job.stop_wished is not None:
        return Stopped()
    return WorkerLost(
        f"{job.task.title} hangs: its worker process has shown no sign of life for "
        f"{worker.silent:.0f} s and is replaced; start it again."
    )


def _lost(job: Job, worker: WorkerProcess) -> Ended:
    if job.stop_wished is not None:
        return Stopped()
    return WorkerLost(
        f"{job.task.title} was lost with its worker process ({worker.ending}); start it again."
    )
