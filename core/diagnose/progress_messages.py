"""What a round's progress says: what is tried, which came last, and what must be compiled first."""

from __future__ import annotations

import threading
from collections.abc import Sequence

from ..arm.arm import Arm, Structure
from ..arm.compiled import is_compiled
from ..diagnose.output_changes import Trial, must_compile
from ..effects.effect import Effect
from ..progress import Progress
from ..sentences import listed

ASIDE = "("
"""Begins what is said in a lower voice; no effect's title holds it."""

NAMED = 2
"""Effects of the model that a title names; more are counted: it stands on one line or two."""


def fit_title(present: Sequence[Effect]) -> str:
    """While the model is fitted to the recordings with the effects that it has."""
    return f"Fitting the model with {_named(present)}" if present else "Fitting the model as it is"


def round_title(present: Sequence[Effect], chosen: bool = False) -> str:
    """While candidates are tried: all that are known, or those that were `chosen`."""
    if present:
        return f"Continuing the search with {_named(present)} in the model"
    return "Trying the chosen effects" if chosen else "Trying every known effect"


def _named(effects: Sequence[Effect]) -> str:
    parts = {kind for e in effects for kind in e.includes}
    titles = list(dict.fromkeys(e.title for e in effects if e.kind not in parts))
    return listed(titles) if len(titles) <= NAMED else f"{len(titles)} effects"


class Steps:
    """Tells what was tried, step by step, and what this machine has yet to compile for the rest."""

    def __init__(self, progress: Progress, arm: Arm, planned: Sequence[Trial]) -> None:
        self._progress = progress
        self._waiting = [
            (t.effect.title, Structure.of(t.effect.changed_arm(arm, t.values)))
            for t in planned
            if must_compile(t, arm)
        ]
        self._last, self._note = "", ""
        self._lock = threading.Lock()  # refits ask from several threads

    def begin(self, title: str, total: int) -> None:
        """The stage, with what is to be compiled in it."""
        self._progress.stage(title, total)
        self("")

    def __call__(self, text: str) -> bool:
        """`text`: what was just done, empty where it is but asked whether to stop."""
        with self._lock:
            note = self._still()
            if text or note != self._note:
                self._last, self._note = text or self._last, note
                message = f"{self._last} {note}".strip()
                self._progress.advance(1 if text else 0, text=message)
            return self._progress.stopped()

    def _still(self) -> str:
        self._waiting = [(title, new) for title, new in self._waiting if not is_compiled(new)]
        titles = list(dict.fromkeys(title for title, _ in self._waiting))
        if not titles:
            return ""
        return f"{ASIDE}still to be compiled, once, up to a minute each: {listed(titles)})"


def aside(text: str) -> tuple[str, str]:
    """What a step's text says, and what it says in a lower voice."""
    message, mark, note = text.partition(ASIDE)
    return message.strip(), mark + note
