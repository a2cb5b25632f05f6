"""Faults of any size: gain, offset, delay and clock of a channel, along the slopes of a fit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..check.column_fault import DEGREES, MILLI, ColumnFault, columns
from ..check.equations import BENDING, FLOOR, MAINLY
from ..check.fitted import GAINED, GROSS, ITERATIONS, Fitted, with_change
from ..recording.channels import Role, is_reference, role_of

CLEAR = 1.0
"""By which the score falls at least for a fault."""
CLOSEST = 3
"""Best candidates that are fitted."""
FACTOR, LATE, DRIFT = 0.25, 2.0, (1e-3, 0.05)
"""Sizes up to which there is no fault: |ln factor|, since dry friction takes ten per cent and a
payload as much; samples of lag, of drives and filters; s/s, ten times what quartz clocks differ.
Beyond the second a clock has another sample time."""
SURE = 6.0
"""Standard deviations of its size."""
LAGS = (1.0, 4.0, 8.0, 13.0)
"""Samples of lag where a fit begins, which finds what is within half a period."""
GROWING = (-13.0, -4.0, 4.0, 13.0)
"""The same of a growing lag, at the end."""
LARGEST_LOG_FACTOR = 30.0
"""In the logarithm of a factor."""
GEARS, WHOLE = (3, 300), 0.03
"""Factors of an encoder that are a gear's, and the share by which friction and noise may move them
from a whole number. A factor of two is a scale as often."""

Group = tuple[str, ...]
Step = tuple[ColumnFault, Fitted]


@dataclass(frozen=True)
class Kind:
    """A fault of one size."""

    make: Callable[[Group, float], ColumnFault]
    trial: float
    """Step of a difference."""
    least: float
    """What is no fault."""
    starts: tuple[float, ...] = (0.0,)
    roles: tuple[Role, ...] = tuple(Role)
    """Of the channels that may have it."""
    most: float = np.inf


def _scaled(group: Group, size: float) -> ColumnFault:
    factor = float(np.exp(np.clip(size, -LARGEST_LOG_FACTOR, LARGEST_LOG_FACTOR)))
    return ColumnFault("scale", group, factor, is_usual=False)


def _named(fault: ColumnFault) -> ColumnFault:
    """A factor by what it means: a unit, or an encoder's gear."""
    for usual, factor in (("degrees", DEGREES), ("millimetres", MILLI)):
        if fault.fault == "scale" and abs(fault.factor / factor - 1.0) < WHOLE:
            return ColumnFault(usual, fault.channels, factor)
    whole = round(fault.factor)
    gear = GEARS[0] <= whole <= GEARS[1] and abs(fault.factor / whole - 1.0) < WHOLE
    if gear and all(role_of(n) is Role.PLACE and not is_reference(n) for n in fault.channels):
        return replace(fault, fault="gear_ratio", factor=float(whole))
    return fault


def _sized(fault: str, number: str, group: Group, size: float) -> ColumnFault:
    return ColumnFault(fault, group, is_usual=False, **{number: size})  # type: ignore[arg-type]


OFFSET, DELAY, DRIFTING = (
    partial(_sized, *names)
    for names in (("offset", "shift"), ("delay", "lag"), ("clock_drift", "drift"))
)
SCALE = Kind(_scaled, 0.01, FACTOR)
"""Sizes are logarithms."""


def is_absurd(fault: ColumnFault) -> bool:
    """Whether not even a unit and a gear together explain a factor."""
    return abs(np.log(fault.factor)) > np.log(MILLI * GEARS[1]) if fault.factor > 0.0 else False


def _trials(fit: Fitted) -> Iterator[tuple[Kind, Group, float]]:
    """Kinds, channels and sizes from which a fit begins."""
    step, count = fit.recording.sample_time, len(fit.recording.time)
    names = columns(fit.recording)
    groups = [(n,) for n in names] + ([("z1", "z2")] if {"z1", "z2"} <= set(names) else [])
    lags, growing = (tuple(k * step for k in LAGS), tuple(k / count for k in GROWING))
    shown = (Role.PLACE, Role.TIP) if "z1" in names else ()
    for group in groups:
        kinds = [] if {*group} & {*fit.recording.unknown_gains} else [SCALE]
        kinds += [
            Kind(OFFSET, 1e-3, BENDING, roles=shown),
            Kind(DELAY, 2.0 * step, LATE * step, lags),
        ]  # fmt: skip
        if not any(map(is_reference, group)):
            kinds.append(Kind(DRIFTING, 4.0 / count, DRIFT[0], growing, most=DRIFT[1]))
        for kind in kinds:
            if all(role_of(n) in kind.roles for n in group):
                yield from ((kind, group, start) for start in kind.starts)


