"""What the data fix and what they leave free, said in words.

The singular values of the sensitivities to relative changes tell how many directions the
outputs show; the null directions tell which changes leave them as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction

import numpy as np

from core.identify.unknowns import MARK, START, Unknowns
from core.results import Identifiability, Valley

RANK_TOLERANCE = 1e-6
"""Of the largest singular value. Central differences leave about 1e-8 where there is nothing;
a direction below this is not seen by any rig."""

NEARLY_NOTHING = 0.01
"""Of the typical size: a change relative to less than this means nothing."""

INVOLVED = 0.02
"""Share of a null direction below which a parameter has no part in it."""

LARGEST_DENOMINATOR = 6
EXPONENT_TOLERANCE = 0.02

GREEK = {"epsilon": "ε", "tau": "τ", "lambda": "λ"}
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

TOGETHER = 0.99
"""Correlation above which two estimates are said to be told apart poorly."""

ALIKE = 0.999
"""Correlation above which neither of two is determined: each deviation is more than twenty times
what it is with the other known. Effects of one law end there, as differences leave them a
hundred-thousandth apart, which no rank shows."""

VALLEY_POINTS = 41


def relative_scales(unknowns: Unknowns, vector: np.ndarray) -> np.ndarray:
    """(P,): the value itself where the sign is fixed, the typical size elsewhere."""
    parameters = unknowns.parameters
    size, scales = np.abs(vector), parameters.scales()
    own = (parameters.lower() >= 0.0) & (size > NEARLY_NOTHING * scales)
    return np.where(own, size, scales)


def analyse(
    unknowns: Unknowns, vector: np.ndarray, jacobian: np.ndarray, tolerance: float = RANK_TOLERANCE
) -> tuple[int, np.ndarray, np.ndarray]:
    """(rank, singular values (P,), null directions (P - rank, P)) of relative changes. `tolerance`:
    of the largest singular value, below which nothing shows a direction."""
    scaled = jacobian * relative_scales(unknowns, vector)
    _, values, vectors = np.linalg.svd(np.linalg.qr(scaled, mode="r"))
    largest = values[0] if values.size else 0.0
    rank = int(np.sum(values > tolerance * largest)) if largest > 0.0 else 0
    return rank, values, _sparse(vectors[rank:])


def _sparse(basis: np.ndarray) -> np.ndarray:
    """The same space with as many zeros as elimination gives, each row of unit length."""
    rows = basis.copy()
    used: list[int] = []
    for i in range(len(rows)):
        free = [j for j in range(rows.shape[1]) if j not in used]
        pivot = max(free, key=lambda j: abs(rows[i, j]))
        used.append(pivot)
        rows[i] /= rows[i, pivot]
        for k in range(len(rows)):
            if k != i:
                rows[k] -= rows[k, pivot] * rows[i]
    return rows / np.linalg.norm(rows, axis=1, keepdims=True) if len(rows) else rows


def identified(null: np.ndarray, count: int) -> np.ndarray:
    """(P,) bool: parameters with no part in any null direction."""
    if not len(null):
        return np.ones(count, dtype=bool)
    return np.asarray(np.abs(null).max(axis=0) < INVOLVED)


def determined(
    unknowns: Unknowns, vector: np.ndarray, cov: np.ndarray, null: np.ndarray
) -> np.ndarray:
    """(P,) bool: parameters with no part in any null direction, whose deviation is below their
    size, and which no other one imitates."""
    seen = identified(null, len(vector))
    alike = np.abs(correlation_of(cov)) > ALIKE
    np.fill_diagonal(alike, False)
    imitated = (alike & np.outer(seen, seen)).any(axis=1)
    return np.asarray(seen & ~wide(unknowns, vector, cov) & ~imitated)


def wide(unknowns: Unknowns, vector: np.ndarray, cov: np.ndarray) -> np.ndarray:
    """(P,) bool: parameters whose deviation exceeds their size."""
    deviations = np.sqrt(np.maximum(np.diag(cov), 0.0))
    return np.asarray(deviations > relative_scales(unknowns, vector))


def correlation_of(cov: np.ndarray) -> np.ndarray:
    """(P, P); zero where nothing is known."""
    d = np.sqrt(np.maximum(np.diag(cov), 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        rho = cov / np.outer(d, d)
    return np.nan_to_num(rho)


def invariant(direction: np.ndarray, names: Sequence[str]) -> str:
    """The product of powers of two names that a null direction leaves as it is."""
    first, second = (int(i) for i in np.flatnonzero(np.abs(direction) >= INVOLVED))
    powers = np.array([direction[second], -direction[first]])
    powers = powers / powers[np.argmin(np.abs(powers))]
    powers = powers if powers[0] > 0 else -powers
    return " ".join(_power(names[i], x) for i, x in zip((first, second), powers, strict=True))


def _power(name: str, exponent: float) -> str:
    fraction = Fraction(float(exponent)).limit_denominator(LARGEST_DENOMINATOR)
    exact = abs(float(fraction) - exponent) < EXPONENT_TOLERANCE * max(abs(exponent), 1.0)
    text = str(fraction) if exact else f"{exponent:.2f}"
    if text == "1":
        return name
    return name + (text.translate(SUPERSCRIPTS) if text.lstrip("-").isdigit() else f"^({text})")


def written(label: str) -> str:
    """A label as a person writes it: 'epsilon1@bench' -> 'ε1 (bench)'."""
    name, _, recording = label.partition(MARK)
    stem = name.rstrip("0123456789")
    text = GREEK.get(stem, stem) + name[len(stem) :]
    return f"{text} ({recording})" if recording else text


STARTS_FREE = "The data do not determine all of the state in which each recording begins."


def sentences(
    unknowns: Unknowns, null: np.ndarray, correlation: np.ndarray, unsure: Iterable[int] = ()
) -> tuple[str, ...]:
    """What a person should know before using the estimates; `unsure` are the indices of those whose
    deviation exceeds their size."""
    labels = [written(label) for label in unknowns.labels]
    if not len(labels):
        return ("Nothing was estimated.",)
    # Of the states in which recordings begin, dozens of numbers, nobody wants to know each.
    own = np.array([not label.startswith(START) for label in unknowns.labels])
    involved = [np.abs(direction) >= INVOLVED for direction in null]
    lines = [
        _about(d, labels) for d, seen in zip(null, involved, strict=True) if np.any(seen & own)
    ]
    seen = identified(null, len(labels))
    alike, correlated = _correlated(correlation, labels, seen, own)
    lines += alike
    lines += [
        f"The data hardly determine {labels[i]}: its standard deviation exceeds its value."
        for i in unsure if own[i] and seen[i]
    ]  # fmt: skip
    if not lines:
        lines = ["All estimated parameters are identifiable."]
        lines += [STARTS_FREE] if len(null) else []
    return tuple(lines + correlated)


def _about(direction: np.ndarray, labels: Sequence[str]) -> str:
    involved = np.flatnonzero(np.abs(direction) >= INVOLVED)
    names = [labels[int(i)] for i in involved]
    if len(names) == 1:
        return f"The data say nothing about {names[0]}."
    if len(names) == 2:
        return (
            f"The data determine {invariant(direction, labels)}, not {names[0]} and {names[1]} "
            "separately: fix one of them to get the other."
        )
    largest = np.abs(direction).max()
    changes = ", ".join(f"{labels[int(i)]} {direction[i] / largest:+.2f} %" for i in involved)
    listed = ", ".join(names[:-1]) + f" and {names[-1]}"
    return (
        f"The data do not distinguish {listed}: changing them together ({changes}) changes nothing "
        f"that is measured; fix one of them."
    )


def _correlated(
    correlation: np.ndarray, labels: Sequence[str], seen: np.ndarray, own: np.ndarray
) -> tuple[list[str], list[str]]:
    """Of pairs that are not determined, and of those that are so poorly."""
    alike, poorly = [], []
    for i in range(len(labels)):
        for j in range(i):
            rho = correlation[i, j]
            if not ((own[i] or own[j]) and seen[i] and seen[j] and abs(rho) > TOGETHER):
                continue
            pair = f"{labels[j]} and {labels[i]}"
            if abs(rho) > ALIKE:
                alike.append(
                    f"The data do not determine {pair} separately (correlation {rho:+.5f}): fix "
                    f"one of them to get the other."
                )
            else:
                poorly.append(f"{pair} are poorly distinguishable (correlation {rho:+.3f}).")
    return alike, poorly


def valley(
    unknowns: Unknowns,
    vector: np.ndarray,
    null: np.ndarray,
    cost: Callable[[np.ndarray], float],
) -> Valley | None:
    """The curve along which two parameters trade against each other, with the cost on it."""
    for direction in null:
        involved = np.flatnonzero(np.abs(direction) >= INVOLVED)
        items = [unknowns.items[i].parameter for i in involved]
        if len(items) != 2 or not all(item.positive for item in items):
            continue
        a, b = items
        span = _span(vector[involved], direction[involved], (a.lower, b.lower), (a.upper, b.upper))
        steps = np.linspace(*span, VALLEY_POINTS)
        points = vector[involved] * np.exp(np.outer(steps, direction[involved]))
        vectors = np.tile(vector, (VALLEY_POINTS, 1))
        vectors[:, involved] = points
        costs = np.array([cost(v) for v in vectors])
        least = max(float(costs.min()), np.finfo(float).tiny)
        names = (unknowns.labels[involved[0]], unknowns.labels[involved[1]])
        text = invariant(direction, [written(label) for label in unknowns.labels])
        return Valley(names, (a.unit, b.unit), points, costs / least, text)
    return None


def _span(
    at: np.ndarray, direction: np.ndarray, lower: Sequence[float], upper: Sequence[float]
) -> tuple[float, float]:
    """Steps along a relative direction that stay within the bounds."""
    to_lower = np.log(np.array(lower) / at) / direction
    to_upper = np.log(np.array(upper) / at) / direction
    ends = np.sort(np.array([to_lower, to_upper]), axis=0)
    return float(ends[0].max()), float(ends[1].min())


def verdict(
    unknowns: Unknowns,
    vector: np.ndarray,
    jacobian: np.ndarray,
    cov: np.ndarray,
    cost: Callable[[np.ndarray], float],
) -> Identifiability:
    """All of the above as one record."""
    rank, values, null = analyse(unknowns, vector, jacobian)
    unsure = np.flatnonzero(wide(unknowns, vector, cov))
    return Identifiability(
        names=unknowns.labels,
        rank=rank,
        singular_values=values,
        null_directions=null,
        sentences=sentences(unknowns, null, correlation_of(cov), unsure),
        valley=valley(unknowns, vector, null, cost),
    )
