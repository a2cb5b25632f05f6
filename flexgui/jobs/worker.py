"""What runs in a spawned worker process.

Four threads: the main one works; one reads orders, so that a stop, a pause or the death of the
server (the pipe ends) is known at once; one sends news, at most every INTERVAL; one says every
BEAT that the process lives.
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
    merged,
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
"""How a sentence about the work goes on."""


EYE = 0.3
"""s between two comparisons of a model that is being fitted."""
BETTER = "better"
"""Name of what the task has so far then: label of the fit, cost, comparison."""


class Reporter:
    """Progress of one task. While it is paused, whoever calls it waits."""

    def __init__(self, send: Callable[[Event], None]) -> None:
        self._send = send
        self._run, self._stop = threading.Event(), threading.Event()
        self._run.set()
        self.noticed = False
        """Whether the task learnt that it should stop."""
        self._compared = -EYE
        """When (monotonic) a model was put beside its measurements last."""

    def stage(self, title: str, total: int | None = None) -> None:
        """A new stage begins."""
        self._report(Stage(title, total))

    def advance(self, n: int = 1, text: str = "") -> None:
        """`n` steps are done."""
        self._report(Advanced(n, text))

    def generation(self, fit_label: str, generation: Generation) -> None:
        """One generation is done."""
        self._report(NewGeneration(fit_label, generation))

    def better(self, fit_label: str, cost: float, compared: Compared) -> None:
        """The best so far, as often as an eye follows."""
        if time.monotonic() - self._compared > EYE:
            self._compared = time.monotonic()
            self.partial(BETTER, (fit_label, cost, compared()))

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
        self._tasks: SimpleQueue[tuple[Task, Reporter] | Failed | None] = SimpleQueue()

    def serve(self, seconds: float | None = None) -> None:
        """One task after the other, on the main thread; each has `seconds` of a processor."""
        while (item := self._tasks.get()) is not None:
            limit_time(seconds)
            answer = item if isinstance(item, Failed) else attempt(*item)
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
            if isinstance(order, Task):
                self._reporter = Reporter(self._put)
                self._tasks.put((order, self._reporter))
            else:
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
                    self.send(ALIVE)
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

    def _obey(self, order: Order) -> None:
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


def attempt(task: Task, reporter: Reporter) -> Ended:
    """How the task ends, whatever happens in it."""
    try:
        result = task.resolve()(**task.arguments, progress=reporter)
        return Stopped(result) if reporter.noticed else Finished(result)
    except InputError as error:
        return Failed(brief(str(error)))
    except MemoryError:
        return Failed(f"{task.title} {TOO_LARGE}")
    except BaseException as error:
        return crash(error)


def crash(error: BaseException) -> Failed:
    """In words for the page and in full for the log."""
    text = " ".join(f"{type(error).__name__}: {error}".split())
    return Failed(text[:LONGEST_TEXT], "".join(traceback.format_exception(error)))


def gone() -> NoReturn:
    """Nobody would read what this process still finds."""
    os._exit(0)


SPARE = 5.0
"""s of a processor beyond the limit: the server, which can say why, ends the job first."""


def limit_memory(more: int | None) -> None:
    """This process gets `more` bytes than it has now, then MemoryError; Linux only.

    Data, not address space: compilers and allocators reserve much more than they ever touch.
    """
    used = _data_bytes()
    if more is None or used is None:
        return
    import resource

    with contextlib.suppress(ValueError, OSError):  # a lower limit stands already
        resource.setrlimit(resource.RLIMIT_DATA, (used + more, resource.RLIM_INFINITY))


def limit_time(seconds: float | None) -> None:
    """This process dies after so many more seconds of a processor, where the system can do it."""
    if seconds is None or os.name != "posix":
        return
    import resource

    usage = resource.getrusage(resource.RUSAGE_SELF)
    until = int(usage.ru_utime + usage.ru_stime + seconds + SPARE)
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CPU, (until, resource.RLIM_INFINITY))


def _data_bytes() -> int | None:
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
    except OSError:
        return None
    found = re.search(r"VmData:\s+(\d+) kB", status)
    return None if found is None else int(found[1]) * 1024


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
