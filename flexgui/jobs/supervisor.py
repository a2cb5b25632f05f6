"""One worker process, and the thread that starts it, sends it jobs and watches over it."""

from __future__ import annotations

import contextlib
import logging
import multiprocessing
import os
import socket
import struct
import threading
import time
from multiprocessing.connection import wait
from typing import TYPE_CHECKING, Any

from flexgui.core.processors import one_thread_each
from flexgui.jobs.job import Job
from flexgui.jobs.messages import Ended, Failed, Order, PoolSettings, Ready, Stopped, WorkerLost
from flexgui.jobs.worker import TOO_LONG, work

if TYPE_CHECKING:
    from flexgui.jobs.pool import JobPool

POLL_SECONDS = 0.05
"""s between two checks for orders to a running job."""

IDLE_POLL_SECONDS = 1.0
"""s between two checks whether an idle worker is still alive."""

EXIT_PATIENCE = 1.5
"""s that a worker has to exit by itself."""

MOST_FAILED_STARTS = 3
"""Failed starts in a row after which waiting jobs fail."""

LONGEST_PAUSE = 30.0
"""s between two attempts to start a worker that does not start."""

log = logging.getLogger(__name__)


# A fork would copy locks of the page's threads that are never released.
_SPAWN = multiprocessing.get_context("spawn")


EXIT_CODE_WAIT = 1.0
"""s to wait for a process to exit after its pipe has closed, to learn its exit code."""


class WorkerGoneError(Exception):
    """The process ended without being asked."""


def _limit_pipe_wait(pipe: int, seconds: float) -> None:
    """Limits how long a read or write of the pipe may block without progress: OSError after that.
    Only on POSIX; elsewhere it may block for ever."""
    if os.name != "posix":
        return
    limit = struct.pack("ll", int(seconds), int(seconds % 1.0 * 1e6))
    with socket.socket(fileno=os.dup(pipe)) as duplicate:
        for option in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
            duplicate.setsockopt(socket.SOL_SOCKET, option, limit)


class WorkerProcess:
    """Starts on construction; used by one thread."""

    def __init__(self, settings: PoolSettings) -> None:
        self._last_message = time.monotonic()
        self._silence = settings.silence
        self._pipe, worker_pipe = _SPAWN.Pipe()
        try:
            _limit_pipe_wait(self._pipe.fileno(), settings.silence)
            self._process = _SPAWN.Process(
                target=work,
                args=(worker_pipe, settings),
                name="flexgui-worker",
                daemon=True,
            )
            # Threads of its algebra would only wait for each other: the cores are the page's too.
            with one_thread_each():
                self._process.start()
        except BaseException:
            self._pipe.close()
            raise
        finally:
            worker_pipe.close()  # else the pipe would not end with the worker

    @property
    def pid(self) -> int:
        """Of the process; 0 before it has one."""
        return self._process.pid or 0

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._process.is_alive()

    @property
    def silent_seconds(self) -> float:
        """s since its last message."""
        return time.monotonic() - self._last_message

    @property
    def hangs(self) -> bool:
        """Whether it has sent nothing for longer than the limit."""
        return self.silent_seconds > self._silence

    @property
    def ending(self) -> str:
        """How the process ended, for a sentence."""
        code = self._process.exitcode
        if code is None:
            return "it does not answer"
        return f"signal {-code}" if code < 0 else f"exit code {code}"

    def send(self, message: Any) -> None:
        """WorkerGoneError if the process is gone; other errors if the message cannot be sent."""
        try:
            self._pipe.send(message)
        except OSError as error:
            self._process.join(EXIT_CODE_WAIT)
            raise WorkerGoneError from error

    def receive(self, timeout: float) -> Any | None:
        """The next message; None for a heartbeat and after `timeout` s; WorkerGoneError if the
        process is gone."""
        try:
            # Messages that a dead worker has sent are still read: the pipe ends after them.
            if wait([self._pipe], timeout):
                message = self._pipe.recv()
                self._last_message = time.monotonic()
                return message
        except (EOFError, OSError) as error:
            self._process.join(EXIT_CODE_WAIT)
            raise WorkerGoneError from error
        return None

    def end(self, patience: float) -> None:
        """Ends the process: it may exit by itself within `patience` s, then it is killed."""
        with contextlib.suppress(WorkerGoneError):
            if patience > 0.0:
                self.send(Order.EXIT)
                self._process.join(patience)
        if self.alive:
            self._process.kill()
        self._process.join()
        self._process.close()
        self._pipe.close()


