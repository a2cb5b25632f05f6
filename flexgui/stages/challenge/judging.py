"""The truth of a challenge, what a guess may say, and a guess against the truth: kind and size."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexgui.core.effects import catalogue, effect, with_included
from flexgui.core.effects.sizes import typical
from flexgui.core.errors import InputError
from flexgui.core.parameters import Parameter
from flexgui.core.units import factor_to_si
from flexgui.sentences.written import format_number, shown_unit

if TYPE_CHECKING:
    from flexgui.core.parameters import Parameter
    from flexgui.core.progress import Progress

NONE_GUESSED = "nothing"
NONE_TITLE = "nothing is hidden"

RIGHT, NEAR = 1.25, 2.0
"""Times too large or too small: a size within the first is right, within the second near."""

_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?")
_SIZE = re.compile(
    r"(?:([A-Za-zθα-ω]\w*)\s*[=:]\s*)?([-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?)\s*(1/[^\d,;=]*|[^\d,;=]*)"
)


@dataclass(frozen=True)
class Guess:
    """An effect and its size, as a person named them."""

    kind: str
    """Id of an effect, or 'nothing'."""
    size: str = ""

    @property
    def title(self) -> str:
        """The effect's title."""
        one = catalogue().get(self.kind)
        return NONE_TITLE if one is None else one.title


@dataclass(frozen=True)
class AskedSize:
    """A parameter of an effect, and the unit in which a person states its size."""

    name: str
    title: str
    unit: str
    """Of a size that is typical of the parameter: it tells nothing of the hidden one."""

    @property
    def label(self) -> str:
        """'mt2 [kg]'"""
        return f"{self.name} [{self.unit or '–'}]"

    def stated(self, text: str) -> str:
        """'mt2 = 0.15 kg' from what was typed, '' from nothing; InputError where it is no
        number."""
        plain = text.strip().replace("\N{MINUS SIGN}", "-").replace(",", ".")
        if not plain:
            return ""
        if _NUMBER.fullmatch(plain) is None or not math.isfinite(float(plain)):
            raise InputError(
                f"“{text.strip()}” is no number: write the size of {self.name} as a number alone"
                f"{f' in {self.unit}' if self.unit else ''}, such as 0.2 or 0,2, or leave it empty."
            )
        return f"{self.name} = {float(plain):.10g} {self.unit}".strip()


@dataclass(frozen=True)
class Judged:
    """One guess, judged."""

    guess: Guess
    right: bool
    size: str = ""
    """How near the size is, a phrase; empty where none was given."""
    near: bool = False
    """Whether the size is right or near."""


@dataclass(frozen=True)
class Judgement:
    """All guesses of a challenge."""

    each: tuple[Judged, ...]
    hidden: tuple[str, ...]
    found: int
    """How many of the hidden effects were named."""

    @property
    def complete(self) -> bool:
        """Whether all that was hidden was found, and nothing else named."""
        return self.found == len(self.hidden) and all(one.right for one in self.each)

    @property
    def sentence(self) -> str:
        """For the person."""
        if self.complete:
            return "You found it." if len(self.hidden) == 1 else "You found all of it."
        if self.found:
            return f"You found {self.found} of {len(self.hidden)}."
        return "That was not it."


def judged(guesses: Sequence[Guess], truth: Mapping[str, Any]) -> Judgement:
    """`truth` as it was obfuscated."""
    hidden = tuple(truth["effects"])
    quantities = _parameters(hidden)
    each = tuple(_one(guess, hidden, quantities, truth["values"]) for guess in guesses)
    named = {k.kind for one in each if one.right for k in with_included([effect(one.guess.kind)])}
    return Judgement(each, hidden, len(named & set(hidden)))


@cache
def asked_sizes(kind: str) -> tuple[AskedSize, ...]:
    """What may be asked of an effect; empty where it has no size, or is none."""
    known = catalogue().get(kind)
    if known is None:
        return ()
    found = _parameters([one.kind for one in with_included([known])])[kind]
    return tuple(
        AskedSize(p.name, p.title, shown_unit(p.value or p.scale, p.unit).name) for p in found
    )


def _parameters(kinds: Sequence[str]) -> dict[str, tuple[Parameter, ...]]:
    from flexgui.core.study.study_rig import bare_model, study_rig

    model = bare_model().with_effects([effect(kind) for kind in kinds], {})
    return {
        one.kind: tuple(
            k.parameter
            for k in one.parameters(model.arm, model.drive, typical(model.arm))
            if one.shown(k.parameter.name, study_rig(model))
        )
        for one in model.effects
    }


def _one(
    guess: Guess,
    hidden: Sequence[str],
    quantities: Mapping[str, tuple[Parameter, ...]],
    values: Mapping[str, float],
) -> Judged:
    if guess.kind not in hidden:
        return Judged(guess, False)
    stated = read_sizes(guess.size)
    if not stated:
        return Judged(guess, True)
    phrases, near = [], True
    for name, value, unit in stated:
        known = [p for p in quantities[guess.kind] if p.name in values and name in ("", p.name)]
        if not known:
            phrases.append(f"{name} is not a parameter of this effect")
            continue
        phrase, ratio = min((_compared(p, value, unit, values[p.name]) for p in known), key=_off)
        phrases.append(phrase)
        near = near and _off((phrase, ratio)) <= NEAR
    return Judged(guess, True, "; ".join(phrases), near)


