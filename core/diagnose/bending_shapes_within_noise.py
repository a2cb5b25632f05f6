"""Whether more bending shapes make the recordings far more likely, once the model leaves only
noise.

A soft beam with too few shapes may leave only noise although its stiffness is wrong by a third. A
shape costs no parameter, so the evidence alone decides; no error is left to explain.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from ..diagnose.acceptance import ModelCheck, Round
from ..diagnose.cost_minimum import converge, converge_precisely
from ..diagnose.evidence import RELEVANT, TIE, assess_refit
from ..diagnose.fit_problem import Data, hypothesis, with_shared_motions
from ..diagnose.linear_screen import Screen, screen
from ..diagnose.refit import Refit, with_whitened_cost
from ..diagnose.refit_starts import nominal_values
from ..diagnose.whitening import fit_whitener, whitened_rows
from ..effects.effect import Effect
from ..least_squares import cost_of


def bending_shape_round(
    data: Data, before: Refit, present: Sequence[Effect], extra_shape: Effect, check: ModelCheck,
    stopped: Callable[[], bool],
) -> Round | None:  # fmt: skip
    """The round that adds `extra_shape`, one more bending shape; None if that is not far more
    likely. The model `before` leaves no more than noise; `check` says why a model is not accepted,
    by recordings that no fit used."""
    shared = with_shared_motions(data, before.hypothesis)
    screened = screen(shared, before.hypothesis, present, [extra_shape], lambda _: stopped())
    if not _changes_outputs(screened, data) or stopped():
        return None
    extended_data, after = _fit_with_bending_shape(data, before, [*present, extra_shape], stopped)
    data, before = converge_precisely(data, before, stopped)
    whitener = fit_whitener(after.errors, whitened_rows(data.experiments))
    before, after = (with_whitened_cost(r, whitener) for r in (before, after))
    assessed = assess_refit(screened.candidates[0], before, after, data.count, 1)
    if stopped() or not assessed.whitened_reduction > TIE or check(extended_data, after):
        return None
    return Round(screened, (assessed,), assessed, before, after, extended_data, (assessed,))


def _changes_outputs(screened: Screen, data: Data) -> bool:
    """Whether one more shape, at unchanged parameters, changes the outputs by a relevant part of
    the noise. If not, it changes no estimate that matters."""
    return any(cost_of(c.blocks) > RELEVANT * data.count for c in screened.output_changes)


def _fit_with_bending_shape(
    data: Data, refit: Refit, effects: Sequence[Effect], stopped: Callable[[], bool]
) -> tuple[Data, Refit]:
    """The model with the shape, fitted from the current and from the nominal values."""
    bare, at = replace(data, anchor=None), refit.hypothesis.values()
    starts = [hypothesis(bare, effects, {**at, **v}) for v in ({}, nominal_values(data))]
    best = min(starts, key=lambda h: cost_of(h.errors(h.vector)))
    return converge_precisely(*converge(bare, best, None, stopped), stopped)
