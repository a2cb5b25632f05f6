"""The board of a class: who found which effect. All who use the same seed have the same data."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flexgui.stages.challenge.judging import Judgement
from flexgui.views.table import Column, Row, Table

MOST_CLASSES, MOST_ENTRIES = 50, 200
"""Seeds that are remembered, and entries of each; the oldest go first."""


@dataclass(frozen=True)
class Entry:
    """One person's result of a challenge."""

    name: str
    """As the person wrote it; empty: somebody."""
    judgement: Judgement
    seconds: float
    """From the data to the truth."""
    changed: bool = False
    """Whether another guess was committed to before this one."""


LONGEST_NAME = 24


def plain_name(text: str) -> str:
    """A name in one short line of printable characters."""
    return " ".join("".join(c for c in text if c.isprintable()).split())[:LONGEST_NAME]


class Board:
    """Shared by all sessions of a server; thread-safe. Only those who revealed see the guesses."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._classes: OrderedDict[tuple[int, str], dict[str, Entry | None]] = OrderedDict()
        """Seed and level -> key of a session -> its entry; None until it reveals."""
        self._callbacks: list[Callable[[], None]] = []

    def note(self, seed: int, level: str, key: str, entry: Entry | None = None) -> None:
        """Notes that a session, by its key, has guessed, or its result; the first result stays."""
        with self._lock:
            entries = self._classes.setdefault((seed, level), {})
            entries[key] = entries.get(key) or entry
            self._classes.move_to_end((seed, level))
            while len(entries) > MOST_ENTRIES:
                entries.pop(next(iter(entries)))
            while len(self._classes) > MOST_CLASSES:
                self._classes.popitem(last=False)
            callbacks = tuple(self._callbacks)
        for callback in callbacks:
            callback()

    def entries(self, seed: int, level: str) -> tuple[Entry, ...]:
        """Entries, complete ones first, then by time."""
        entries = [entry for entry in self._of(seed, level) if entry is not None]
        return tuple(sorted(entries, key=_rank))

    def guessing(self, seed: int, level: str) -> int:
        """Number of sessions that guessed and did not reveal."""
        return self._of(seed, level).count(None)

    def subscribe(self, callback: Callable[[], None]) -> Callable[[], None]:
        """Calls `callback` after each change; call the result to stop."""
        with self._lock:
            self._callbacks.append(callback)

        def end() -> None:
            with self._lock:
                if callback in self._callbacks:
                    self._callbacks.remove(callback)

        return end

    def _of(self, seed: int, level: str) -> list[Entry | None]:
        with self._lock:
            return list(self._classes.get((seed, level), {}).values())


def _rank(entry: Entry) -> tuple[bool, int, float]:
    return not entry.judgement.complete, -entry.judgement.found, entry.seconds


SOMEBODY = "somebody"

CHANGED = "°"
"""Behind the name of who changed the guess."""


def board_table(entries: Sequence[Entry], waiting: int) -> Table:
    """The entries in this order; `waiting`: how many guessed and did not reveal."""
    columns = (
        Column("Who"), Column("Guess"), Column("Found"), Column("Size"),
        Column("Time", numeric=True),
    )  # fmt: skip
    rows = tuple(_row(entry) for entry in entries)
    notes = [f"{CHANGED} changed the guess."] if any(e.changed for e in entries) else []
    if waiting:
        notes.append(f"{waiting} more guessed and have not revealed yet.")
    return Table(columns, rows, " ".join(notes))


def _row(entry: Entry) -> Row:
    judgement, minutes = entry.judgement, round(entry.seconds) // 60
    sized = [guess for guess in judgement.each if guess.size]
    size = "near" if all(guess.near for guess in sized) else "far off"
    cells = (
        f"{entry.name or SOMEBODY} {CHANGED if entry.changed else ''}".strip(),
        ", ".join(result.guess.title for result in judgement.each),
        f"{judgement.found} of {len(judgement.hidden)}",
        size if sized else "–",
        f"{minutes}:{round(entry.seconds) % 60:02d} min",
    )
    return Row(cells, strong=judgement.complete)
