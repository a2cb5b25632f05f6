"""Every motion is simulated once, whoever asks for it."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.identify.predictor import Moving, Predictor, simulate_together
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.identify.residuals import Residuals
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.trajectory import Trajectory
from tests.helpers import PAPER, looped
from tests.identify.helpers import POINTS, residuals_of, simulated

PLAIN = looped(PAPER, level="nonlinear")
STEPS = 4
"""Per sample: the number of simulations is counted, not their exactness."""


class Counting(Predictor):
    """Remembers how many motions were simulated."""

    counted = 0

    def _run(self, moving: Sequence[Moving]) -> list[Trajectory]:
        self.counted += len(moving)
        return super()._run(moving)


@pytest.fixture
def counting() -> Residuals:
    recordings = simulated(PLAIN, points=POINTS[:2], seconds=0.05)
    made = residuals_of(PLAIN, recordings, parameters=("EI",), per_recording=("start_theta1",))
    p = made.predictor
    return replace(made, predictor=Counting(p.experiments, p.unknowns, p.fixed, steps=STEPS))


def test_one_sided_slopes_simulate_the_base_once_for_all_parameters(counting: Residuals) -> None:
    everywhere, own = 2, 2
    counting.slopes(counting.unknowns.parameters.vector(), central=False)
    assert counting.predictor.counted == everywhere + own + len(counting.experiments)  # type: ignore[attr-defined]


def test_what_is_simulated_together_is_what_each_simulates_alone(counting: Residuals) -> None:
    alone = counting.predictor
    at = [counting.unknowns.parameters.vector() * share for share in (1.0, 1.1, 0.9)]
    together = [replace(alone) for _ in at]
    simulate_together(list(zip(together, at, strict=True)))
    for predictor, vector in zip(together, at, strict=True):
        outputs = predictor.predict(vector)
        assert predictor.counted == 0  # type: ignore[attr-defined]
        for a, b in zip(outputs, alone.predict(vector), strict=True):
            assert np.array_equal(a, b)


FILTERED = Processing(ZeroPhaseLowPass(cutoff_hz=60.0), decimate=2)

ROUNDING = 1e-11
"""Of the largest output, over the step: a filter of differences rounds otherwise than differences
of what was filtered."""


@pytest.mark.parametrize("central", [False, True])
def test_slopes_are_differences_of_what_is_compared(counting: Residuals, central: bool) -> None:
    """Filters and thinning, weights and masks are in them, whichever way they are made."""
    p = counting.predictor
    filtered = [prepare(e.model, e.recording, e.outputs, FILTERED) for e in counting.experiments]
    residuals = replace(counting, predictor=Predictor(filtered, p.unknowns, p.fixed, steps=STEPS))
    here = residuals.unknowns.parameters.vector()
    slopes = residuals.slopes(here, central=central)
    pairs = zip(filtered, residuals.weights, strict=True)
    largest = max(float(np.nanmax(np.abs(e.measured * w))) for e, w in pairs)
    for j in range(len(here)):
        up, down = residuals._sides(here, j, central)
        sides = residuals.blocks(up), residuals.blocks(down)
        for S, a, b in zip(slopes, *sides, strict=True):
            expected = (a - b) / (up[j] - down[j])
            assert np.abs(S[:, :, j] - expected).max() <= ROUNDING * largest / abs(up[j] - down[j])


def test_motions_asked_for_together_are_those_asked_for_apart(counting: Residuals) -> None:
    predictor, everything = counting.predictor, range(len(counting.experiments))
    here = counting.unknowns.parameters.vector()
    there = here * 1.01
    together = predictor.predict_many([(here, everything), (there, everything), (here, [1])])
    fresh = Predictor(predictor.experiments, predictor.unknowns, predictor.fixed, steps=STEPS)
    apart = [fresh.predict(here), fresh.predict(there), fresh.predict(here)[1:]]
    for one, other in zip(together, apart, strict=True):
        for a, b in zip(one, other, strict=True):
            assert np.array_equal(a, b)


def test_what_is_simulated_already_is_taken_where_the_motion_is_the_same(
    counting: Residuals,
) -> None:
    predictor, here = counting.predictor, counting.unknowns.parameters.vector()
    known = replace(predictor, motion_cache=predictor.simulated_at(here))
    given = {id(motion) for motion in known.motion_cache.motions.values()}
    everything = range(len(known.experiments))
    for vector, same in ((here, True), (1.01 * here, False)):
        motions = known.trajectories([(vector, everything)])[0]
        assert all((id(motion) in given) == same for motion, _, _ in motions)
        for a, b in zip(known.predict(vector), predictor.predict(vector), strict=True):
            assert np.array_equal(a, b)


class Interrupted(Predictor):
    """While it simulates, another thread asks for other motions, so that older ones go."""

    others: Sequence[np.ndarray] = ()

    def _run(self, moving: Sequence[Moving]) -> list[Trajectory]:
        others = self.others
        object.__setattr__(self, "others", ())
        if others:
            with ThreadPoolExecutor(1) as pool:
                list(pool.map(self.predict, others))
        return super()._run(moving)


def test_a_motion_that_another_thread_drops_is_still_there_for_who_asked_first(
    counting: Residuals,
) -> None:
    p, start = counting.predictor, counting.unknowns.parameters.vector()
    shared = Interrupted(p.experiments, p.unknowns, p.fixed, steps=STEPS)
    known, new, *others = (start * (1.0 + 0.001 * k) for k in range(12))
    everything = range(len(p.experiments))
    expected = [replace(p).predict(x) for x in (known, new)]
    shared.predict(known)
    object.__setattr__(shared, "others", others)
    found = shared.predict_many([(known, everything), (new, everything)])
    for a, b in zip(found, expected, strict=True):
        assert all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))
