"""Progress of long work by callback, and the way to stop it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace

from flexgui.core.arm.arm import Structure
from flexgui.core.processors import at_most
from flexgui.core.progress import Progress, Silent, counted_simulations
from flexgui.core.results import Generation


@dataclass(frozen=True)
class Update:
    """Where a long computation stands."""

    stage: str = ""
    """What is being done, such as 'Identifying'."""
    done: int = 0
    """Steps of the stage that are done."""
    total: int | None = None
    """Steps of the stage; None where nobody knows."""
    text: str = ""
    """What the last step was about, such as the name of a recording."""
    simulations: int = 0
    """Simulations in this stage, which tell that long steps go on."""
    generation: int | None = None
    """Number of the evolution's last generation, while an evolution runs."""
    cost: float | None = None
    """Its best cost, mean square of the weighted residuals, without a unit."""


Callback = Callable[[Update], bool | None]
"""Called after each step, and about twice a second while a step simulates. What returns False stops
the work, which ends with the best it has. Without one, stderr shows bars on a terminal and a line
now and then elsewhere."""


class CallbackProgress(Silent):
    """Turns what a computation reports into updates for one callback, one at a time."""

    def __init__(self, callback: Callback) -> None:
        self._callback, self._lock = callback, threading.Lock()
        self._now, self._stopped = Update(), False

    def stage(self, title: str, total: int | None = None) -> None:
        """A new stage begins, with `total` steps where that is known."""
        self._update(lambda now: Update(title, 0, total))

    def advance(self, n: int = 1, text: str = "") -> None:
        """`n` steps of the stage are done."""
        self._update(lambda now: replace(now, done=now.done + n, text=text or now.text))

    def simulated(self, n: int) -> None:
        """`n` simulations more are done."""
        self._update(lambda now: replace(now, simulations=now.simulations + n))

    def generation(self, fit_label: str, generation: Generation) -> None:
        """One generation of an evolution is done."""
        number, best = generation.number, float(generation.best)
        self._update(lambda now: replace(now, text=fit_label, generation=number, cost=best))

    def stopped(self) -> bool:
        """Whether the callback has returned False."""
        return self._stopped

    def _update(self, change: Callable[[Update], Update]) -> None:
        with self._lock:  # recordings are read by several threads
            self._now = change(self._now)
            if self._callback(self._now) is False:
                self._stopped = True


@contextmanager
def at_work(
    callback: Callback | None, arms: Iterable[Structure] = (), workers: int | None = None
) -> Iterator[Progress]:
    """What a computation reports to: the callback, or stderr. What the first one on a machine has
    to compile is part of it; `arms` that will be needed later are compiled beside it. `workers`:
    processors that it may use."""
    from flexgui.core.precompile import precompile_all
    from flexgui.progress import shown_progress

    shown = shown_progress() if callback is None else nullcontext(CallbackProgress(callback))
    with at_most(workers), shown as progress, counted_simulations(progress):
        precompile_all(progress, arms)
        yield progress
