"""A guess at a challenge as one obfuscated file, and a folder of them as a table for whoever grades
a class."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import dataclass, fields
from pathlib import Path

import msgspec

from flexgui.core.challenge.challenge import LEVELS, obfuscate, reveal
from flexgui.core.effects import catalogue
from flexgui.core.errors import InputError
from flexgui.core.sentences import did_you_mean
from flexgui.stages.challenge.judging import NONE_GUESSED, Guess, judge, plain_name, truth_text

HEAD = "FlexGUI hand-in, sealed. `flexgui grade` checks it."
ENDING = ".handin"

LARGEST_HAND_IN = 100_000
"""Bytes: a hand-in has under ten thousand."""


@dataclass(frozen=True)
class HandIn:
    """The guesses of one person with the challenge's obfuscated truth."""

    name: str
    guesses: tuple[Guess, ...]
    obfuscated: str
    """Of the challenge: holds the truth."""
    asked: bool | None = None
    """Whether the tool had been used before the guess; None: made without the page."""
    changed: bool = False
    """Whether another guess was committed to before."""

    def text(self) -> str:
        """The obfuscated file; the same hand-in gives the same bytes."""
        content = {
            "name": plain_name(self.name),
            "guesses": [[guess.kind, guess.size] for guess in self.guesses],
            "sealed": self.obfuscated,
            "asked": self.asked,
            "changed": self.changed,
        }
        text = json.dumps(content, sort_keys=True)
        return obfuscate(text, text, HEAD)

    @property
    def filename(self) -> str:
        """'Ada_challenge_6.handin', in characters that every file system takes."""
        truth = json.loads(reveal(self.obfuscated, "The challenge"))
        letters = "".join(c if c.isalnum() else "_" for c in plain_name(self.name)) or "somebody"
        return f"{letters}_challenge_{truth['seed']}{ENDING}"


def read_hand_in(path: Path) -> HandIn:
    """A hand-in from its file; InputError if it is not one or its checksum is wrong."""
    try:
        if path.stat().st_size > LARGEST_HAND_IN:
            raise InputError(f"{path.name} is too large for a hand-in.")
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputError(f"{path.name} cannot be read: {error.strerror or error}.") from None
    try:
        read = msgspec.json.decode(reveal(text, path.name, HEAD), type=_Content)
    except msgspec.DecodeError:
        raise InputError(f"{path.name} is not a hand-in of FlexGUI.") from None
    guesses = tuple(Guess(kind, size) for kind, size in read.guesses)
    return HandIn(plain_name(read.name), guesses, read.obfuscated, read.asked, read.changed)


class _Content(msgspec.Struct, rename={"obfuscated": "sealed"}):
    name: str
    guesses: list[tuple[str, str]]
    obfuscated: str
    asked: bool | None
    changed: bool


def stated_guess(text: str) -> Guess:
    """'coulomb_friction: fc1 = 0.2 N m' as a guess; InputError if the id is unknown."""
    kind, _, size = (part.strip() for part in text.partition(":"))
    kinds = (*catalogue(), NONE_GUESSED)
    if kind not in kinds:
        raise InputError(f"--guess {kind!r} is not an effect; {did_you_mean(kind, kinds)}")
    return Guess(kind, size)


def most_guesses(obfuscated: str) -> int:
    """Number of effects that an obfuscated challenge hides."""
    level = json.loads(reveal(obfuscated, "The challenge"))["level"]
    return LEVELS[level][0]


FORMULA = ("=", "+", "-", "@")
"""A cell that begins so is computed by spreadsheets; whoever hands in may choose a name."""


@dataclass(frozen=True)
class Grade:
    """One row; only `file` and `fault` if the hand-in cannot be read."""

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
    """One row per hand-in below a folder, by path; InputError if there are none."""
    if not folder.is_dir():
        raise InputError(f"{folder} is not a folder; name the folder of the hand-ins.")
    paths = sorted(path for path in folder.rglob(f"*{ENDING}") if path.is_file())
    if not paths:
        raise InputError(
            f"{folder} holds no hand-in (*{ENDING}). “Hand in” on the page or flexgui hand-in "
            f"writes one."
        )
    return tuple(_graded(path, path.relative_to(folder).as_posix()) for path in paths)


def _graded(path: Path, name: str) -> Grade:
    try:
        answer = read_hand_in(path)
        return _judged(answer, reveal(answer.obfuscated, name), name)
    except InputError as error:
        return Grade(name, fault=str(error))


def _judged(answer: HandIn, text: str, file: str) -> Grade:
    truth = json.loads(text)
    judgement = judge(answer.guesses, truth)
    return Grade(
        file=file,
        name=answer.name,
        seed=int(truth["seed"]),
        level=str(truth["level"]),
        guess="; ".join(f"{g.kind} {g.size}".strip() for g in answer.guesses),
        found=judgement.found,
        hidden=len(judgement.hidden),
        complete=judgement.complete,
        size="; ".join(guess.size for guess in judgement.each if guess.size),
        used_tool_first=answer.asked,
        changed=answer.changed,
        truth=" ".join(truth_text(text).splitlines()[1:]),
    )


def as_csv(rows: tuple[Grade, ...]) -> str:
    """The table with a heading; 'yes', 'no', or empty if unknown."""
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
