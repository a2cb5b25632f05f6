"""Runs in a spawned worker process.

Four threads: the main one runs tasks; one reads orders, so that a stop, a pause or the end of the
server (the pipe closes) takes effect at once; one sends events, at most every INTERVAL; one sends a
heartbeat every HEARTBEAT_INTERVAL.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import threading
import time
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, NoReturn

from flexgui.core.errors import InputError
from flexgui.core.progress import counted_simulations
from flexgui.core.sentences import brief
from flexgui.jobs.messages import (
    ALIVE,
    Advanced,
    Ended,
    Event,
    Failed,
    Finished,
    NewGeneration,
    Order,
    Partial,
    PoolSettings,
    Ready,
    Stage,
    Stopped,
    Task,
    merge_events,
)

if TYPE_CHECKING:
    from flexgui.core.progress import Compared
    from flexgui.core.results import Generation


TOO_LARGE = (
    "needs more memory than is allowed; cut the recordings, keep fewer columns or simulate fewer "
    "samples."
)
TOO_LONG = (
    "took longer than {:.0f} s; cut the recordings, keep fewer columns or simulate fewer samples."
)
"""Rest of a sentence that begins with the task's title."""


COMPARISON_INTERVAL = 0.3
"""s between two comparisons of a model that is being fitted."""
BETTER = "better"
"""Name of the partial result: label of the fit, cost, comparison."""


class Reporter:
    """Reports the progress of one task. While it is paused, its methods block."""

    def __init__(self, send: Callable[[Event], None]) -> None:
        self._send = send
        self._run, self._stop = threading.Event(), threading.Event()
        self._run.set()
        self.saw_stop = False
        """Whether the task has read that it should stop."""
        self._compared_at = -COMPARISON_INTERVAL
        """When (monotonic) a comparison was made last."""

    def stage(self, title: str, total: int | None = None) -> None:
        """A new stage begins."""
        self._report(Stage(title, total))

    def advance(self, n: int = 1, text: str = "") -> None:
        """`n` steps are done."""
        self._report(Advanced(n, text))

    def simulated(self, n: int) -> None:
        """`n` simulations more are done."""
        self._report(Advanced(0, simulations=n))

    def generation(self, fit_label: str, generation: Generation) -> None:
        """One generation is done."""
        self._report(NewGeneration(fit_label, generation))

    def better(self, fit_label: str, cost: float, compared: Compared) -> None:
        """The best fit so far and its `cost`, at most every COMPARISON_INTERVAL."""
        if time.monotonic() - self._compared_at > COMPARISON_INTERVAL:
            self._compared_at = time.monotonic()
            self.partial(BETTER, (fit_label, cost, compared()))

    def partial(self, name: str, value: Any) -> None:
        """A partial result."""
        self._report(Partial(name, value))

    def stopped(self) -> bool:
        """Whether the task should end with its best result so far."""
        self._run.wait()
        self.saw_stop = self.saw_stop or self._stop.is_set()
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


HEARTBEAT_INTERVAL = 2.0
"""s between two heartbeats."""

INTERVAL = 0.05
"""s between two batches of events: a page follows 20 a second."""

LONGEST_TEXT = 300
"""Characters of an unexpected error's text."""


def work(pipe: Connection, settings: PoolSettings) -> None:
    """The main function of a worker process."""
    # Ctrl-C reaches every process of a terminal; the server then closes its workers itself.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "nice"):
        os.nice(settings.niceness)
    worker = Worker(pipe)
    threading.Thread(target=worker.read, name="orders", daemon=True).start()
    threading.Thread(target=worker.send_events, name="news", daemon=True).start()
    warm_up_error = _warm_up_error(settings.warm_up)
    threading.Thread(target=worker.send_heartbeats, name="heart", daemon=True).start()
    limit_memory(settings.memory)  # beyond the stacks of its threads
    worker.send(Ready(warm_up_error))
    worker.serve(settings.seconds)


