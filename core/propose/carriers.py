"""Which variable carries an error: what a smooth function of it explains on parts held out.

A smooth function is a sum of hats whose second differences cost something (P-splines, Eilers and
Marx 1996).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..estimate.fitted_model import FittedModel
from ..estimate.minimum import RELEVANT
from ..identify.uncertainty import autocovariance, score_covariance
from ..least_squares import as_finite, pseudo_inverse
from ..propose.targets import Target
from ..propose.variables import Factor, Series, Variable, ends

PARTS = 4
"""Of each recording, held out in turn; each consists of as many pieces."""

SMOOTH = 1e-3
"""Of a hat's mean square: what a second difference of the values costs. Where few samples are, a
function goes on straight."""

RIDGE = 1e-4
"""Of a column's whole size: what its coefficient costs. A part that is held out may be all that
shows a column."""

TINY = 1e-9
"""The same of the nuisance, of its own size."""


@dataclass(frozen=True)
class PartMatrices:
    """Inner products of nuisance, columns and error, by part of the recordings."""

    parts: np.ndarray
    """(PARTS, n, n); the error is last."""
    prior: np.ndarray
    """(n, n): what is known a priori of the nuisance"""
    nuisance: int
    count: int
    """Number of samples."""
    hats: bool = True
    """Whether the columns are those of hats beside each other."""
    beside: int = 0
    """How many of the nuisance, the last, are hats of another function."""

    def combined(self, weights: np.ndarray) -> PartMatrices:
        """The same of combinations of the columns by `weights` (columns, m)."""
        P, (K, m) = self.nuisance, weights.shape
        W = np.zeros((P + K + 1, P + m + 1))
        W[:P, :P], W[P : P + K, P : P + m], W[-1, -1] = np.eye(P), weights, 1.0
        parts = np.einsum("ia,bij,jc->bac", W, self.parts, W, optimize=True)
        return PartMatrices(parts, W.T @ self.prior @ W, P, self.count, False, self.beside)

    @cached_property
    def total(self) -> np.ndarray:
        """(n, n), all parts and what is known a priori."""
        return np.asarray(self.parts.sum(axis=0) + self.prior)

    @cached_property
    def _costs(self) -> np.ndarray:
        """(n - 1, n - 1): what coefficients cost by themselves."""
        P, size = self.nuisance, np.diag(self.total)[:-1]
        own = P - self.beside
        costs = np.diag(np.where(np.arange(len(size)) < own, TINY, RIDGE) * size)
        for hats in (slice(own, P), slice(P, len(size) if self.hats else P)):
            bend = np.diff(np.eye(len(size[hats])), 2, axis=0)
            if len(bend):
                costs[hats, hats] += SMOOTH * float(np.mean(size[hats])) * bend.T @ bend
        return costs

    @cached_property
    def held_out_share(self) -> float:
        """Share of the squared error above noise that the columns explain on the parts that they
        were not fitted to."""
        n, own = len(self.total) - 1, self.nuisance - self.beside
        without, both = (
            sum(self._left(part, fitted) for part in self.parts)
            for fitted in (np.arange(own, self.nuisance), np.arange(own, n))
        )
        above = max(without - self.count, RELEVANT * self.count)
        return float((without - both) / above)

    def _left(self, part: np.ndarray, columns: np.ndarray) -> float:
        """Squared error on one part, with columns that were fitted to the others. The nuisance is
        fitted to all parts: a start shows in one of them alone."""
        own = np.arange(self.nuisance - self.beside)
        both = np.concatenate([own, columns])
        x = self._inverse(self.total - part, both) @ (self.total - part)[both, -1]
        size = x[len(own) :]
        left = self.total[own, -1] - self.total[np.ix_(own, columns)] @ size
        x = np.concatenate([self._inverse(self.total, own) @ left, size])
        b = part[both, -1]
        return float(part[-1, -1] - 2.0 * x @ b + x @ part[np.ix_(both, both)] @ x)

    def _inverse(self, C: np.ndarray, which: np.ndarray) -> np.ndarray:
        """Inverse of the normal equations of some coefficients."""
        at = np.ix_(which, which)
        return pseudo_inverse(C[at] + self._costs[at])

    def fitted(self, scores: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """(m,) coefficients of the columns fitted to everything, and their standard deviations,
        infinite where nothing shows one, for the error that is left: as if it were white, or for
        the covariance (n - 1, n - 1) of its `scores`."""
        C, P = self.total, self.nuisance
        inverse = self._inverse(C, np.arange(len(C) - 1))
        x = inverse @ C[:-1, -1]
        left = C[-1, -1] - 2.0 * x @ C[:-1, -1] + x @ C[:-1, :-1] @ x
        covariance, level = inverse, max(left / self.count, 1.0)
        if scores is not None:
            known = self.prior[:-1, :-1] + self._costs
            covariance = inverse @ (scores / level + known) @ inverse
        variances = np.where(np.diag(C)[:-1] > 0.0, np.diag(covariance), np.inf)
        return x[P:], np.sqrt(np.maximum(variances, 0.0) * level)[P:]

    def reduction(self) -> tuple[np.ndarray, np.ndarray]:
        """(K, K) and (K,): inner products of the columns with each other and with the error, with
        the nuisance projected out."""
        C, own = self.total, np.arange(self.nuisance)
        across = C[own, self.nuisance :]
        projected = C[self.nuisance :, self.nuisance :] - across.T @ self._inverse(C, own) @ across
        return projected[:-1, :-1], projected[:-1, -1]


@dataclass(frozen=True)
class SmoothFunction:
    """A function of one variable at a target, as a sum of hats, and how the outputs answer."""

    target: Target
    variable: Variable
    factor: Factor
    knots: np.ndarray
    matrices: PartMatrices
    beside: SmoothFunction | None = None
    """The function that the error is explained by besides."""

    @property
    def share(self) -> float:
        """Share of the error above noise that it explains on parts held out; beside another
        function, of what that one leaves."""
        return self.matrices.held_out_share

    @property
    def states(self) -> set[str]:
        """What of it has a state; two are one where they are alike."""
        free = self.variable.constants
        of_variable = {f"{self.variable.word} {free}"} if free else set()
        return of_variable | ({self.factor.state} if self.factor.state else set())

    @property
    def left(self) -> float:
        """Share of the error above noise that it leaves there, with the function beside it."""
        return (1.0 - self.share) * (1.0 if self.beside is None else self.beside.left)


def smooth_functions(
    model: FittedModel, target: Target, choices: Sequence[tuple[Variable, Factor]],
    knots: int | None = None, stopped: Callable[[], bool] = lambda: False,
    beside: SmoothFunction | None = None,
) -> list[SmoothFunction]:  # fmt: skip
    """The functions of the chosen variables at a target, `beside` one that is there already; fewer
    if stopped."""
    at = ErrorParts.of(model)
    if beside is not None:
        signals = hats(beside.variable, beside.factor, beside.knots)
        at = at.beside_columns(beside.target.responses(model, signals))
    functions = []
    for variable, factor in choices:
        if stopped():
            break
        places = np.linspace(*ends(variable), knots or variable.knots)
        signals = hats(variable, factor, places)
        columns = target.responses(model, signals)
        matrices = at.matrices(columns)
        functions.append(SmoothFunction(target, variable, factor, places, matrices, beside))
    return functions


def missed_by_law(
    model: FittedModel, f: SmoothFunction, held: Collection[str]
) -> tuple[np.ndarray, np.ndarray]:
    """(K,) what a model with a law misses of the law at the knots of its function, and standard
    deviations under coloured noise. All unknowns but those `held`, the law's own, are free: the law
    and what it misses are the function that these recordings show. It is not smoothed, which would
    lead it along the law where they show nothing."""
    columns = f.target.responses(model, hats(f.variable, f.factor, f.knots))
    pairs = zip(_directions(model, _free(model, held)), _blocks(columns), strict=True)
    scores = [
        score_covariance(np.concatenate([S, G], axis=-1), autocovariance((r, e.counted)))
        for (S, G), r, e in zip(pairs, model.refit.errors, model.data.experiments, strict=True)
    ]
    matrices = ErrorParts.of(model, held).matrices(columns)
    return matrices.combined(np.eye(len(columns))).fitted(np.sum(scores, axis=0))


def _free(model: FittedModel, held: Collection[str]) -> list[int]:
    """The unknowns of a model but those `held`."""
    labels = model.refit.problem.unknowns.labels
    return [j for j, label in enumerate(labels) if label not in held]


def _directions(model: FittedModel, free: Sequence[int]) -> list[np.ndarray]:
    """(M, k, P) per recording: directions of the outputs by the unknowns that are `free`."""
    return [-as_finite(S[:, :, free]) for S in model.refit.descended.slopes]


def hats(variable: Variable, factor: Factor, places: np.ndarray) -> list[Series]:
    """Per place of `places` (K,), which are even, the signal (N,) of each recording: the hat there,
    times the factor."""
    distance = places[1] - places[0]
    return [
        tuple(
            np.clip(1.0 - np.abs(x - place) / distance, 0.0, None) * f
            for x, f in zip(variable.along, factor.along, strict=True)
        )
        for place in places
    ]


@dataclass(frozen=True)
class ErrorParts:
    """Errors and slopes of a model, cut into parts."""

    nuisance: tuple[np.ndarray, ...]
    """(n, P + 1) per part: directions of the outputs by the nuisance, and the error"""
    prior: np.ndarray
    """(P + 1, P + 1)"""
    parts: tuple[np.ndarray, ...]
    """(M,) per recording: the part of each sample"""
    count: int
    beside: int = 0
    """How many of the nuisance, the last, are hats of a function."""

    @classmethod
    def of(cls, model: FittedModel, held: Collection[str] = ()) -> ErrorParts:
        """Of a model at its minimum, whose unknowns `held` are none of the nuisance."""
        problem, free = model.refit.problem, _free(model, held)
        blocks = [
            np.concatenate([S, r[..., None]], axis=-1)
            for S, r in zip(_directions(model, free), model.refit.errors, strict=True)
        ]
        errors, sizes = (x[free] for x in problem.limits.prior_measurements(problem.vector))
        known = np.column_stack([np.diag(-sizes), errors])
        parts = parts_of(model.refit.errors)
        return cls(cut(blocks, parts), known.T @ known, parts, model.data.count)

    def beside_columns(self, columns: Sequence[Series]) -> ErrorParts:
        """The same with columns (M, k) per recording among the nuisance."""
        P, K = self.nuisance[0].shape[1] - 1, len(columns)
        nuisance = tuple(
            np.concatenate([own[:, :P], added, own[:, P:]], axis=1)
            for own, added in zip(self.nuisance, cut(_blocks(columns), self.parts), strict=True)
        )
        prior, which = np.zeros((P + K + 1, P + K + 1)), [*range(P), P + K]
        prior[np.ix_(which, which)] = self.prior
        return ErrorParts(nuisance, prior, self.parts, self.count, K)

    def matrices(self, columns: Sequence[Series]) -> PartMatrices:
        """With the columns (M, k) per recording."""
        blocks = _blocks(columns)
        parts, P, K = [], self.nuisance[0].shape[1] - 1, len(columns)
        order = [*range(P), *range(P + 1, P + K + 1), P]  # the error is last
        for own, added in zip(self.nuisance, cut(blocks, self.parts), strict=True):
            across = own.T @ added
            C = np.block([[own.T @ own, across], [across.T, added.T @ added]])
            parts.append(C[np.ix_(order, order)])
        prior = np.zeros((P + K + 1, P + K + 1))
        which = [*range(P), P + K]
        prior[np.ix_(which, which)] = self.prior
        return PartMatrices(np.array(parts), prior, P, self.count, beside=self.beside)


def _blocks(columns: Sequence[Series]) -> list[np.ndarray]:
    """(M, k, columns) per recording."""
    everything = range(len(columns[0]))
    return [as_finite(np.stack([c[i] for c in columns], axis=-1)) for i in everything]


def parts_of(errors: Sequence[np.ndarray]) -> tuple[np.ndarray, ...]:
    """(M,) per recording: the part of each sample, of errors (M, k) per recording.

    A recording falls into pieces of the same squared error, since a motion that dies away shows its
    speeds at the beginning alone. They stand in a Latin square: each part has one of every four
    pieces, and each place of a motion that repeats itself after four.
    """
    parts = []
    for e in errors:
        passed = np.cumsum(np.sum(e**2, axis=-1)) / max(float(np.sum(e**2)), 1e-300)
        piece = np.minimum((PARTS * PARTS * passed).astype(int), PARTS * PARTS - 1)
        parts.append((piece + piece // PARTS) % PARTS)
    return tuple(parts)


def cut(blocks: Sequence[np.ndarray], parts: Sequence[np.ndarray]) -> tuple[np.ndarray, ...]:
    """(n, m) per part, of blocks (M, k, m) and the part (M,) of each sample, per recording."""
    return tuple(
        np.concatenate([
            block[part == b].reshape(-1, block.shape[-1])
            for block, part in zip(blocks, parts, strict=True)
        ])
        for b in range(PARTS)
    )  # fmt: skip
