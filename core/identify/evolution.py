"""Global search by differential evolution, (13) over a whole population at a time.

SciPy's implementation is used: with `vectorized=True` its own work is a small part of a
generation, so that a home-made one would gain nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from core.progress import StoppedError
from core.results import Generation

DIFFERENTIAL_WEIGHT = 0.8
CROSSOVER = 0.9
"""F and CR of design section 2."""

FAILED = 1e300
"""Cost of a vector whose simulation overflowed; finite, so that it can be ranked."""

OnGeneration = Callable[[Generation], bool]
"""Called after each generation; True stops the search."""


@dataclass(frozen=True)
class Searched:
    """Where the search ended and how it got there."""

    vector: np.ndarray
    cost: float
    generations: tuple[Generation, ...]
    stopped: bool


def first_population(
    lower: np.ndarray, upper: np.ndarray, members: int, rng: np.random.Generator
) -> np.ndarray:
    """(members, P), uniform in the bounds."""
    return np.asarray(lower + (upper - lower) * rng.random((members, len(lower))))


def evolve(
    costs: Callable[[np.ndarray], np.ndarray],
    lower: np.ndarray,
    upper: np.ndarray,
    members: int,
    generations: int,
    seed: int,
    on_generation: OnGeneration,
) -> Searched:
    """rand/1/bin over `generations`; costs takes (S, P) and gives (S,).

    Where somebody stops in the middle of a generation, the best of those before is kept;
    StoppedError where there is none.
    """
    rng = np.random.default_rng(seed)
    history: list[Generation] = []
    stopped = False

    def evaluate(x: np.ndarray) -> np.ndarray:
        try:
            values = costs(np.atleast_2d(x.T))
        except StoppedError:
            return np.full(x.size // len(lower), FAILED)
        return np.where(np.isfinite(values), values, FAILED)

    def report(intermediate_result: scipy.optimize.OptimizeResult) -> bool:
        nonlocal stopped
        generation = _generation(len(history) + 1, intermediate_result)
        history.append(generation)
        stopped = on_generation(generation)
        return stopped

    result = scipy.optimize.differential_evolution(
        evaluate,
        list(zip(lower, upper, strict=True)),
        strategy="rand1bin",
        maxiter=generations,
        init=first_population(lower, upper, members, rng),
        mutation=DIFFERENTIAL_WEIGHT,
        recombination=CROSSOVER,
        tol=0.0,
        atol=0.0,
        polish=False,
        updating="deferred",
        vectorized=True,
        callback=report,
        rng=rng,
    )
    if result.fun >= FAILED and stopped:
        raise StoppedError
    return Searched(np.asarray(result.x), float(result.fun), tuple(history), stopped)


def _generation(number: int, result: scipy.optimize.OptimizeResult) -> Generation:
    energies = np.asarray(result.population_energies)
    return Generation(
        number=number,
        best=float(energies.min()),
        mean=float(energies.mean()),
        worst=float(energies.max()),
        best_vector=np.array(result.x),
        population=np.array(result.population),
    )
