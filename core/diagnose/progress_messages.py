"""Progress messages of a round: what is tried, what was done last, what must be compiled first."""

from __future__ import annotations

import threading
from collections.abc import Sequence

from ..arm.arm import Arm, Structure
from ..arm.compiled import is_compiled
from ..diagnose.output_changes import Trial, needs_compilation
from ..effects.effect import Effect
from ..progress import Progress
from ..sentences import listed

SHAPES = "Trying other numbers of bending shapes"
NOISE = "Fitting the model against a better estimate of the noise"
REFITS = "Fitting the most promising effects"
SLOW_REFITS = "Fitting the effects whose start must be searched"
ACCEPTANCE = "Testing the best effects, alone and together"
REMOVAL = "Testing whether each effect is needed"
EXCHANGE = "Trying other effects in the place of those found"
ORDER = "Ordering the effects by what they explain"
LAST = "Fitting the final model"

NOTE_MARK = "("
"""Begins the note in a message; no effect's title contains it."""

MOST_NAMED = 2
"""Most effects that a title names; more are counted, so that it fits on one or two lines."""


def fit_title(present: Sequence[Effect]) -> str:
    """Title while the model is fitted with its present effects."""
    return f"Fitting the model with {_named(present)}" if present else "Fitting the model as it is"


def round_title(present: Sequence[Effect], chosen: bool = False) -> str:
    """Title while candidates are tried: all, or those that were `chosen`."""
    if present:
        return f"Continuing the search with {_named(present)} in the model"
    return "Trying the chosen effects" if chosen else "Trying every known effect"


def _named(effects: Sequence[Effect]) -> str:
    parts = {kind for e in effects for kind in e.includes}
    titles = list(dict.fromkeys(e.title for e in effects if e.kind not in parts))
    return listed(titles) if len(titles) <= MOST_NAMED else f"{len(titles)} effects"


class RoundProgress:
    """Reports each step, and which arms are still to be compiled."""

    def __init__(self, progress: Progress, arm: Arm, planned: Sequence[Trial]) -> None:
        self._progress = progress
        self._waiting = [
            (t.effect.title, Structure.of(t.effect.changed_arm(arm, t.values)))
            for t in planned
            if needs_compilation(t, arm)
        ]
        self._last, self._note = "", ""
        self._lock = threading.Lock()  # refits ask from several threads

    def begin(self, title: str, total: int | None) -> None:
        """Begin a stage, with what is to be compiled in it."""
        with self._lock:
            self._last, self._note = "", ""
            self._progress.stage(title, total)
        self("")

    def __call__(self, text: str) -> bool:
        """Report `text`, what was just done; empty: only ask whether to stop. True: stop."""
        with self._lock:
            note = self._compile_note()
            if text or note != self._note:
                self._last, self._note = text or self._last, note
                message = f"{self._last} {note}".strip()
                self._progress.advance(1 if text else 0, text=message)
            return self._progress.stopped()

    def _compile_note(self) -> str:
        self._waiting = [(title, new) for title, new in self._waiting if not is_compiled(new)]
        titles = list(dict.fromkeys(title for title, _ in self._waiting))
        if not titles:
            return ""
        return f"{NOTE_MARK}to be compiled once, up to a minute each: {listed(titles)})"


def split_note(text: str) -> tuple[str, str]:
    """(message, note) of a step's text."""
    message, mark, note = text.partition(NOTE_MARK)
    return message.strip(), mark + note
