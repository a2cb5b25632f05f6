"""The truth of a challenge, the form of a guess, and the comparison of the two: kind and size."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from flexgui.core.effects import catalogue, effect
from flexgui.core.errors import InputError
from flexgui.core.parameters import Parameter
from flexgui.core.units import factor_to_si
from flexgui.sentences.written import format_number, shown_unit

if TYPE_CHECKING:
    from flexgui.core.challenge.truth import Truth
    from flexgui.core.progress import Progress
    from flexgui.core.scenario.schema import Scenario

NONE_GUESSED = "nothing"
NONE_TITLE = "nothing is hidden"

RIGHT, NEAR = 1.25, 2.0
"""Times too large or too small: a size within the first is right, within the second near."""

_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?")


@dataclass(frozen=True)
class Size:
    """A parameter's size, as guessed."""

    name: str
    value: float
    unit: str

    def __str__(self) -> str:
        return f"{self.name} = {self.value:.10g} {self.unit}".strip()


@dataclass(frozen=True)
class Guess:
    """An effect and its size, as guessed."""

    kind: str
    """Id of an effect, or 'nothing'."""
    size: Size | None = None

    @property
    def title(self) -> str:
        """The effect's title."""
        effect = catalogue().get(self.kind)
        return NONE_TITLE if effect is None else effect.title


@dataclass(frozen=True)
class SizeField:
    """A parameter of an effect and the unit in which its size is entered."""

    name: str
    title: str
    unit: str
    """Of a size that is typical of the parameter: it reveals nothing of the hidden one."""

    @property
    def label(self) -> str:
        """'mt2 [kg]'"""
        return f"{self.name} [{self.unit or '–'}]"

    def stated(self, text: str) -> Size | None:
        """The size of an entered text, None of an empty one; InputError if it is not a number."""
        plain = text.strip().replace("\N{MINUS SIGN}", "-").replace(",", ".")
        if not plain:
            return None
        if _NUMBER.fullmatch(plain) is None or not math.isfinite(float(plain)):
            raise InputError(
                f"“{text.strip()}” is not a number. Write {self.name}"
                f"{f' in {self.unit}' if self.unit else ''} as 0.2 or 0,2, or leave it empty."
            )
        return Size(self.name, float(plain), self.unit)


@dataclass(frozen=True)
class JudgedGuess:
    """One guess and its result."""

    guess: Guess
    right: bool
    size: str = ""
    """How near the size is, a phrase; empty where none was given."""
    near: bool = False
    """Whether the size is right or near."""


@dataclass(frozen=True)
class Judgement:
    """The results of all guesses of a challenge."""

    each: tuple[JudgedGuess, ...]
    hidden: tuple[str, ...]
    """Ids of the hidden effects."""
    truth: tuple[str, ...]
    """What is hidden, and how large it is, in a line per effect."""

    @property
    def found(self) -> int:
        """How many of the hidden effects were named."""
        return sum(one.right for one in self.each)

    @property
    def complete(self) -> bool:
        """Whether all hidden effects were named, and no other."""
        return self.found == len(self.hidden) and all(one.right for one in self.each)

    @property
    def sentence(self) -> str:
        """The result in a sentence."""
        if self.complete:
            return "You found it." if len(self.hidden) == 1 else "You found all of it."
        if self.found:
            return f"You found {self.found} of {len(self.hidden)}."
        return "That was not it."


def judge(guesses: Sequence[Guess], truth: Truth) -> Judgement:
    """Compares guesses with the truth."""
    each = tuple(_judged_guess(guess, truth) for guess in guesses)
    return Judgement(each, truth.effects, truth_lines(truth))


@cache
def size_fields(kind: str) -> tuple[SizeField, ...]:
    """The parameters whose size a guess may state; empty if the effect has none."""
    if kind not in catalogue():
        return ()
    return tuple(
        SizeField(p.name, p.title, shown_unit(p.value or p.scale, p.unit).name)
        for p in _parameters(kind)
    )


def _parameters(kind: str) -> tuple[Parameter, ...]:
    from flexgui.core.challenge.challenge_rig import bare_model
    from flexgui.core.challenge.hidden_effect import parameters_on

    return tuple(quantity.parameter for quantity in parameters_on(effect(kind), bare_model()))


def _judged_guess(guess: Guess, truth: Truth) -> JudgedGuess:
    if guess.kind not in truth.effects:
        return JudgedGuess(guess, False)
    size = guess.size
    if size is None:
        return JudgedGuess(guess, True)
    parameter = next(p for p in _parameters(guess.kind) if p.name == size.name)
    phrase, off = _compared(parameter, size, truth.values[size.name])
    return JudgedGuess(guess, True, phrase, off <= NEAR)


def _compared(p: Parameter, size: Size, true: float) -> tuple[str, float]:
    """A phrase, and how many times too large or too small the guess is."""
    value, shown = size.value * factor_to_si(size.unit, (p.unit,)), shown_unit(true, p.unit)
    numbers = [f"{format_number(v * shown.factor, 3)} {shown.name}".strip() for v in (value, true)]
    ratio = value / true if true else math.inf
    off = max(ratio, 1.0 / ratio) if ratio > 0.0 else math.inf  # of a wrong sign too
    text = _comparison_text(off, "large" if ratio > 1.0 else "small")
    return f"{p.name}: your guess {numbers[0]}, truth {numbers[1]}, {text}", off


def _comparison_text(off: float, side: str) -> str:
    if off <= RIGHT:
        return "right"
    if not math.isfinite(off):
        return "the wrong sign"
    distance = "near" if off <= NEAR else "far off"
    return f"{distance}: {format_number(off, 2)} times too {side}"


def hide(seed: int, level: str, folder: str, *, progress: Progress) -> tuple[Scenario, Truth]:
    """The scenario and what is hidden; the recordings lie in `folder` afterwards."""
    from flexgui.core.challenge.challenge import make_challenge
    from flexgui.core.recording.save import save_recording

    progress.stage("Hiding an effect in an arm, and recording it")
    made = make_challenge(seed, level, progress)
    for r in made.recordings:
        save_recording(r, Path(folder) / f"{r.name}.csv")
    return made.scenario, made.truth


def truth_lines(truth: Truth) -> tuple[str, ...]:
    """What is hidden, and how large it is, in a line per effect."""
    from flexgui.core.challenge.challenge_rig import bare_model

    lines = []
    for kind, level in truth.shown.items():
        stated = [p for p in _parameters(kind) if p.name in truth.values]
        sizes = "; ".join(_size(p, truth.values[p.name]) for p in stated)
        lines.append(
            f"{effect(kind).title}: {sizes}. After refitting the nominal parameters, "
            f"{level:.1f} times the noise remains visible."
        )
    nominal = bare_model().parameters["EI"].value
    return (
        *lines,
        f"The true bending stiffness is EI = {truth.EI:.2f} N m² (nominal {nominal:.2f} N m²).",
    )


def _size(p: Parameter, value: float) -> str:
    return f"{p.title} = {value:.4g} {p.unit}".strip()
