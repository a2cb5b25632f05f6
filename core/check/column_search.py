"""Which columns of a recording are wrong: usual faults first, then gains, delays and clocks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..check.column_fault import MILLI, TIME, ColumnFault, columns, usual_faults
from ..check.comparison import Comparison
from ..check.fitted import GROSS, Fitted, fitted
from ..check.sized_faults import CLEAR, CLOSEST, FACTOR, SCALE, Step, refined, sized_fault
from ..recording.channels import DRIVES, Role, role_of

ROUNDS = 4
"""Faults hide one another: several are found one after the other."""
TIE = 0.1
"""Of the best fall of the score by which an equal one may be less."""
FACTORS = (0.5, 0.7, 1.4, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
"""Of an encoder that the model follows: where a gear or a scale is looked for."""


@dataclass(frozen=True)
class Search:
    """What is wrong with a recording's columns."""

    faults: tuple[ColumnFault, ...]
    """One after the other."""
    fit: Fitted
    """With them taken back."""

    def is_question(self, fault: ColumnFault) -> bool:
        """Whether an effect that the model lacks, or another mass, may explain as much: more is
        left than it explains, or it is the factor of a torque, or only torques show it, and not
        grossly, as they show a spring."""
        _, before, after = fault.explains or ("", 1.0, 0.0)
        fall, answer = before - after, self.fit.answer
        heavier = fault.fault == "scale" and all(role_of(n) in DRIVES for n in fault.channels)
        forces = all(role_of(e.channel) in DRIVES for e in answer.equations) and fall < GROSS
        return not fault.is_usual and (heavier or forces or answer.worst > fall)

    def repeated(self, of: Comparison) -> Search | None:
        """The same faults in another recording of the rig, where they leave no more of it."""
        if of.unknowns.labels != self.fit.of.unknowns.labels:
            return None
        recording, x = of.recording, self.fit.x
        for fault in self.faults:
            if not set(fault.channels) <= {TIME, *of.unknowns.labels, *recording.channels}:
                return None
            recording = fault.corrected(recording)
        as_it_is, answer = of.answers([(of.recording, x), (recording, x)])
        if answer.score > as_it_is.score or not answer.is_like(self.fit.answer):
            return None
        better = answer.improved(as_it_is)
        faults = tuple(replace(fault, explains=better) for fault in self.faults)
        return Search(faults, replace(self.fit, of=of, recording=recording, answer=answer))


def search(
    of: Comparison, earlier: Sequence[Search] = (), stopped: Callable[[], bool] = lambda: False,
    sized: bool = True,
) -> Search:  # fmt: skip
    """All faults that a recording's fit shows: those of a recording before, or else looked for;
    `sized`: also of any size."""
    # Of searches with faults of the same kinds the first: each costs simulations.
    distinct = {tuple((f.fault, f.channels) for f in s.faults): s for s in reversed(earlier)}
    for known in reversed(distinct.values()):
        if again := known.repeated(of):
            return again
    fits = [fitted(of)]
    steps = [(fault, fits[0]) for fault in stated_stiffness(fits[0])]
    while len(fits) <= ROUNDS:
        step = _next_step(fits[-1], stopped, sized)
        if step is None or stopped():
            break
        explains = step[1].answer.improved(fits[-1].answer)
        steps.append((replace(step[0], explains=explains), step[1]))
        fits.append(step[1])
    # A model that leaves most of a channel cannot tell the size of a fault in another one.
    while len(fits) > 1 and fits[-1].answer.worst > GROSS and not steps[-1][0].is_usual:
        steps.pop()
        fits.pop()
    return Search(_joined([fault for fault, _ in steps]), fits[-1])


def _joined(faults: Sequence[ColumnFault]) -> tuple[ColumnFault, ...]:
    """With one of each kind and size in the same channels: a lag of some periods may be found in
    two parts, with other stiffnesses beside each."""
    found: dict[tuple[object, ...], ColumnFault] = {}
    for number, fault in enumerate(faults):
        alone = number if fault.is_usual else None  # two swaps are not one
        key = fault.fault, fault.channels, fault.since, alone
        found[key] = found[key].with_more(fault) if key in found else fault
    return tuple(found.values())


