"""Who found what in a challenge, for a class."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from flexgui.views.table import Column, Row, Table

SOMEBODY = "somebody"

MARKS = {"*": "used the tool before guessing", "°": "changed the guess"}
"""Behind a name."""


class Found(Protocol):
    """One person's end of a challenge."""

    @property
    def name(self) -> str:
        """The player's nickname."""

    @property
    def guess(self) -> str:
        """What was guessed, in words."""

    @property
    def found(self) -> int:
        """How many hidden effects were named."""

    @property
    def hidden(self) -> int:
        """How many effects were hidden."""

    @property
    def complete(self) -> bool:
        """Whether all were named, and nothing else."""

    @property
    def size(self) -> str:
        """How near the guessed sizes came, in words."""

    @property
    def seconds(self) -> float:
        """From the start to the guess, s."""

    @property
    def asked(self) -> bool:
        """Whether the diagnosis was used before guessing."""

    @property
    def changed(self) -> bool:
        """Whether the guess was changed."""


def board_table(entries: Sequence[Found], waiting: int) -> Table:
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
        notes.append(f"{waiting} more committed to a guess and have not revealed it yet.")
    return Table(columns, rows, " ".join(notes))


def _marks(e: Found) -> tuple[str, ...]:
    return tuple(m for m, it in zip(MARKS, (e.asked, e.changed), strict=True) if it)


def clock(seconds: float) -> str:
    """'3:05 min'"""
    whole = int(round(seconds))
    return f"{whole // 60}:{whole % 60:02d} min"
