"""What the data do not determine, how well estimates repeat, and which model level was chosen."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from flexgui.core.identify.first_states import START
from flexgui.core.identify.identifiability import (
    INDISTINGUISHABLE,
    INVOLVED,
    POORLY_DISTINGUISHABLE,
    identified,
)
from flexgui.core.results import Fit, LevelChoice, Outcome, Repeated, Valley
from flexgui.core.results.identification import RECORDING_MARK
from flexgui.core.sentences import listed
from flexgui.sentences.written import SUPERSCRIPTS, format_number

LARGEST_DENOMINATOR = 6
EXPONENT_TOLERANCE = 0.02

GREEK = {"epsilon": "ε", "tau": "τ", "lambda": "λ"}

STARTS_FREE = "The data do not fully determine the initial state of each recording."


def sentences_of_fits(fits: Sequence[Fit]) -> tuple[str, ...]:
    """Of all fits, each named by its label where they differ."""
    pairs = [(fit.label, text) for fit in fits for text in identifiability_sentences(fit)]
    same = list(dict.fromkeys(text for _, text in pairs))
    if len(fits) == 1 or len(same) == 1:
        return tuple(same)
    return tuple(f"{label}: {text}" for label, text in pairs)


def identifiability_sentences(fit: Fit) -> tuple[str, ...]:
    """What the data do not determine, what they determine only together, and what poorly."""
    result = fit.identifiability
    if not result.names:
        return ("Nothing was estimated.",)
    labels, null = [_symbols(name) for name in result.names], result.null_directions
    # Initial states are dozens of numbers: a reader does not want a line for each.
    own = np.array([not name.startswith(START) for name in result.names])
    determined = identified(null, len(labels))
    signed = np.array([e.lower > 0.0 for e in fit.estimates])
    lines = [
        _undetermined(d, labels, signed) for d in null if np.any((np.abs(d) >= INVOLVED) & own)
    ]
    poorly = []
    together = np.tril(np.abs(fit.correlation) > POORLY_DISTINGUISHABLE, -1)
    together &= np.outer(determined, determined) & (own[:, None] | own[None, :])
    for i, j in np.argwhere(together):
        pair, rho = f"{labels[j]} and {labels[i]}", float(fit.correlation[i, j])
        if abs(rho) > INDISTINGUISHABLE:
            lines.append(
                f"The data do not determine {pair} separately (correlation {rho:+.5f}). Fix one "
                "of them to get the other."
            )
        else:
            poorly.append(f"{pair} are poorly distinguishable (correlation {rho:+.3f}).")
    lines += [
        f"The data hardly determine {labels[i]}: its standard deviation exceeds its value."
        for i in result.unsure if own[i] and determined[i]
    ]  # fmt: skip
    lines += [
        f"The prior of {_symbols(name)} and the recordings contradict each other: they differ by "
        f"{format_number(apart, 2)} standard deviations. Check the prior, or what the model lacks."
        for name, apart in fit.contradicted.items()
    ]
    if not lines:
        lines = ["All estimated parameters are identifiable."]
        lines += [STARTS_FREE] if len(null) else []
    return (*lines, *poorly)


def _undetermined(direction: np.ndarray, labels: Sequence[str], signed: np.ndarray) -> str:
    """`signed` (P,): whose sign is fixed, so that a power of it has a meaning."""
    involved = np.flatnonzero(np.abs(direction) >= INVOLVED)
    names, relative = [labels[int(i)] for i in involved], direction[involved]
    if len(names) == 1:
        return f"The data say nothing about {names[0]}."
    if len(names) == 2 and signed[involved].all():
        return (
            f"The data determine {product(relative, names)}, not {names[0]} and {names[1]} "
            "separately. Fix one of them to get the other."
        )
    relative = relative / np.abs(direction).max()
    changes = ", ".join(f"{name} {x:+.2f} %" for name, x in zip(names, relative, strict=True))
    return (
        f"The data do not distinguish {listed(names)}. Changing them together ({changes}) changes "
        "no measured signal. Fix one of them."
    )


def invariant(valley: Valley) -> str:
    """What is constant along it, such as 'ε d⁴'."""
    return product(valley.direction, [_symbols(name) for name in valley.names])


def product(direction: np.ndarray, names: Sequence[str]) -> str:
    """The product of powers of two names that relative changes along `direction` (2,) leave as it
    is."""
    powers = np.array([direction[1], -direction[0]])
    powers = powers / powers[np.argmin(np.abs(powers))]
    powers = powers if powers[0] > 0 else -powers
    return " ".join(_power(name, x) for name, x in zip(names, powers, strict=True))


def _power(name: str, exponent: float) -> str:
    fraction = Fraction(float(exponent)).limit_denominator(LARGEST_DENOMINATOR)
    exact = abs(float(fraction) - exponent) < EXPONENT_TOLERANCE * max(abs(exponent), 1.0)
    text = str(fraction) if exact else f"{exponent:.2f}"
    if text == "1":
        return name
    return name + (text.translate(SUPERSCRIPTS) if text.lstrip("-").isdigit() else f"^({text})")


def _symbols(label: str) -> str:
    """A label with Greek letters: 'epsilon1@bench' -> 'ε1 (bench)'."""
    name, _, recording = label.partition(RECORDING_MARK)
    stem = name.rstrip("0123456789")
    text = GREEK.get(stem, stem) + name[len(stem) :]
    return f"{text} ({recording})" if recording else text


def notes(outcome: Outcome) -> tuple[str, ...]:
    """The chosen level, how it was done, and how well parameters repeat between runs."""
    chosen = () if outcome.chosen_level is None else (_level(outcome.chosen_level),)
    return (*chosen, *outcome.notes, *_repeats(outcome.repeated))


def _level(chosen: LevelChoice) -> str:
    number = format_number(chosen.ratio, 2)
    if chosen.level == "lpv":
        return (
            f"Model level: linear parameter-varying; on these motions it differs from the full "
            f"equations by at most {number} times the noise floor."
        )
    if not chosen.channel:
        return "Model level: full equations, which this rig needs."
    return (
        f"Model level: full equations; the linear model misses {chosen.channel} by {number} times "
        f"the noise floor on these motions."
    )


def _repeats(repeated: tuple[Repeated, ...]) -> tuple[str, ...]:
    """How well each parameter repeats, then the runs that disagree."""
    return (
        *(
            f"{r.name}: standard deviation {_percent(r.between, r.mean)} between runs, "
            f"{_percent(r.within, r.mean)} within a run."
            for r in repeated
        ),
        *(
            f"Run {run.run} differs in {r.name} by {100.0 * run.share:+.2g} %. Check temperature, "
            "load and gain."
            for r in repeated
            for run in r.disagreeing
        ),
    )


def _percent(deviation: float, value: float) -> str:
    percent = 100.0 * deviation / abs(value) if value else 0.0
    return f"{format_number(percent, 2)} %" if value else format_number(deviation, 2)
