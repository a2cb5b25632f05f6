"""Whether an arm that bends in more shapes makes the recordings far more likely, where what is left
is within the noise already.

Too soft a beam of too few shapes can leave no more than noise, its stiffness a third off and stated
to a thousandth. A shape costs no parameter, so the evidence alone decides: no share of an error
does, since none is left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from ..diagnose.acceptance import Gate, Round
from ..diagnose.cost_minimum import converged, precise
from ..diagnose.evidence import RELEVANT, TIE, weigh
from ..diagnose.fit_problem import Data, hypothesis, sharing_motions
from ..diagnose.linear_screen import Screen, screen
from ..diagnose.refit import Refit, whitened
from ..diagnose.refit_starts import nominal_values
from ..diagnose.whitening import Whitener, fit_whitener, whitened_rows
from ..effects.effect import Effect
from ..least_squares import cost_of


def finer_round(
    data: Data,
    before: Refit,
    present: Sequence[Effect],
    finer: Effect,
    gate: Gate,
    stopped: Callable[[], bool],
) -> Round | None:
    """The round that adds one more shape; None where that is not far more likely.

    Args:
        data: the recordings, in noise floors.
        before: a model that leaves no more than noise.
        present: the effects in it.
        finer: the effect that adds the shape.
        gate: why a model is not accepted, of recordings that no fit saw.
        stopped: whether to give up.
    """
    shared = sharing_motions(data, before.hypothesis)
    seen = screen(shared, before.hypothesis, present, [finer], lambda _: stopped())
    if not _changes(seen, data) or stopped():
        return None
    there, after = _fitted(data, before, [*present, finer], stopped)
    data, before = precise(data, before, stopped)
    whitener = fit_whitener(after.errors, whitened_rows(data.experiments))
    before, after = (_whitened(one, whitener) for one in (before, after))
    weighed = weigh(seen.candidates[0], before, after, data.count, 1)
    if stopped() or not weighed.white_drop > TIE or gate(there, after):
        return None
    return Round(seen, (weighed,), weighed, before, after, there, (weighed,))


def _changes(seen: Screen, data: Data) -> bool:
    """Whether one more shape, the parameters as they are, changes what is measured by a relevant
    part of the noise: else it changes no estimate that matters either."""
    return any(cost_of(c.blocks) > RELEVANT * data.count for c in seen.columns)


def _fitted(
    data: Data, refit: Refit, effects: Sequence[Effect], stopped: Callable[[], bool]
) -> tuple[Data, Refit]:
    """The model with the shape, from where the coarse one stands and from the nominal values."""
    bare, at = replace(data, anchor=None), refit.hypothesis.values()
    starts = [hypothesis(bare, effects, {**at, **v}) for v in ({}, nominal_values(data))]
    best = min(starts, key=lambda h: cost_of(h.errors(h.vector)))
    return precise(*converged(bare, best, None, stopped), stopped)


def _whitened(refit: Refit, whitener: Whitener) -> Refit:
    return replace(refit, white_cost=whitened(refit.hypothesis, refit.descended, whitener)[0])