def _next_step(fit: Fitted, stopped: Callable[[], bool], sized: bool) -> Step | None:
    usual = usual_fault(fit) if fit.answer.worst > GROSS else None
    first = usual is not None and usual[0].is_usual
    steps = [] if usual is None else [usual]
    complete = first and steps[0][1].answer.worst < GROSS
    if sized and not complete and not fit.answer.is_noise and not stopped():
        other = sized_fault(fit)
        # Before a usual fault that leaves a gross contradiction comes what leaves none.
        if other is not None and (not first or other[1].answer.worst < GROSS):
            steps.append(other)
    best = min(steps, key=lambda step: step[1].score, default=None)
    if best is None or best[1].answer.worst < GROSS:
        return best
    again = fitted(fit.of, best[1].recording)  # from other stiffnesses
    return best[0], min(best[1], again, key=lambda f: f.score)


def stated_stiffness(fit: Fitted) -> list[ColumnFault]:
    """The unit of the stiffness, where another one explains the recording."""
    if fit.answer.worst > GROSS:
        return []
    names = fit.of.unknowns.labels[: fit.of.stiffnesses]
    factors = fit.of.start[: fit.of.stiffnesses] / fit.centre[: fit.of.stiffnesses]
    unit = next((u for u in (MILLI, 1.0 / MILLI) if np.allclose(factors, u)), None)
    if unit is None:
        return []
    (answer,) = fit.of.answers([(fit.recording, fit.of.start)])
    stated = Fitted(fit.of, fit.recording, fit.of.start, fit.of.start, answer).descended()
    needed = stated.score > fit.score + CLEAR
    return [ColumnFault("stated_stiffness", names, unit)] if needed else []


def usual_fault(fit: Fitted) -> Step | None:
    """The usual fault, or the factor, whose correction explains most."""
    candidates = [*usual_faults(fit.recording, fit.of.model), *_factors(fit)]
    recordings = [c.corrected(fit.recording) for c in candidates]
    asked = [(r, x) for r in recordings for x in (fit.x, fit.of.start)]
    answers = fit.of.answers(asked)
    pairs = [answers[2 * k : 2 * k + 2] for k in range(len(recordings))]
    scores = [min(a.score for a in pair) for pair in pairs]
    steps: list[Step] = []
    closest: dict[tuple[str, tuple[str, ...]], int] = {}
    for k in np.argsort(scores):  # of several factors of a channel the best
        closest.setdefault((candidates[k].fault, candidates[k].channels), int(k))
    for k in list(closest.values())[:CLOSEST]:
        near, stated = pairs[k]
        if near.score < stated.score:  # the nuisance is known from the other channels
            after = replace(fit, recording=recordings[k], answer=near, kept=None).descended()
        else:
            after = fitted(fit.of, recordings[k])
        step: Step | None = (candidates[k], after)
        if not candidates[k].is_usual:
            size = float(np.log(candidates[k].factor))
            step = refined(fit, SCALE, candidates[k].channels, size, after)
        if step is not None and fit.score - step[1].score > CLEAR and _is_gross(fit, step[1]):
            steps.append(step)
    return _most_usual(fit, steps) if steps else None


def _is_gross(before: Fitted, after: Fitted) -> bool:
    _, unexplained, left = after.answer.improved(before.answer)
    return unexplained - left > GROSS


def _most_usual(fit: Fitted, steps: list[Step]) -> Step:
    """Of equal corrections the usual one, with the others that would do."""
    # A free factor explains as much as a usual one, and a little more.
    falls = [fit.score - s[1].score - CLEAR * (not s[0].is_usual) for s in steps]
    good = [s for fall, s in zip(falls, steps, strict=True) if fall >= (1.0 - TIE) * max(falls)]
    fault, after = min(good, key=lambda s: (not s[0].is_usual, len(s[0].channels), s[1].score))
    alike = (s[0].channels for s in good if s[0].fault == fault.fault)
    others = dict.fromkeys(n for group in alike for n in group if n not in fault.channels)
    return replace(fault, alternatives=tuple(others)), after


def _factors(fit: Fitted) -> Iterator[ColumnFault]:
    """Factors of single channels that the gains of the channels suggest, and those of gears; none
    of a channel whose gain nobody knows."""
    gains = [(e.channel, e.gain) for e in fit.answer.equations]
    for name in columns(fit.recording):
        if name in fit.recording.unknown_gains:
            continue
        sizes = {g for n, g in gains if n == name} | {1.0 / g for _, g in gains if g}
        if role_of(name) is Role.PLACE:
            sizes |= set(FACTORS)
        for size in sizes:
            if size > 0.0 and abs(np.log(size)) > FACTOR:
                yield SCALE.make((name,), float(np.log(size)))
