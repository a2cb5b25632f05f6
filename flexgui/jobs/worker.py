"""What runs in a spawned worker process.

Four threads: the main one works; one reads orders, so that a stop, a pause or the death of the
server (the pipe ends) is known at once; one sends news, at most every INTERVAL; one says every
BEAT that the process lives.
"""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, NoReturn

from flexgui.core.errors import InputError
from flexgui.core.sentences import brief
from flexgui.jobs.messages import (
    Advanced,
    Alive,
    Answer,
    Begin,
    Crashed,
    Done,
    Event,
    NewGeneration,
    Order,
    Partial,
    Ready,
    Refused,
    Stage,
    Task,
    merged,
)
from flexgui.jobs.settings import TOO_LARGE, PoolSettings, limit_memory, limit_time

if TYPE_CHECKING:
    from flexgui.core.results import Generation


class Reporter:
    """Progress of one task. While it is paused, whoever calls it waits."""

    def __init__(self, send: Callable[[Event], None]) -> None:
        self._send = send
        self._run, self._stop = threading.Event(), threading.Event()
        self._run.set()
        self.noticed = False
        """Whether the task learnt that it should stop."""

    def stage(self, title: str, total: int | None = None) -> None:
        """A new stage begins."""
        self._report(Stage(title, total))

    def advance(self, n: int = 1, text: str = "") -> None:
        """`n` steps are done."""
        self._report(Advanced(n, text))

    def generation(self, fit_label: str, generation: Generation) -> None:
        """One generation is done."""
        self._report(NewGeneration(fit_label, generation))

    def partial(self, name: str, value: Any) -> None:
        """What the task has so far."""
        self._report(Partial(name, value))

    def stopped(self) -> bool:
        """Whether the task should end with the best it has."""
        self._run.wait()
        self.noticed = self.noticed or self._stop.is_set()
        return self._stop.is_set()

    def pause(self) -> None:
        """Hold the task at its next report."""
        self._run.clear()

    def resume(self) -> None:
        """Let the task go on."""
        self._run.set()

    def stop(self) -> None:
        """Also wakes a paused task."""
        self._stop.set()
        self._run.set()

    def _report(self, event: Stage | Advanced | NewGeneration | Partial) -> None:
        self._send(event)
        self._run.wait()


BEAT = 2.0
"""s between two signs of life."""

INTERVAL = 0.05
"""s between two batches of news: 20 a second is as fast as a page follows."""

LONGEST_TEXT = 300
"""Characters of an unexpected error's text."""


def work(pipe: Connection, settings: PoolSettings) -> None:
    """The life of a worker."""
    # Ctrl-C reaches every process of a terminal; the server then closes its workers itself.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "nice"):
        os.nice(settings.niceness)
    worker = Worker(pipe)
    threading.Thread(target=worker.read, name="orders", daemon=True).start()
    threading.Thread(target=worker.spread_news, name="news", daemon=True).start()
    trouble = _trouble_of(settings.warm_up)
    threading.Thread(target=worker.beat, name="heart", daemon=True).start()
    limit_memory(settings.memory)  # beyond the stacks of its threads
    worker.send(Ready(trouble))
    worker.serve(settings.seconds)


def _trouble_of(warm_up: str | None) -> str:
    """Warms up; the traceback where that fails."""
    try:
        if warm_up is not None:
            Task(warm_up).resolve()()
    except Exception:
        return traceback.format_exc()
    return ""


class Worker:
    """The state that the four threads share."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._sending = threading.Lock()
        self._waiting: list[Event] = []
        self._keeping, self._news = threading.Lock(), threading.Event()
        self._reporter = Reporter(self._put)
        self._tasks: SimpleQueue[tuple[Task, Reporter] | Crashed | None] = SimpleQueue()
        self._orders = {
            Order.STOP: lambda: self._reporter.stop(),
            Order.PAUSE: lambda: self._reporter.pause(),
            Order.RESUME: lambda: self._reporter.resume(),
            Order.EXIT: self._exit,
        }

    def serve(self, seconds: float | None = None) -> None:
        """One task after the other, on the main thread; each has `seconds` of a processor."""
        while (item := self._tasks.get()) is not None:
            limit_time(seconds)
            answer = item if isinstance(item, Crashed) else attempt(*item)
            self._flush()
            try:
                self.send(answer)
            except OSError:
                gone()
            except Exception as error:  # a result that no pipe can carry
                self.send(crash(error))

    def read(self) -> None:
        """Orders, as they come."""
        while True:
            try:
                order = self._pipe.recv()
            except (EOFError, OSError):
                gone()
            except Exception as error:  # arguments that cannot be read here
                self._tasks.put(crash(error))
                continue
            self._obey(order)

    def spread_news(self) -> None:
        """Sends what waits, then rests, so that a fast search does not flood the pipe."""
        while True:
            self._news.wait()
            self._news.clear()
            with contextlib.suppress(OSError):  # the reading thread learns it too, and ends all
                self._flush()
            time.sleep(INTERVAL)

    def beat(self) -> None:
        """Signs of life, on a thread of its own; the reading one learns when nobody hears them."""
        with contextlib.suppress(OSError):
            while True:
                with contextlib.suppress(MemoryError):  # the job has taken all there is; it lives
                    self.send(Alive())
                time.sleep(BEAT)

    def send(self, message: Any) -> None:
        """Send one message at a time."""
        with self._sending:
            self._pipe.send(message)

    def _put(self, event: Event) -> None:
        """Sent soon, with what else there is."""
        with self._keeping:
            self._waiting = merged(self._waiting, event)
        self._news.set()

    def _flush(self) -> None:
        with self._sending:
            with self._keeping:
                events, self._waiting = self._waiting, []
            for event in events:
                self._pipe.send(event)

    def _obey(self, order: Begin | Order) -> None:
        if isinstance(order, Begin):
            self._reporter = Reporter(self._put)
            self._tasks.put((order.task, self._reporter))
        else:
            self._orders[order]()

    def _exit(self) -> None:
        self._reporter.stop()
        self._tasks.put(None)


def attempt(task: Task, reporter: Reporter) -> Answer:
    """The task's answer, whatever happens in it."""
    try:
        return Done(task.resolve()(**task.arguments, progress=reporter), reporter.noticed)
    except InputError as error:
        return Refused(brief(str(error)))
    except MemoryError:
        return Refused(f"{task.title} {TOO_LARGE}")
    except BaseException as error:
        return crash(error)


def crash(error: BaseException) -> Crashed:
    """In words for the page and in full for the log."""
    text = " ".join(f"{type(error).__name__}: {error}".split())
    return Crashed(text[:LONGEST_TEXT], "".join(traceback.format_exception(error)))


def gone() -> NoReturn:
    """Nobody would read what this process still finds."""
    os._exit(0)


TINY = """
title = "Warming up"
[arm]
preset = "paper"
[drive]
kind = "velocity_loop"
gains = [60.0, 30.0]
[[recordings]]
simulate = {theta2 = 1.2, seconds = 0.1, seed = 1}
[identify]
parameters = ["epsilon", "d"]
population = 6
generations = 1
"""


def warm_up() -> None:
    """One tiny identification: a non-linear simulation, linear responses, a refinement."""
    from flexgui.core.scenario.read import parse_scenario
    from flexgui.core.workbench import run_scenario

    run_scenario(parse_scenario(TINY, "warm-up"))


def warm_inputs() -> None:
    """Reads nothing yet: the libraries that reading needs, so that the first file is not slow."""
    import pyarrow.csv
    import pyarrow.parquet  # noqa: F401

    import flexgui.scene.recorded  # noqa: F401
