"""Who found what, for a class: everybody with the same seed has the same data."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from flexgui.stages.challenge.judging import Entry, plain_name
from flexgui.views.table import Column, Row, Table

CLASSES, MOST = 50, 200
"""Seeds that are remembered, and entries of each; the oldest go first."""


@dataclass
class _Class:
    entries: dict[str, Entry] = field(default_factory=dict)
    guessing: set[str] = field(default_factory=set)
    """Keys of who has committed to a guess and not seen the truth."""


class Board:
    """Shared by all sessions of a server; thread-safe. What somebody guessed is only told to those
    who have seen the truth themselves."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._classes: OrderedDict[tuple[int, str], _Class] = OrderedDict()
        self._callbacks: list[Callable[[], None]] = []

    def committed(self, seed: int, level: str, key: str) -> None:
        """Somebody, by the session's key, has made a guess."""
        with self._lock:
            known = self._of(seed, level)
            if key not in known.entries and len(known.guessing) < MOST:
                known.guessing.add(key)
        self._notify()

    def put(self, seed: int, level: str, key: str, entry: Entry) -> None:
        """Somebody has seen the truth; a session stands there once."""
        with self._lock:
            known = self._of(seed, level)
            known.guessing.discard(key)
            known.entries.setdefault(key, replace(entry, name=plain_name(entry.name)))
            while len(known.entries) > MOST:
                known.entries.pop(next(iter(known.entries)))
        self._notify()

    def entries(self, seed: int, level: str) -> tuple[Entry, ...]:
        """Who found all comes first, the quicker before the slower."""
        with self._lock:
            known = self._classes.get((seed, level))
            found = () if known is None else tuple(known.entries.values())
        return tuple(sorted(found, key=lambda e: (not e.complete, -e.found, e.seconds)))

    def guessing(self, seed: int, level: str) -> int:
        """How many have committed to a guess and not looked."""
        with self._lock:
            known = self._classes.get((seed, level))
            return 0 if known is None else len(known.guessing)

    def subscribe(self, callback: Callable[[], None]) -> Callable[[], None]:
        """Calls `callback` after each change, until what is returned is called."""
        with self._lock:
            self._callbacks.append(callback)

        def end() -> None:
            with self._lock:
                if callback in self._callbacks:
                    self._callbacks.remove(callback)

        return end

    def _of(self, seed: int, level: str) -> _Class:
        known = self._classes.setdefault((seed, level), _Class())
        self._classes.move_to_end((seed, level))
        while len(self._classes) > CLASSES:
            self._classes.popitem(last=False)
        return known

    def _notify(self) -> None:
        with self._lock:
            callbacks = tuple(self._callbacks)
        for callback in callbacks:
            callback()


SOMEBODY = "somebody"

MARKS = {"*": "used the tool before guessing", "°": "changed the guess"}
"""Behind a name."""


def board_table(entries: Sequence[Entry], waiting: int) -> Table:
    """In the order given; `waiting` have guessed and not seen the truth."""
    columns = (
        Column("Who"), Column("Guess"), Column("Found"), Column("Size"),
        Column("Time", numeric=True),
    )  # fmt: skip
    rows = tuple(
        Row(
            (
                " ".join(((e.name or SOMEBODY), *_marks(e))), e.guess,
                f"{e.found} of {e.hidden}", e.size or "–", clock(e.seconds),
            ),
            strong=e.complete,
        )
        for e in entries
    )  # fmt: skip
    used = {mark for e in entries for mark in _marks(e)}
    notes = [f"{mark} {meaning}." for mark, meaning in MARKS.items() if mark in used]
    if waiting:
        notes.append(f"{waiting} more guessed and have not revealed yet.")
    return Table(columns, rows, " ".join(notes))


def _marks(e: Entry) -> tuple[str, ...]:
    return tuple(m for m, it in zip(MARKS, (e.asked, e.changed), strict=True) if it)


def clock(seconds: float) -> str:
    """'3:05 min'"""
    whole = int(round(seconds))
    return f"{whole // 60}:{whole % 60:02d} min"
