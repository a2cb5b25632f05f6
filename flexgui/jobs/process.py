"""The server's end of one worker process."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import socket
import struct
import time
from multiprocessing.connection import wait
from typing import Any

from flexgui.core.resumable.executor import one_thread_each
from flexgui.jobs.messages import Alive, Order
from flexgui.jobs.settings import PoolSettings
from flexgui.jobs.worker import work

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
        """The next message, None after `timeout` s without one; WorkerGoneError at its death."""
        try:
            # A dead worker's last words are read before its death is told: the pipe ends after.
            if wait([self._pipe], timeout):
                message = self._pipe.recv()
                self._heard = time.monotonic()
                return None if isinstance(message, Alive) else message
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