def read_sizes(text: str) -> list[tuple[str, float, str]]:
    """'fc1 = 0.2 N m, fc2 = 0.1' -> (name or '', number, unit or ''), in the order written."""
    return [(m[1] or "", float(m[2]), m[3].strip()) for m in _SIZE.finditer(text)]


def _compared(p: Parameter, value: float, unit: str, true: float) -> tuple[str, float]:
    """A phrase, and how many times too large the guess is."""
    try:
        value *= factor_to_si(unit, (p.unit,))
    except InputError:
        unit = ""  # taken as SI, which the phrase shows
    shown = shown_unit(true, p.unit)
    numbers = [f"{format_number(v * shown.factor, 3)} {shown.name}".strip() for v in (value, true)]
    ratio = value / true if true else math.inf
    return f"{p.name}: your guess {numbers[0]}, truth {numbers[1]}, {_words(ratio)}", ratio


def _off(found: tuple[str, float]) -> float:
    """Times too large or too small, at least 1; a wrong sign is as bad as can be."""
    ratio = found[1]
    return max(ratio, 1.0 / ratio) if ratio > 0.0 else math.inf


def _words(ratio: float) -> str:
    off = _off(("", ratio))
    if off <= RIGHT:
        return "right"
    side = "large" if ratio > 1.0 else "small"
    if off <= NEAR:
        return f"near: {off:.2g} times too {side}"
    return f"far off: {off:.2g} times too {side}" if math.isfinite(off) else "the wrong sign"


@dataclass(frozen=True)
class Entry:
    """One person's end of a challenge."""

    name: str
    """As the person wrote it; empty: somebody."""
    guess: str
    found: int
    hidden: int
    complete: bool
    size: str
    seconds: float
    """From the data to the truth."""
    asked: bool
    """Whether the tool was asked before the guess."""
    changed: bool = False
    """Whether another guess was committed to before this one."""


LONGEST_NAME = 24


def plain_name(text: str) -> str:
    """One short line."""
    return " ".join("".join(c for c in text if c.isprintable()).split())[:LONGEST_NAME]


def hide(seed: int, level: str, folder: str, *, progress: Progress) -> tuple[str, str]:
    """(scenario as TOML, obfuscated truth); the recordings lie in `folder` afterwards."""
    from flexgui.core.recording.save import save_recording
    from flexgui.core.scenario.read import scenario_toml
    from flexgui.core.study.challenge import make_challenge

    progress.stage("Hiding an effect in an arm, and recording it")
    made = make_challenge(seed, level)
    for r in made.recordings:
        save_recording(r, Path(folder) / f"{r.name}.csv")
    return scenario_toml(made.scenario), made.obfuscated


def revealed(place: Path) -> str:
    """The truth in words; InputError where there is none or its checksum is wrong.

    `place` is a challenge's folder, its zip, or the obfuscated file itself.
    """
    from flexgui.core.study.challenge import TRUTH_FILE, obfuscated_truth, reveal

    return truth_in_words(reveal(obfuscated_truth(place), TRUTH_FILE))


def truth_in_words(text: str, names: bool = True) -> str:
    """What was obfuscated, for a person: the effects, their sizes, how well they show; with `names`
    also those by which a scenario states them."""
    from flexgui.core.study.study_rig import bare_model

    truth = json.loads(text)
    values, shown = truth["values"], truth["shown"]
    kinds = [effect(kind) for kind in truth["effects"]]
    model = bare_model().with_effects(kinds, values)
    nominal = bare_model().parameters["EI"].value
    lines = [f"Challenge {truth['seed']} ({truth['level']}). Hidden:"]
    for one in model.effects:
        quantities = one.parameters(model.arm, model.drive, typical(model.arm))
        # A size of zero hides nothing, such as the delay of a sensor that is not there.
        stated = [q.parameter for q in quantities if values.get(q.parameter.name)]
        sizes = [_size(p, values[p.name], p.name if names else "") for p in stated]
        title = f"{one.title} ({one.kind})" if names else one.title
        lines.append(f"- {title}{': ' if sizes else ''}{'; '.join(sizes)}.")
        if one.kind in shown:
            lines.append(
                f"  After refitting the nominal parameters, {shown[one.kind]:.1f} times the noise "
                f"remains visible."
            )
    lines.append(
        f"The true bending stiffness is EI = {truth['EI']:.2f} N m² (nominal {nominal:.2f} N m²)."
    )
    return "\n".join(lines)


def _size(p: Parameter, value: float, name: str) -> str:
    return f"{p.title} {name} = {value:.4g} {p.unit}".replace("  ", " ").strip()