def _warm_up_error(warm_up: str | None) -> str:
    """Warms up; returns the traceback if that fails, else ''."""
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
        self._waiting_lock, self._changed = threading.Lock(), threading.Event()
        self._reporter = Reporter(self._put)
        self._tasks: SimpleQueue[tuple[Task, Reporter] | Failed | None] = SimpleQueue()

    def serve(self, seconds: float | None = None) -> None:
        """One task after the other, on the main thread; each has `seconds` of a processor."""
        while (item := self._tasks.get()) is not None:
            limit_time(seconds)
            answer = item if isinstance(item, Failed) else ending_of(*item)
            self._flush()
            try:
                self.send(answer)
            except OSError:
                exit_process()
            except Exception as error:  # a result that no pipe can carry
                self.send(failure_of(error))

    def read(self) -> None:
        """Reads tasks and orders."""
        while True:
            try:
                order = self._pipe.recv()
            except (EOFError, OSError):
                exit_process()
            except Exception as error:  # arguments that cannot be read here
                self._tasks.put(failure_of(error))
                continue
            if isinstance(order, Task):
                self._reporter = Reporter(self._put)
                self._tasks.put((order, self._reporter))
            else:
                self._follow(order)

    def send_events(self) -> None:
        """Sends the waiting events, then pauses, so that a fast search does not flood the pipe."""
        while True:
            self._changed.wait()
            self._changed.clear()
            with contextlib.suppress(OSError):  # the reading thread then ends the process
                self._flush()
            time.sleep(INTERVAL)

    def send_heartbeats(self) -> None:
        """Sends heartbeats; the reading thread sees when the server is gone."""
        with contextlib.suppress(OSError):
            while True:
                with contextlib.suppress(MemoryError):  # the job uses all memory
                    self.send(ALIVE)
                time.sleep(HEARTBEAT_INTERVAL)

    def send(self, message: Any) -> None:
        """Send one message at a time."""
        with self._sending:
            self._pipe.send(message)

    def _put(self, event: Event) -> None:
        """Adds an event to the next batch."""
        with self._waiting_lock:
            self._waiting = merge_events(self._waiting, event)
        self._changed.set()

    def _flush(self) -> None:
        with self._sending:
            with self._waiting_lock:
                events, self._waiting = self._waiting, []
            for event in events:
                self._pipe.send(event)

    def _follow(self, order: Order) -> None:
        match order:
            case Order.PAUSE:
                self._reporter.pause()
            case Order.RESUME:
                self._reporter.resume()
            case Order.STOP:
                self._reporter.stop()
            case Order.EXIT:
                self._reporter.stop()
                self._tasks.put(None)


def ending_of(task: Task, reporter: Reporter) -> Ended:
    """Runs the task and returns its ending; never raises."""
    try:
        with counted_simulations(reporter):
            result = task.resolve()(**task.arguments, progress=reporter)
        return Stopped(result) if reporter.saw_stop else Finished(result)
    except InputError as error:
        return Failed(brief(str(error)))
    except MemoryError:
        return Failed(f"{task.title} {TOO_LARGE}")
    except BaseException as error:
        return failure_of(error)


def failure_of(error: BaseException) -> Failed:
    """A short sentence for the page and the traceback for the log."""
    text = " ".join(f"{type(error).__name__}: {error}".split())
    return Failed(text[:LONGEST_TEXT], "".join(traceback.format_exception(error)))


def exit_process() -> NoReturn:
    """Ends this process: the server is gone."""
    os._exit(0)


EXTRA_SECONDS = 5.0
"""s of a processor beyond the limit, so that the server ends the job first and reports why."""


def limit_memory(extra: int | None) -> None:
    """This process gets `more` bytes than it has now, then MemoryError; Linux only.

    Data, not address space: compilers and allocators reserve much more than they ever touch.
    """
    used = _data_bytes()
    if extra is None or used is None:
        return
    import resource

    with contextlib.suppress(ValueError, OSError):  # a lower limit is set already
        resource.setrlimit(resource.RLIMIT_DATA, (used + extra, resource.RLIM_INFINITY))


def limit_time(seconds: float | None) -> None:
    """The system kills this process after so many more seconds of a processor (POSIX)."""
    if seconds is None or os.name != "posix":
        return
    import resource

    usage = resource.getrusage(resource.RUSAGE_SELF)
    until = int(usage.ru_utime + usage.ru_stime + seconds + EXTRA_SECONDS)
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CPU, (until, resource.RLIM_INFINITY))


def _data_bytes() -> int | None:
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
    except OSError:
        return None
    match = re.search(r"VmData:\s+(\d+) kB", status)
    return None if match is None else int(match[1]) * 1024


WARM_UP_SCENARIO = """
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

    run_scenario(parse_scenario(WARM_UP_SCENARIO, "warm-up"))
