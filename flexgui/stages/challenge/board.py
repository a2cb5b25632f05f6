"""The board of a class: who found which effect. All who use the same seed have the same data."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from flexgui.stages.challenge.judging import Entry, plain_name
from flexgui.views.table import Column, Row, Table

MOST_CLASSES, MOST_ENTRIES = 50, 200
"""Seeds that are remembered, and entries of each; the oldest go first."""


@dataclass
class _Class:
    entries: dict[str, Entry] = field(default_factory=dict)
    guessing: set[str] = field(default_factory=set)
    """Keys of who has committed to a guess and not seen the truth."""


class Board:
    """Shared by all sessions of a server; thread-safe. Only those who revealed see the guesses."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._classes: OrderedDict[tuple[int, str], _Class] = OrderedDict()
        self._callbacks: list[Callable[[], None]] = []

    def committed(self, seed: int, level: str, key: str) -> None:
        """Notes that a session, by its key, has guessed."""
        with self._lock:
            state = self._of(seed, level)
            if key not in state.entries and len(state.guessing) < MOST_ENTRIES:
                state.guessing.add(key)
        self._notify()

    def put(self, seed: int, level: str, key: str, entry: Entry) -> None:
        """Stores the result of a session that revealed; one entry per session."""
        with self._lock:
            state = self._of(seed, level)
            state.guessing.discard(key)
            state.entries.setdefault(key, replace(entry, name=plain_name(entry.name)))
            while len(state.entries) > MOST_ENTRIES:
                state.entries.pop(next(iter(state.entries)))
        self._notify()

    def entries(self, seed: int, level: str) -> tuple[Entry, ...]:
        """Entries, complete ones first, then by time."""
        with self._lock:
            state = self._classes.get((seed, level))
            entries = () if state is None else tuple(state.entries.values())
        return tuple(sorted(entries, key=lambda e: (not e.complete, -e.found, e.seconds)))

    def guessing(self, seed: int, level: str) -> int:
        """Number of sessions that guessed and did not reveal."""
        with self._lock:
            state = self._classes.get((seed, level))
            return 0 if state is None else len(state.guessing)

    def subscribe(self, callback: Callable[[], None]) -> Callable[[], None]:
        """Calls `callback` after each change; call the result to stop."""
        with self._lock:
            self._callbacks.append(callback)

        def end() -> None:
            with self._lock:
                if callback in self._callbacks:
                    self._callbacks.remove(callback)

        return end

    def _of(self, seed: int, level: str) -> _Class:
        state = self._classes.setdefault((seed, level), _Class())
        self._classes.move_to_end((seed, level))
        while len(self._classes) > MOST_CLASSES:
            self._classes.popitem(last=False)
        return state

    def _notify(self) -> None:
        with self._lock:
            callbacks = tuple(self._callbacks)
        for callback in callbacks:
            callback()


SOMEBODY = "somebody"

CHANGED = "°"
"""Behind the name of who changed the guess."""


def board_table(entries: Sequence[Entry], waiting: int) -> Table:
    """The entries in this order; `waiting`: how many guessed and did not reveal."""
    columns = (
        Column("Who"), Column("Guess"), Column("Found"), Column("Size"),
        Column("Time", numeric=True),
    )  # fmt: skip
    rows = tuple(
        Row(
            (
                " ".join(((e.name or SOMEBODY), *([CHANGED] if e.changed else []))), e.guess,
                f"{e.found} of {e.hidden}", e.size or "–", clock(e.seconds),
            ),
            strong=e.complete,
        )
        for e in entries
    )  # fmt: skip
    notes = [f"{CHANGED} changed the guess."] if any(e.changed for e in entries) else []
    if waiting:
        notes.append(f"{waiting} more guessed and have not revealed yet.")
    return Table(columns, rows, " ".join(notes))


def clock(seconds: float) -> str:
    """'3:05 min' for 185 `seconds`."""
    whole = int(round(seconds))
    return f"{whole // 60}:{whole % 60:02d} min"
