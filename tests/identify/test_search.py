"""The evolution is repeatable, can be stopped, and what it had then is kept."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.identify.fit_starts import FAILED_COST, evolve
from flexgui.core.progress import Compared, Silent, StoppedError
from flexgui.core.results import Generation
from tests.identify.helpers import EI, LPV, PAIR, clean, estimate, fit

SHORT = {"population": 12, "generations": 15, "seed": 3}
WRONG = {"epsilon": 0.85e9, "d": 0.054}


class Impatient(Silent):
    """Stops after some generations, and remembers them."""

    def __init__(self, patience: int) -> None:
        self.patience = patience
        self.seen: list[Generation] = []
        self.steps = 0

    def generation(self, fit_label: str, generation: Generation) -> None:
        self.seen.append(generation)

    def advance(self, n: int = 1, text: str = "") -> None:
        self.steps += n

    def stopped(self) -> bool:
        return len(self.seen) >= self.patience


def searched(progress: Silent | None = None, **changes):  # type: ignore[no-untyped-def]
    return fit(LPV, clean()[:3], progress, start=WRONG, **{**PAIR, **SHORT, **changes})


def test_the_same_seed_gives_the_same_result_to_the_last_bit():
    first, second = searched(), searched()
    assert np.array_equal(first.vector, second.vector)
    assert [e.std for e in first.fit.derived] == [e.std for e in second.fit.derived]
    for a, b in zip(first.fit.convergence, second.fit.convergence, strict=True):
        assert (a.number, a.best, a.mean, a.worst) == (b.number, b.best, b.mean, b.worst)
        assert np.array_equal(a.population, b.population)


def test_the_best_never_gets_worse_and_lies_in_the_box():
    history = searched().fit.convergence
    assert [g.number for g in history] == list(range(1, SHORT["generations"] + 1))
    best = np.array([g.best for g in history])
    assert np.all(np.diff(best) <= 0.0)
    assert all(g.best <= g.mean <= g.worst for g in history)
    low, high = np.array([PAIR["bounds"][n] for n in ("epsilon", "d")]).T
    for g in history:
        assert g.population is not None
        assert g.population.shape == (SHORT["population"], 2)
        assert np.all((g.population >= low) & (g.population <= high))


class Told(Silent):
    """Compares at each lower cost."""

    def __init__(self) -> None:
        self.misses: list[float] = []

    def better(self, fit_label: str, cost: float, compared: Compared) -> None:
        shown = compared()
        self.misses.append(max(channel.normalised_error for channel in shown.channels))


def test_a_fit_is_told_beside_what_was_measured_while_it_runs():
    told = Told()
    assert searched(told).fit.converged
    assert len(told.misses) > SHORT["generations"] and told.misses[-1] < told.misses[0]
    assert searched(Impatient(4)).fit.converged is False


def test_stopping_ends_early_and_keeps_the_best_so_far():
    progress = Impatient(4)
    fitted = searched(progress)
    assert fitted.fit.stopped
    assert len(fitted.fit.convergence) == len(progress.seen) == 4
    assert np.array_equal(fitted.vector, progress.seen[-1].best_vector)
    assert fitted.fit.cost == pytest.approx(progress.seen[-1].best, rel=1e-9)
    assert fitted.fit.identifiability.rank == 1
    assert estimate(fitted, "EI").value == pytest.approx(EI, rel=0.2)


def test_stopping_before_anything_keeps_the_start():
    fitted = searched(Impatient(0), generations=0)
    assert fitted.fit.stopped
    assert fitted.vector == pytest.approx(list(WRONG.values()))


def test_each_generation_is_told_as_it_ends():
    progress = Impatient(10_000)
    fitted = searched(progress)
    assert tuple(progress.seen) == fitted.fit.convergence
    assert progress.steps == SHORT["generations"]
    assert not fitted.fit.stopped


def test_without_refinement_the_search_has_the_last_word():
    fitted = searched(refine=False)
    assert np.array_equal(fitted.vector, fitted.fit.convergence[-1].best_vector)
    assert fitted.fit.message == ""


def test_a_member_that_overflows_is_the_worst_and_no_trouble():
    def costs(x: np.ndarray) -> np.ndarray:
        return np.where(x[:, 0] > 0.5, np.nan, np.sum(x**2, axis=1))

    found = evolve(costs, np.full(2, -1.0), np.ones(2), 10, 20, 1, lambda g: False)
    assert found.cost < 0.1
    assert found.generations[0].worst <= FAILED_COST


def test_a_stop_within_a_generation_keeps_the_best_of_those_before() -> None:
    calls = []

    def costs(points: np.ndarray) -> np.ndarray:
        calls.append(len(points))
        if len(calls) > 3:
            raise StoppedError
        return np.sum((points - 0.3) ** 2, axis=1)

    lower, upper = np.zeros(2), np.ones(2)
    found = evolve(costs, lower, upper, 10, 100, 1, lambda _: len(calls) > 3)
    assert found.stopped and found.generations
    assert found.cost == pytest.approx(np.sum((found.vector - 0.3) ** 2))


def test_a_stop_before_any_cost_is_known_has_no_best() -> None:
    def costs(points: np.ndarray) -> np.ndarray:
        raise StoppedError

    with pytest.raises(StoppedError):
        evolve(costs, np.zeros(2), np.ones(2), 10, 100, 1, lambda _: True)
