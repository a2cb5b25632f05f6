"""What a smooth function explains is what it predicts on parts of recordings it has not seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from flexgui.core.propose.carriers import PARTS, SmoothFunction, cut, hats, parts_of
from tests.propose.made_up import HIGH, LOW, NUISANCE, MadeUp, answer, place, torque

SEEDS = range(3)

LEVEL = 0.03
"""Relative, of the size of a noise that 3,600 samples show: 1.2 %, twice and a half as much."""

SAME_SHARE = 2e-3
"""Of the error: hats cost a thousandth of their size, plain least squares nothing."""


def nothing(x: np.ndarray) -> np.ndarray:
    return 0.0 * x


def bent(x: np.ndarray) -> np.ndarray:
    return 12.0 * np.sin(3.0 * x) + 4.0 * x**2


def plain_blocks(made: MadeUp, knots: int) -> list[np.ndarray]:
    """(n, P + K + 1) of each quarter: nuisance, hats, error, put together with other means."""
    factor = torque(made.places)
    errors, nuisance = made.errors(factor.along)
    signals = hats(place(made.places), factor, np.linspace(LOW, HIGH, knots))
    quarters: list[list[np.ndarray]] = [[] for _ in range(PARTS)]
    parts = parts_of(errors)
    for r, (error, own) in enumerate(zip(errors, nuisance, strict=True)):
        columns = np.stack([answer(signal[r]) for signal in signals], axis=-1)
        whole = np.concatenate([own, columns, error[..., None]], axis=-1)
        for k in range(PARTS):
            quarters[k].append(whole[parts[r] == k].reshape(-1, whole.shape[-1]))
    return [np.concatenate(parts) for parts in quarters]


def left_unseen(quarters: Sequence[np.ndarray], columns: int) -> float:
    """Squared error of every quarter with hats as fitted to the other three beside the nuisance,
    and the nuisance then as fitted to all four."""
    total, everything = 0.0, np.concatenate(quarters)
    for k, held in enumerate(quarters):
        seen = np.concatenate([q for i, q in enumerate(quarters) if i != k])
        x = np.linalg.lstsq(seen[:, :columns], seen[:, -1], rcond=None)[0]
        left = everything[:, -1] - everything[:, NUISANCE:columns] @ x[NUISANCE:]
        x[:NUISANCE] = np.linalg.lstsq(everything[:, :NUISANCE], left, rcond=None)[0]
        total += float(np.sum((held[:, -1] - held[:, :columns] @ x) ** 2))
    return total


@pytest.mark.parametrize("seed", SEEDS)
def test_the_share_is_that_of_hats_fitted_to_the_other_quarters(seed: int) -> None:
    made = MadeUp(bent, seed=seed)
    quarters = plain_blocks(made, 9)
    count = sum(len(q) for q in quarters)
    without, both = (left_unseen(quarters, n) for n in (NUISANCE, NUISANCE + 9))
    assert made.function(9).share == pytest.approx(
        (without - both) / (without - count), abs=SAME_SHARE
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_a_start_that_one_quarter_alone_shows_hides_no_law(seed: int) -> None:
    starts, plain = (MadeUp(bent, seed=seed, begins=b).function().share for b in (True, False))
    assert starts == pytest.approx(plain, abs=0.02)


@pytest.mark.parametrize("knots", [7, 25, 61])
@pytest.mark.parametrize("seed", SEEDS)
def test_what_the_place_has_no_part_in_has_no_share(seed: int, knots: int) -> None:
    """An error of twice the noise that no place carries: half a hundredth is chance."""
    assert MadeUp(nothing, noise=2.0, seed=seed).function(knots).share < 0.005


@pytest.mark.parametrize("seed", SEEDS)
def test_a_function_that_fits_by_chance_explains_nothing_unseen(seed: int) -> None:
    """Nearly as many hats as errors."""
    made, knots = MadeUp(nothing, noise=10.0, seed=seed, samples=40, recordings=1), 61
    seen = np.concatenate(plain_blocks(made, knots))
    x = np.linalg.lstsq(seen[:, :-1], seen[:, -1], rcond=None)[0]
    left = np.sum((seen[:, -1] - seen[:, :-1] @ x) ** 2)
    assert left < 0.7 * np.sum(seen[:, -1] ** 2), "it fits well what it was fitted to"
    assert made.function(knots).share < 0.0


@pytest.mark.parametrize("seed", SEEDS)
def test_the_function_comes_out_as_it_was_put_in(seed: int) -> None:
    found = MadeUp(bent, seed=seed).function()
    values, deviations = found.matrices.fitted()
    inside = slice(1, -1)  # at the ends half a hat is seen
    miss = (values - bent(found.knots))[inside]
    assert np.sqrt(np.mean(miss**2)) < 0.05 * np.ptp(bent(found.knots))
    assert np.all(deviations > 0.0)
    assert np.mean(np.abs(miss) < 3.0 * deviations[inside]) > 0.9


def test_a_stronger_law_over_the_same_noise_has_a_larger_share() -> None:
    shares = [MadeUp(lambda x, k=k: k * bent(x)).function().share for k in (0.05, 0.2, 1.0)]
    assert shares[0] < shares[1] < shares[2] < 1.0


def test_hats_add_up_to_one_within_their_ends() -> None:
    made = MadeUp(nothing)
    signals = hats(place(made.places), torque(made.places), np.linspace(LOW, HIGH, 7))
    for r, x in enumerate(made.places):
        assert np.sum([s[r] for s in signals], axis=0) == pytest.approx(1.0, abs=1e-12)
        line = [k * s[r] for k, s in zip(np.linspace(LOW, HIGH, 7), signals, strict=True)]
        assert np.sum(line, axis=0) == pytest.approx(x, abs=1e-12), "the place itself"


def parts_in_turn(error: np.ndarray) -> list[list[int]]:
    """The parts of the pieces of a recording whose error (N,) is given, four in a row."""
    (parts,) = parts_of([error[:, None]])
    starts = np.flatnonzero(np.diff(parts, prepend=-1))
    return parts[starts].reshape(PARTS, PARTS).tolist()


@pytest.mark.parametrize("decay", [0.0, 5.0])
def test_each_part_has_the_same_error_of_every_recording(decay: float) -> None:
    errors = [np.exp(-decay * np.linspace(0.0, 1.0, n))[:, None] for n in (1600, 4000)]
    for e, parts in zip(errors, parts_of(errors), strict=True):
        shares = [float(np.sum(e[parts == b] ** 2) / np.sum(e**2)) for b in range(PARTS)]
        assert shares == pytest.approx([0.25] * PARTS, abs=0.02)


def test_pieces_stand_in_a_latin_square() -> None:
    rows = parts_in_turn(np.ones(1600))
    everything = set(range(PARTS))
    assert all(set(row) == everything for row in [*rows, *zip(*rows, strict=True)])
    (parts,) = parts_of([np.zeros((50, 2))])
    assert parts.shape == (50,) and set(parts) <= everything, "without any error too"


def test_a_part_holds_its_samples_of_all_recordings() -> None:
    blocks = [np.full((n, 2, 3), float(r)) for r, n in enumerate((8, 40))]
    parts = [np.arange(n) % PARTS for n in (8, 40)]
    for part in cut(blocks, parts):
        assert part.shape == (2 * 2 + 10 * 2, 3)
        assert [np.sum(part[:, 0] == r) for r in (0.0, 1.0)] == [4, 20]


def combined(function: SmoothFunction, weights: np.ndarray) -> float:
    return function.matrices.combined(weights).held_out_share


def test_all_hats_in_one_sum_are_one_constant() -> None:
    """A constant torque explains as much as the sum of the hats does."""
    made = MadeUp(lambda x: 6.0 + nothing(x))
    one, fine = made.function(3), made.function(25)
    shares = [combined(f, np.ones((len(f.knots), 1))) for f in (one, fine)]
    assert shares[0] == pytest.approx(shares[1], rel=1e-9)
    assert shares[0] > 0.99


def test_deviations_follow_the_errors_that_are_there() -> None:
    """Those for the scores of white errors are the usual ones; four times the variance makes them
    at most twice as large, as what holds a hat beside the errors stays."""
    matrices = MadeUp(bent).function(9).matrices
    scores = matrices.parts.sum(axis=0)[:-1, :-1]
    usual, white, loud = (matrices.fitted(s)[1] for s in (None, scores, 4.0 * scores))
    assert white == pytest.approx(usual, rel=LEVEL)
    assert np.all((loud > 1.5 * usual) & (loud <= 2.0 * usual))


def test_what_nothing_shows_has_no_deviation() -> None:
    matrices = MadeUp(bent).function(9).matrices
    weights = np.eye(9)
    weights[4, 4] = 0.0
    deviations = matrices.combined(weights).fitted()[1]
    assert np.flatnonzero(np.isinf(deviations)).tolist() == [4]
