"""Noise floors estimated again beyond a better model.

Where no noise is stated and no motion repeats, it is estimated from what the recordings hold beyond
the model, and what the model as given lacks counts as noise: the encoders of an arm whose torque
was limited and rippled seemed twenty times as noisy as they were, and the ripple stayed below. A
model that leaves no more than such a floor is therefore compared with the floor that it shows
itself, and noise is at most what all effects together do not explain of the errors, as straight
lines have it: a torque that its own feedback makes rough is no noise of a sensor. What is above
that may still be noise, or what no shape of the arm can follow: an effect is missing where one
explains it, and else all stays as it was.

Where a servo leads the joints, a better model may also show that there is more: the encoders' noise
shakes the links, and how far depends on what they are. A soft base doubled it in the torques.

All that was weighed before is weighed again in the last floors (core.diagnose.final_ladder).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from ..diagnose.cost_minimum import converged
from ..diagnose.effect_search import prune, search, trust_laws
from ..diagnose.fit_problem import ANCHORED, NeededSteps, enough_steps, hypothesis
from ..diagnose.noise_floor import Floor, channel_floors
from ..diagnose.remaining_error import channel_rms, within_noise
from ..diagnose.search_state import Options, RankingCallback, State
from ..diagnose.sensor_noise import ESTIMATED
from ..diagnose.whitening import whitened_rows
from ..progress import Progress

LOWER = 1.25
"""Times a new floor, that the old one must be for anything to be weighed anew, or the other way
round: draws of the noise scatter by a tenth."""

MOST = 2
"""Times that the noise is estimated again: what the model lacked hid most of it the first time."""


def search_with_new_floors(
    state: State, options: Options, progress: Progress, on_ranking: RankingCallback | None
) -> tuple[State, bool]:
    """The whole search, with the noise estimated again beyond what it found: where it ended, and
    whether another effect is known to be missing."""
    more = search(state, options, progress, on_ranking)
    for _ in range(MOST):
        larger = higher_floors(state, options)
        if larger is not None and not progress.stopped():
            put_in_floors(state, larger, progress.stopped)
            prune(state, progress)
            more = more and not within_noise(state.data, state.refit.errors)
            continue
        floors = lower_floors(state, options)
        if floors is None or progress.stopped() or not surely_above(state, floors):
            break
        before = state.copied()
        put_in_floors(state, floors, progress.stopped)
        further = search(state, options, progress, on_ranking)
        if state.found == before.found or progress.stopped():
            return before, more
        more = further
    return state, more


def lower_floors(state: State, options: Options) -> dict[str, Floor] | None:
    """channel -> the floor that the last model shows, at most the one before; None where none is
    much lower, or where that model leaves more than noise already."""
    if not within_noise(state.data, state.refit.errors):
        return None
    old, most = state.data.floors, _unexplained(state)
    floors = {}
    for name, f in _shown(state, options).items():
        noise = min(f.noise, most.get(name, np.inf)) if f.source == ESTIMATED else f.noise
        value = float(np.sqrt(max(f.value**2 - f.noise**2, 0.0) + noise**2))
        floors[name] = replace(f, value=min(value, old[name]), noise=noise)
    lower = max(old[n] / f.value for n, f in floors.items()) >= LOWER
    return floors if lower else None


def _unexplained(state: State) -> dict[str, float]:
    """channel -> rms, SI, of what the model as given leaves and no effect explains, of as many
    independent samples as there are beside the columns that were tried; nothing once another model
    stands, of which `_shown` knows more."""
    data, seen = state.data, state.first
    if seen is None or state.found or state.passed:
        return {}
    squares, counts = dict.fromkeys(data.floors, 0.0), dict.fromkeys(data.floors, 0)
    rows = whitened_rows(data.experiments)
    for e, own, r in zip(data.experiments, rows, seen.remainders, strict=True):
        for c, (name, _) in enumerate(e.channels):
            squares[name] += float(np.sum(r[own[c], c] ** 2))
            counts[name] += len(own[c])
    spent = seen.slopes[0].shape[-1] + len(seen.columns)
    free = 1.0 - spent / max(sum(counts.values()), 1)
    if free <= 0.0:
        return {}
    return {
        n: data.floors[n] * float(np.sqrt(x / max(counts[n], 1) / free)) for n, x in squares.items()
    }


def higher_floors(state: State, options: Options) -> dict[str, Floor] | None:
    """channel -> the floor that the last model shows, at least the one before; None where none is
    much higher, where nothing was found, or where no servo leads the joints: then noise does not
    move the arm, and a model says of it only how much it is at most.

    No noise is more than what is left. What an arm may miss of itself because it is led does not
    count here: a model in a wrong valley was said to miss eighty times what it left, and an offset
    of the torque was lost below.
    """
    if not state.found or not state.data.rig.servo:
        return None
    old, left = state.data.floors, _left(state)
    floors = {
        n: replace(f, value=max(min(f.noise, left[n]), old[n]))
        for n, f in _shown(state, options).items()
    }
    higher = max(f.value / old[n] for n, f in floors.items()) >= LOWER
    return floors if higher else None


def _shown(state: State, options: Options) -> dict[str, Floor]:
    """channel -> the floor that the last model shows."""
    h = state.refit.hypothesis
    apart = [b / w for b, w in zip(state.refit.errors, state.data.weights, strict=True)]
    return channel_floors(
        h.residuals.experiments, apart, h.motions(), options.stated_noise, options.fidelity
    )


def surely_above(state: State, floors: Mapping[str, Floor]) -> bool:
    """Whether the last model leaves more than these floors in a channel, however well they are
    known."""
    return any(rms > floors[n].within * floors[n].value for n, rms in _left(state).items())


def _left(state: State) -> dict[str, float]:
    """channel -> rms of the last model's error, SI."""
    shares = channel_rms(state.data.experiments, state.refit.errors)
    return {name: share * state.data.floors[name] for name, share in shares.items()}


def put_in_floors(state: State, floors: Mapping[str, Floor], stopped: Callable[[], bool]) -> None:
    """The last model at its minimum in other floors; what was weighed in those before is out of
    date from then on."""
    state.earlier = state.earlier or state.copied()
    if state.rounds and state.rounds[-1].accepted is None:  # its reason stays, its figures do not
        state.rounds[-1] = replace(state.rounds[-1], ranking=())
    values = {**state.refit.hypothesis.model.effect_values, **state.refit.hypothesis.values()}
    data = state.data.in_floors(floors)
    few = enough_steps(data, state.present, values, ANCHORED)
    steps = enough_steps(data, state.present, values, least=few)
    data = replace(data, steps=steps, few=few, needed=NeededSteps())
    if state.validation is not None:
        state.validation = state.validation.in_floors(floors)
    state.unseen.clear()
    state.out_of_date = True
    start = hypothesis(data, state.present, values)
    state.data, state.refit = converged(data, start, None, stopped)
    trust_laws(state)
