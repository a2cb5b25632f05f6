"""A folder of hand-ins as a table: who found what."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import dataclass, fields
from pathlib import Path

from core.errors import InputError
from core.study.challenge import opened, truth_in_words
from flexgui.session.hand_in import ENDING, HandIn, read_hand_in
from flexgui.session.judging import judged

FORMULA = ("=", "+", "-", "@")
"""A cell that begins so is computed by spreadsheets; whoever hands in may choose a name."""


@dataclass(frozen=True)
class Grade:
    """One row, empty but for `file` and `fault` where the file is no sound hand-in."""

    file: str
    name: str = ""
    seed: int | None = None
    level: str = ""
    guess: str = ""
    found: int | None = None
    """How many of the hidden effects were named."""
    hidden: int | None = None
    complete: bool | None = None
    """Whether all were named and nothing else."""
    size: str = ""
    """How near the stated sizes are, a phrase."""
    used_tool_first: bool | None = None
    changed: bool | None = None
    truth: str = ""
    fault: str = ""


def grades(folder: Path) -> tuple[Grade, ...]:
    """One row per hand-in below a folder, by path; InputError where there is none."""
    if not folder.is_dir():
        raise InputError(f"{folder} is no folder; give the one that holds the hand-ins.")
    paths = sorted(path for path in folder.rglob(f"*{ENDING}") if path.is_file())
    if not paths:
        raise InputError(
            f"{folder} holds no hand-in; their names end in {ENDING}, and “Hand in” on the page "
            "or flexgui hand-in writes them."
        )
    return tuple(_graded(path, path.relative_to(folder).as_posix()) for path in paths)


def _graded(path: Path, name: str) -> Grade:
    try:
        given = read_hand_in(path)
        return _judged(given, opened(given.sealed, name), name)
    except InputError as error:
        return Grade(name, fault=str(error))


def _judged(given: HandIn, text: str, file: str) -> Grade:
    truth = json.loads(text)
    judgement = judged(given.guesses, truth)
    return Grade(
        file=file,
        name=given.name,
        seed=int(truth["seed"]),
        level=str(truth["level"]),
        guess="; ".join(f"{g.kind} {g.size}".strip() for g in given.guesses),
        found=judgement.found,
        hidden=len(judgement.hidden),
        complete=judgement.complete,
        size="; ".join(one.size for one in judgement.each if one.size),
        used_tool_first=given.asked,
        changed=given.changed,
        truth=" ".join(truth_in_words(text).splitlines()[1:]),
    )


def as_csv(rows: tuple[Grade, ...]) -> str:
    """The table, with a heading; yes and no, and nothing where nothing is known."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    names = [field.name for field in fields(Grade)]
    writer.writerow(names)
    for row in rows:
        writer.writerow([_cell(getattr(row, name)) for name in names])
    return out.getvalue()


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    text = str(value)
    return f"'{text}" if text.startswith(FORMULA) else text