def sized_fault(fit: Fitted) -> Step | None:
    """The gain, offset, delay or clock that explains most of what is left."""
    best: dict[tuple[str, Group], tuple[float, Kind, Group, float]] = {}
    for each in sorted(_predicted(fit, list(_trials(fit))), key=lambda each: each[0]):
        _, kind, group, size = each
        best.setdefault((kind.make(group, size).fault, group), each)
    trials = list(best.values())
    promising = [each for each in trials[:CLOSEST] if each[0] < fit.score - CLEAR]
    found = _refined_best(fit, promising)
    if found is None:
        return None
    # A joint turns the arm, so that a linear step shows little of a large fault in it.
    kind = found[1]
    alike = [e for e in trials if e[1].make is kind.make and e not in promising]
    exchanged = _refined_best(fit, alike)
    return min((e for e in (found, exchanged) if e is not None), key=lambda e: e[0][1].score)[0]


def _refined_best(
    fit: Fitted, trials: Sequence[tuple[float, Kind, Group, float]]
) -> tuple[Step, Kind] | None:
    """The trial that explains most at its own size, and its kind."""
    steps = [(refined(fit, kind, group, size), kind) for _, kind, group, size in trials]
    known = [(step, kind) for step, kind in steps if step is not None]
    return min(known, key=lambda pair: pair[0][1].score, default=None)


def _predicted(
    fit: Fitted, trials: Sequence[tuple[Kind, Group, float]]
) -> Iterator[tuple[float, Kind, Group, float]]:
    """(score, kind, channels, size) after a linear step from each trial."""
    asked = []
    for kind, group, size in trials:
        asked += [kind.make(group, s).corrected(fit.recording) for s in (size, size + kind.trial)]
    answers = fit.of.answers([(r, fit.x) for r in asked])
    for k, (kind, group, size) in enumerate(trials):
        changed = with_change(fit, answers[2 * k : 2 * k + 2], fit.recording)
        yield changed.left, kind, group, size + kind.trial * changed.solved[1]


def refined(
    fit: Fitted, kind: Kind, group: Group, size: float, begin: Fitted | None = None
) -> Step | None:
    """The fault at its size, sought from a `size` in its kind's unit, with the nuisance beside,
    which begins as in another fit; None where it is none."""
    begin = begin or fit
    best, deviation, x, fresh = None, np.inf, begin.x, False
    for _ in range(ITERATIONS):
        both = (size, size + kind.trial)
        at, moved = (kind.make(group, s).corrected(fit.recording) for s in both)
        after = with_change(begin, begin.of.answers([(at, x), (moved, x)]), at)
        worse = best is not None and after.score > best[1].score
        if not worse:
            best = size, replace(after, x=x)
            _, change, deviation = best[1].solved
        assert best is not None
        if worse or best[1].score - best[1].left < GAINED:
            if fresh:
                break
            begin, fresh = replace(best[1], kept=None, change=None), True
            size, x = best[0], best[1].x
            continue
        size, x = size + kind.trial * change, best[1].moved()
    assert best is not None
    size, after = best
    deviation *= kind.trial
    sure = kind.most > abs(size) > max(kind.least, SURE * deviation)
    early = kind.make is DELAY and size < 0.0  # another channel is late then
    if not sure or early or not _explains(fit, after):
        return None
    deviation *= np.exp(size) if kind is SCALE else 1.0
    fault = replace(kind.make(group, size), deviation=float(deviation))
    return _named(fault), replace(after, change=None)


def _explains(fit: Fitted, after: Fitted) -> bool:
    """Whether most of a channel's error is gone, and little is left of the channel."""
    pairs = zip(fit.answer.equations, after.answer.equations, strict=True)
    shares = ((a.excess + FLOOR, b.excess + FLOOR) for a, b in pairs)
    ratio, left = min((b / a, b) for a, b in shares)
    return ratio < MAINLY and left < GROSS and fit.score - after.score > CLEAR
