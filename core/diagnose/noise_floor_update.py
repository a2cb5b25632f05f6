"""Noise floors, estimated again with a better model.

Without stated noise or repeated motions, noise is estimated from the residual, so what the base
model lacks counts as noise. The encoders of an arm with limited, rippling torque seemed twenty
times too noisy, and the ripple stayed below the noise floor. So a model within such a floor is
compared with the floor that it shows itself. Noise is at most what all effects together do not
explain of the errors, by linear prediction. An effect is missing if one explains the error above
the new floor; otherwise all stays as it was.

With a virtual servo a better model may also show more noise: encoder noise excites the links, by
how much depends on them. A soft base doubled it in the torques.

Earlier steps are compared again in the last floors (core.diagnose.final_ladder).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from ..diagnose.cost_minimum import converge
from ..diagnose.effect_search import remove_needless, search_effects, update_law_error
from ..diagnose.fit_problem import ANCHORED_ERROR, SubstepsByModes, enough_substeps, hypothesis
from ..diagnose.noise_floor import Floor, channel_floors
from ..diagnose.remaining_error import channel_rms, within_noise
from ..diagnose.search_state import Options, RankingCallback, State
from ..diagnose.sensor_noise import ESTIMATED
from ..diagnose.whitening import whitened_rows
from ..progress import Progress

LEAST_RATIO = 1.25
"""Least ratio of old to new floor, or the reverse, for an update: draws of the noise scatter by a
tenth."""

MOST_UPDATES = 2
"""Most updates: what the model lacked hid most of the noise the first time."""


def search_with_new_floors(
    state: State, options: Options, progress: Progress, on_ranking: RankingCallback | None
) -> tuple[State, bool]:
    """The whole search with updated noise floors: final state, and whether another effect is known
    to be missing."""
    more = search_effects(state, options, progress, on_ranking)
    for _ in range(MOST_UPDATES):
        higher = find_higher_floors(state, options)
        if higher is not None and not progress.stopped():
            apply_floors(state, higher, progress.stopped)
            remove_needless(state, progress)
            more = more and not within_noise(state.data, state.refit.errors)
            continue
        floors = find_lower_floors(state, options)
        if floors is None or progress.stopped() or not exceeds_floors(state, floors):
            break
        before = state.copied()
        apply_floors(state, floors, progress.stopped)
        further = search_effects(state, options, progress, on_ranking)
        if state.added == before.added or progress.stopped():
            return before, more
        more = further
    return state, more


def find_lower_floors(state: State, options: Options) -> dict[str, Floor] | None:
    """channel -> noise floor by the last model, at most the one before; None if none is much lower,
    or if the model leaves more than noise."""
    if not within_noise(state.data, state.refit.errors):
        return None
    old, most = state.data.floors, _rms_unexplained(state)
    floors = {}
    for name, f in _current_floors(state, options).items():
        noise = min(f.noise, most.get(name, np.inf)) if f.source == ESTIMATED else f.noise
        value = float(np.sqrt(max(f.value**2 - f.noise**2, 0.0) + noise**2))
        floors[name] = replace(f, value=min(value, old[name]), noise=noise)
    lower = max(old[n] / f.value for n, f in floors.items()) >= LEAST_RATIO
    return floors if lower else None


def _rms_unexplained(state: State) -> dict[str, float]:
    """channel -> rms, SI, of the base model's error that no effect explains, per independent sample
    beside the screened changes; empty once another model is current, for which `_current_floors` is
    better."""
    data, screened = state.data, state.first_screen
    if screened is None or state.added or state.removed:
        return {}
    squares, counts = dict.fromkeys(data.floors, 0.0), dict.fromkeys(data.floors, 0)
    rows = whitened_rows(data.experiments)
    for e, own, r in zip(data.experiments, rows, screened.remainders, strict=True):
        for c, (name, _) in enumerate(e.channels):
            squares[name] += float(np.sum(r[own[c], c] ** 2))
            counts[name] += len(own[c])
    spent = screened.slopes[0].shape[-1] + len(screened.output_changes)
    free = 1.0 - spent / max(sum(counts.values()), 1)
    if free <= 0.0:
        return {}
    return {
        n: data.floors[n] * float(np.sqrt(x / max(counts[n], 1) / free)) for n, x in squares.items()
    }


def find_higher_floors(state: State, options: Options) -> dict[str, Floor] | None:
    """channel -> noise floor by the last model, at least the one before; None if none is much
    higher, if no effect was added, or without a servo, where noise does not move the arm.

    No noise exceeds the residual. The error from prescribing the measured joint motion does not
    count here: it was overestimated eightyfold for a model in a wrong minimum, and hid a torque
    offset.
    """
    if not state.added or not state.data.rig.servo:
        return None
    old, residual_rms = state.data.floors, _rms_left(state)
    floors = {
        n: replace(f, value=max(min(f.noise, residual_rms[n]), old[n]))
        for n, f in _current_floors(state, options).items()
    }
    higher = max(f.value / old[n] for n, f in floors.items()) >= LEAST_RATIO
    return floors if higher else None


def _current_floors(state: State, options: Options) -> dict[str, Floor]:
    """channel -> noise floor by the last model."""
    h = state.refit.hypothesis
    errors = [b / w for b, w in zip(state.refit.errors, state.data.weights, strict=True)]
    return channel_floors(
        h.residuals.experiments, errors, h.motions(), options.stated_noise, options.fidelity
    )


def exceeds_floors(state: State, floors: Mapping[str, Floor]) -> bool:
    """Whether the last model's error surely exceeds these noise floors in a channel."""
    return any(rms > floors[n].uncertainty * floors[n].value for n, rms in _rms_left(state).items())


def _rms_left(state: State) -> dict[str, float]:
    """channel -> rms of the last model's error, SI."""
    shares = channel_rms(state.data.experiments, state.refit.errors)
    return {name: share * state.data.floors[name] for name, share in shares.items()}


def apply_floors(state: State, floors: Mapping[str, Floor], stopped: Callable[[], bool]) -> None:
    """Converges the last model in other noise floors; earlier steps are out of date then."""
    state.before_floor_update = state.before_floor_update or state.copied()
    if state.rounds and state.rounds[-1].accepted is None:  # its reason stays, its figures do not
        state.rounds[-1] = replace(state.rounds[-1], ranking=())
    values = {**state.refit.hypothesis.model.effect_values, **state.refit.hypothesis.values()}
    data = state.data.in_floors(floors)
    few = enough_substeps(data, state.present, values, ANCHORED_ERROR)
    steps = enough_substeps(data, state.present, values, least=few)
    data = replace(data, substeps=steps, anchored_substeps=few, substeps_by_modes=SubstepsByModes())
    if state.validation is not None:
        state.validation = state.validation.in_floors(floors)
    state.validation_cache.clear()
    state.out_of_date = True
    start = hypothesis(data, state.present, values)
    state.data, state.refit = converge(data, start, None, stopped)
    update_law_error(state)
