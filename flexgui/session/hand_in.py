"""A guess at a challenge as one sealed file, for whoever grades a class."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from core.effects import catalogue
from core.errors import InputError
from core.sentences import did_you_mean
from core.study.challenge import LEVELS, obfuscate, opened
from flexgui.session.board import plain_name
from flexgui.session.judging import NONE_GUESSED, Guess

HEAD = "FlexGUI hand-in, sealed. `flexgui grade` checks it."
ENDING = ".handin"

LARGEST = 100_000
"""Bytes: a hand-in has under ten thousand."""


@dataclass(frozen=True)
class HandIn:
    """What somebody committed to, with the challenge's own seal."""

    name: str
    guesses: tuple[Guess, ...]
    sealed: str
    """Of the challenge: holds the truth."""
    asked: bool | None = None
    """Whether the tool had been used before the guess; None: made without the page."""
    changed: bool = False
    """Whether another guess was committed to before."""

    def text(self) -> str:
        """The sealed file; the same hand-in gives the same bytes."""
        content = {
            "name": plain_name(self.name),
            "guesses": [[guess.kind, guess.size] for guess in self.guesses],
            "sealed": self.sealed,
            "asked": self.asked,
            "changed": self.changed,
        }
        text = json.dumps(content, sort_keys=True)
        return obfuscate(text, text, HEAD)

    @property
    def filename(self) -> str:
        """'Ada_challenge_6.handin', without what a file system might refuse."""
        truth = json.loads(opened(self.sealed, "The challenge"))
        letters = "".join(c if c.isalnum() else "_" for c in plain_name(self.name)) or "somebody"
        return f"{letters}_challenge_{truth['seed']}{ENDING}"


def read_hand_in(path: Path) -> HandIn:
    """A hand-in from its file; InputError where it is none or its seal is broken."""
    try:
        if path.stat().st_size > LARGEST:
            raise InputError(f"{path.name} is too large for a hand-in.")
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputError(f"{path.name} cannot be read: {error.strerror or error}.") from error
    plain = opened(text, path.name, HEAD)
    try:
        return _stated(json.loads(plain))
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path.name} is no hand-in of this program.") from error


def _stated(content: dict[str, Any]) -> HandIn:
    return HandIn(
        name=plain_name(str(content["name"])),
        guesses=tuple(Guess(str(kind), str(size)) for kind, size in content["guesses"]),
        sealed=str(content["sealed"]),
        asked=content["asked"],
        changed=bool(content["changed"]),
    )


def stated_guess(text: str) -> Guess:
    """'coulomb_friction: fc1 = 0.2 N m' as a guess; InputError where no effect has that id."""
    kind, _, size = (part.strip() for part in text.partition(":"))
    known = (*catalogue(), NONE_GUESSED)
    if kind not in known:
        raise InputError(f"--guess {kind!r} is no effect; {did_you_mean(kind, known)}")
    return Guess(kind, size)


def most_guesses(sealed: str) -> int:
    """How many effects are hidden at the level of a sealed challenge."""
    level = json.loads(opened(sealed, "The challenge"))["level"]
    return LEVELS[level][0]