class WorkerSupervisor:
    """Runs one job after another, and replaces a worker that is lost."""

    def __init__(self, pool: JobPool, number: int) -> None:
        self._pool, self._settings = pool, pool.settings
        self._worker: WorkerProcess | None = None
        self._jobs = 0
        self._failures = 0
        self._idle_since = 0.0
        self.thread = threading.Thread(
            target=self._run, name=f"jobs-supervisor-{number}", daemon=True
        )

    @property
    def pid(self) -> int | None:
        """Process id of a ready worker; else None."""
        worker = self._worker
        return None if worker is None else worker.pid

    def _run(self) -> None:
        while not self._pool.closing.is_set():
            try:
                if self._has_worker():
                    job = self._pool.next_job(IDLE_POLL_SECONDS)
                    if job is not None:
                        self._run_job(job)
                        self._idle_since = time.monotonic()
                    else:
                        self._end_idle_worker()
            except Exception:
                log.exception("A worker's supervisor met an error and goes on")
                self._end_worker(0.0)
                self._pool.closing.wait(IDLE_POLL_SECONDS)
        self._end_worker(EXIT_PATIENCE)

    def _has_worker(self) -> bool:
        """Starts a worker if needed; whether a warm one is ready."""
        if self._worker is not None and not self._is_alive(self._worker):
            log.warning("Idle worker %s is gone; another takes its place", self._worker.pid)
            self._end_worker(0.0)
        if self._jobs >= self._settings.recycle_after:
            self._end_worker(EXIT_PATIENCE)
        if self._worker is None:
            # One at a time: on a new machine the first compiles what the next ones only load.
            with self._pool.warming:
                self._worker = self._new_worker() if self._pool.wants_worker else None
        if self._worker is None:
            pause = (
                min(2.0**self._failures / 2.0, LONGEST_PAUSE) if self._failures else POLL_SECONDS
            )
            self._pool.closing.wait(pause)
        return self._worker is not None

    def _is_alive(self, worker: WorkerProcess) -> bool:
        """Whether the idle worker is alive; reads its heartbeats, or the pipe would fill up."""
        try:
            worker.receive(0.0)
        except WorkerGoneError:
            return False
        return worker.alive and not worker.hangs

    def _new_worker(self) -> WorkerProcess | None:
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
            self._idle_since = time.monotonic()
            return worker
        worker.end(0.0)
        if not self._pool.closing.is_set():
            self._start_failed(reason)
        return None

    def _not_ready(self, worker: WorkerProcess) -> str | None:
        """Waits until the worker is warm; returns None, or the reason why it is not."""
        limit = time.monotonic() + self._settings.start_limit
        try:
            while time.monotonic() < limit and not self._pool.closing.is_set():
                message = worker.receive(POLL_SECONDS)
                if isinstance(message, Ready):
                    if message.warm_up_error:
                        log.error("A worker failed to warm up\n%s", message.warm_up_error)
                    return None
        except WorkerGoneError:
            return worker.ending
        return "not ready in time"

    def _start_failed(self, reason: str) -> None:
        self._failures += 1
        log.error("A worker process could not be started (%s)", reason)
        if self._failures >= MOST_FAILED_STARTS:
            self._pool.fail_waiting(
                "No worker process can be started; details are in the log of the server."
            )

    def _end_idle_worker(self) -> None:
        """Ends a worker that had no job for long and is not among those that are kept."""
        if time.monotonic() - self._idle_since < self._settings.idle_limit:
            return
        with self._pool.lock:
            worker = self._worker if self._pool.has_spare_worker else None
            if worker is not None:
                self._worker, self._jobs = None, 0
        if worker is not None:
            worker.end(EXIT_PATIENCE)

    def _end_worker(self, patience: float) -> None:
        worker, self._worker, self._jobs = self._worker, None, 0
        if worker is not None:
            worker.end(patience)

    def _run_job(self, job: Job) -> None:
        assert self._worker is not None
        self._jobs += 1
        ending: Ended = _failed(job, "an error in its supervisor")
        try:
            ending = self._ending(job, self._worker)
        except WorkerGoneError:
            log.warning("Worker %s is gone or hangs in the middle of a job", self._worker.pid)
            ending = _worker_lost(job, self._worker)
            self._end_worker(0.0)
        except Exception as error:  # a task or a result that no pipe can carry
            log.exception("%s could not be sent or received", job.task.title)
            ending = _failed(job, " ".join(f"{type(error).__name__}: {error}".split()))
            self._end_worker(0.0)
        finally:
            self._pool.job_over(job, ending)

    def _ending(self, job: Job, worker: WorkerProcess) -> Ended:
        """Passes orders and events on until the job ends or has to be ended."""
        worker.send(job.task)
        started = time.monotonic()
        while True:
            message = worker.receive(POLL_SECONDS)
            if isinstance(message, Ended):
                return _reported(job, message)
            if message is not None:
                with self._pool.lock:
                    job.record(message)
            if self._pool.closing.is_set():
                return Stopped()
            while job.orders:
                worker.send(job.orders.popleft())
            if worker.hangs:
                raise WorkerGoneError
            overdue = self._overdue_ending(job, started)
            if overdue is not None:
                log.warning("%s did not end in time; its worker is replaced", job.task.title)
                self._end_worker(0.0)
                return overdue

    def _overdue_ending(self, job: Job, started: float) -> Ended | None:
        """The ending of a job beyond its time limit; stops a job that is paused too long."""
        now, limit, paused = time.monotonic(), self._settings.seconds, job.paused_since
        if limit is not None and now - started > limit:
            return Failed(f"{job.task.title} {TOO_LONG.format(limit)}")
        if paused is not None and now - paused > self._settings.pause_limit and self._pool.waiting:
            job.stop()
        stopped = job.stop_requested_at
        return Stopped() if stopped is not None and now - stopped > self._settings.grace else None


def _reported(job: Job, ending: Ended) -> Ended:
    """The ending that the page gets."""
    if not isinstance(ending, Failed):
        return ending
    if ending.traceback:
        log.error("%s failed unexpectedly\n%s", job.task.title, ending.traceback)
        return _failed(job, ending.sentence, ending.traceback)
    return ending if job.stop_requested_at is None else Stopped()


def _failed(job: Job, error: str, trace: str = "") -> Failed:
    return Failed(f"{job.task.title} failed unexpectedly ({error}); details are in the log.", trace)


def _worker_lost(job: Job, worker: WorkerProcess) -> Ended:
    if job.stop_requested_at is not None:
        return Stopped()
    reason = f"was lost with its worker process ({worker.ending})"
    if worker.hangs:
        reason = f"stopped responding for {worker.silent_seconds:.0f} s"
    return WorkerLost(f"{job.task.title} {reason}; start it again.")
