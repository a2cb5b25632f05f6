"""The nuisance of a comparison, fitted: stiffness (or mass), damping and friction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..check.comparison import Comparison
from ..check.equations import Answer
from ..least_squares import pseudo_inverse
from ..recording.recording import Recording

STIFFNESS = (0.25, 0.35, 0.5, 0.7, 1.4, 2.0, 2.8, 4.0, 1e-3, 1e3)
"""Times the stated one, where a fit begins: a drawing is a factor of four off, a unit of a
thousand."""
TRIAL = 0.02
"""Of the spread of an unknown: the step of a difference."""
GROSS = 0.2
"""Of a channel's variance: what is left at least where a unit, a sign or a stiffness is wrong."""
ITERATIONS = 8
"""Of a fit: it need not converge to tell a wrong column."""
GAINED = 0.05
"""By which the score falls in an iteration that is worth another one."""
KEPT = 0.5
"""Of the fall of the score that slopes predicted one step before: with more they are renewed."""
CORRELATED = 10.0
"""Neighbouring errors are alike: one in so many is independent."""


@dataclass(frozen=True)
class Fitted:
    """A comparison at a vector, with a recording as it is or corrected."""

    of: Comparison
    recording: Recording
    x: np.ndarray
    """(P,)"""
    centre: np.ndarray
    """(P,) that is likely a priori."""
    answer: Answer
    kept: np.ndarray | None = None
    """(M k, P) slopes of a vector nearby."""
    change: np.ndarray | None = None
    """(M k,) of the errors, if a fault changes by its trial."""

    @cached_property
    def slopes(self) -> np.ndarray:
        """(M k, P) of the errors per `spread`."""
        if self.kept is not None:
            return self.kept
        sides = self.x + TRIAL * np.diag(self.spread)
        answers = self.of.answers([(self.recording, x) for x in sides])
        with np.errstate(invalid="ignore"):
            moved = [(a.errors - self.answer.errors) / TRIAL for a in answers]
        return np.stack(moved, axis=1)

    @property
    def spread(self) -> np.ndarray:
        """(P,)"""
        return self.of.spread_at(self.centre)

    @property
    def score(self) -> float:
        """Its answer's, a sum of logarithms of shares."""
        return self.answer.score

    @cached_property
    def solved(self) -> tuple[np.ndarray, float, float]:
        """(P,) by which the vector moves, and the size of the change and its deviation in trials,
        as explain most."""
        P, A = len(self.x), self._columns
        if not (np.isfinite(A).all() and np.isfinite(self.answer.errors).all()):
            return np.zeros(P), 0.0, np.inf
        scale = np.linalg.norm(A, axis=0)
        scale = np.where(scale > 0.0, scale, 1.0)
        A = A / scale * self.answer.weights[:, None]
        normal = A.T @ A / CORRELATED
        normal[range(P), range(P)] += scale[:P] ** -2.0
        b = A.T @ (self.answer.weights * self.answer.errors) / CORRELATED
        b[:P] += (self.x - self.centre) / self.spread / scale[:P]
        inverse = pseudo_inverse(normal)
        found = -(inverse @ b) / scale
        deviation = float(np.sqrt(abs(inverse[-1, -1])) / scale[-1])
        size = 0.0 if self.change is None else float(found[-1])
        return self.spread * found[:P], size, deviation

    @property
    def _columns(self) -> np.ndarray:
        """(M k, P) or (M k, P + 1)"""
        return self.slopes if self.change is None else np.column_stack([self.slopes, self.change])

    @property
    def left(self) -> float:
        """The score that the linear answer predicts, likewise a sum of logarithms."""
        step, size, _ = self.solved
        moved = step / self.spread if self.change is None else np.append(step / self.spread, size)
        errors = self.answer.errors + self._columns @ moved
        at = np.cumsum([len(e.error) for e in self.answer.equations])[:-1]
        pairs = zip(np.split(errors, at), self.answer.equations, strict=True)
        return float(sum(np.log(e.share_of(part)) for part, e in pairs))

    def moved(self) -> np.ndarray:
        """(P,) after the linear step."""
        return np.maximum(self.x + self.solved[0], self.of.lowest)

    def at(self, x: np.ndarray) -> Fitted:
        """The same at another vector x (P,), with these slopes."""
        (answer,) = self.of.answers([(self.recording, x)])
        return replace(self, x=x, answer=answer, kept=self.slopes)

    def descended(self) -> Fitted:
        """The same after some iterations, with slopes that are kept while they predict well."""
        fit, predicted = self, np.inf
        for _ in range(ITERATIONS):
            last, predicted = predicted, fit.score - fit.left
            if fit.kept is not None and predicted > KEPT * last:
                fit = replace(fit, kept=None)
                predicted = fit.score - fit.left
            if predicted < GAINED:
                break
            after = fit.at(fit.moved())
            if after.score < fit.score:
                fit = after
            elif fit.kept is None:
                break
            else:
                predicted = 0.0  # the slopes are renewed
        return fit


def fitted(of: Comparison, recording: Recording | None = None) -> Fitted:
    """The nuisance fitted to the recording, or to a corrected one: from the stated stiffness, or
    from others where that explains too little; as it stands where only noise is left."""
    recording = of.recording if recording is None else recording
    (answer,) = of.answers([(recording, of.known)])
    if answer.is_noise:
        return Fitted(of, recording, of.known, of.known, answer)
    x, answer = _begin(of, recording)
    centre = np.where(of.start == 0.0, of.start, x)
    return Fitted(of, recording, x, centre, answer).descended()


def _begin(of: Comparison, recording: Recording) -> tuple[np.ndarray, Answer]:
    """The stated vector (P,), without friction or with what is usual of it; or the best of other
    stiffnesses: all alike, then one by one."""
    P = len(of.start)
    inner = np.arange(P) < P - of.states
    rubbing = np.where(inner & (of.start == 0.0), of.spread, of.start)
    begin, answer = _best(of, recording, [of.start, rubbing])
    each = [[k] for k in range(of.stiffnesses)] if of.stiffnesses > 1 else []
    for which in (list(range(of.stiffnesses)), *each):
        if answer.worst < GROSS:
            break
        tried = [np.where(np.isin(range(P), which), f * begin, begin) for f in STIFFNESS]
        other, moved = _best(of, recording, tried)
        begin, answer = min((begin, answer), (other, moved), key=lambda pair: pair[1].score)
    return begin, answer


def _best(
    of: Comparison, recording: Recording, tried: Sequence[np.ndarray]
) -> tuple[np.ndarray, Answer]:
    answers = of.answers([(recording, x) for x in tried])
    best = int(np.argmin([a.score for a in answers]))
    return tried[best], answers[best]


def with_change(fit: Fitted, answers: Sequence[Answer], recording: Recording) -> Fitted:
    """A fit's nuisance beside a recording whose answer is the first, and with the fault changed by
    its trial the second."""
    at, moved = answers
    with np.errstate(invalid="ignore"):
        change = moved.errors - at.errors
    return replace(fit, recording=recording, answer=at, kept=fit.slopes, change=change)
