"""One place where a job can run: a worker process, and the light thread that looks after it."""

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

from flexgui.core.resumable.executor import one_thread_each
from flexgui.jobs.job import Job
from flexgui.jobs.messages import Ended, Failed, Order, PoolSettings, Ready, Stopped, WorkerLost
from flexgui.jobs.worker import TOO_LONG, work

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


# A fork would copy the page's threads as locks that nobody ever opens.
_SPAWN = multiprocessing.get_context("spawn")


LAST_BREATH = 1.0
"""s between the end of a pipe and the end of its process, so that one can say how it ended."""


class WorkerGoneError(Exception):
    """The process ended without being asked."""


def _limit_waiting(pipe: int, seconds: float) -> None:
    """A message that the pipe cannot hold at once waits for the other end: from now on for so long
    without a byte at most, then it is an OSError. Elsewhere than on POSIX it waits for ever."""
    if os.name != "posix":
        return
    limit = struct.pack("ll", int(seconds), int(seconds % 1.0 * 1e6))
    with socket.socket(fileno=os.dup(pipe)) as same:
        for option in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
            same.setsockopt(socket.SOL_SOCKET, option, limit)


class WorkerProcess:
    """Starts on construction; used by one thread."""

    def __init__(self, settings: PoolSettings) -> None:
        self._heard = time.monotonic()
        self._silence = settings.silence
        self._pipe, theirs = _SPAWN.Pipe()
        try:
            _limit_waiting(self._pipe.fileno(), settings.silence)
            self._process = _SPAWN.Process(
                target=work,
                args=(theirs, settings),
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
            theirs.close()  # else the pipe would not end with the worker

    @property
    def pid(self) -> int:
        """Of the process; 0 before it has one."""
        return self._process.pid or 0

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._process.is_alive()

    @property
    def silent(self) -> float:
        """s since it was heard of last."""
        return time.monotonic() - self._heard

    @property
    def hangs(self) -> bool:
        """Whether there was no sign of life for as long as it takes to say so."""
        return self.silent > self._silence

    @property
    def ending(self) -> str:
        """How the process ended, for a sentence."""
        code = self._process.exitcode
        if code is None:
            return "it does not answer"
        return f"signal {-code}" if code < 0 else f"exit code {code}"

    def send(self, message: Any) -> None:
        """WorkerGoneError where nobody is there; other errors where it cannot travel."""
        try:
            self._pipe.send(message)
        except OSError as error:
            self._process.join(LAST_BREATH)
            raise WorkerGoneError from error

    def receive(self, timeout: float) -> Any | None:
        """The next message; None for a sign of life, and after `timeout` s without anything.
        WorkerGoneError at its death."""
        try:
            # A dead worker's last words are read before its death is told: the pipe ends after.
            if wait([self._pipe], timeout):
                message = self._pipe.recv()
                self._heard = time.monotonic()
                return message
        except (EOFError, OSError) as error:
            self._process.join(LAST_BREATH)
            raise WorkerGoneError from error
        return None

    def end(self, patience: float) -> None:
        """The process is gone afterwards: by itself within `patience` s, else killed."""
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
            log.warning("Worker %s is gone or hangs in the middle of a job", self._worker.pid)
            ending = _lost(job, self._worker)
            self._dismiss(0.0)
        except Exception as error:  # a task or a result that no pipe can carry
            log.exception("%s could not be sent or received", job.task.title)
            ending = _failed(job, " ".join(f"{type(error).__name__}: {error}".split()))
            self._dismiss(0.0)
        finally:
            self._pool.job_over(job, ending)

    def _ending(self, job: Job, worker: WorkerProcess) -> Ended:
        """Relays both ways until there is an answer, or none is to be expected."""
        worker.send(job.task)
        begun = time.monotonic()
        while True:
            message = worker.receive(TICK)
            if isinstance(message, Ended):
                return _judged(job, message)
            if message is not None:
                with self._pool.lock:
                    job.observe(message)
            if self._pool.closing.is_set():
                return Stopped()
            while job.orders:
                worker.send(job.orders.popleft())
            if worker.hangs:
                raise WorkerGoneError
            late = self._too_late(job, begun)
            if late is not None:
                log.warning("%s did not end in time; its worker is replaced", job.task.title)
                self._dismiss(0.0)
                return late

    def _too_late(self, job: Job, begun: float) -> Ended | None:
        """How a job ends that had its time; one that pauses too long is asked to stop."""
        now, limit, paused = time.monotonic(), self._settings.seconds, job.paused_since
        if limit is not None and now - begun > limit:
            return Failed(f"{job.task.title} {TOO_LONG.format(limit)}")
        if paused is not None and now - paused > self._settings.pause_limit and self._pool.waiting:
            job.stop()
        stopped = job.stop_wished
        return Stopped() if stopped is not None and now - stopped > self._settings.grace else None


def _judged(job: Job, ending: Ended) -> Ended:
    """As the page is told of it."""
    if not isinstance(ending, Failed):
        return ending
    if ending.traceback:
        log.error("%s failed unexpectedly\n%s", job.task.title, ending.traceback)
        return _failed(job, ending.sentence)
    return ending if job.stop_wished is None else Stopped()


def _failed(job: Job, error: str) -> Failed:
    return Failed(f"{job.task.title} failed unexpectedly ({error}); details are in the log.")


def _lost(job: Job, worker: WorkerProcess) -> Ended:
    if job.stop_wished is not None:
        return Stopped()
    why = f"was lost with its worker process ({worker.ending})"
    if worker.hangs:
        why = f"stopped responding for {worker.silent:.0f} s"
    return WorkerLost(f"{job.task.title} {why}; start it again.")
