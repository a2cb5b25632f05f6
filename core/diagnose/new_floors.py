"""Noise floors estimated again beyond a better model.

Where no noise is stated and no motion repeats, it is estimated from what the recordings hold beyond
the model, and what the model as given lacks counts as noise: the encoders of an arm whose torque
was limited and rippled seemed twenty times as noisy as they were, and the ripple stayed below. A
model that leaves no more than such a floor is therefore compared with the floor that it shows
itself. What is above that may still be noise, or what no shape of the arm can follow: an effect is
missing where one explains it, and else the floor is what is left.

Where a servo leads the joints, a better model may also show that there is more: the encoders' noise
shakes the links, and how far depends on what they are. A soft base doubled it in the torques.

All that was weighed before is weighed again in the last floors (core.diagnose.final_ladder).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from core.diagnose.data import ANCHORED, NeededSteps, enough_steps, hypothesis
from core.diagnose.floor import Floor, channel_floors
from core.diagnose.minimum import converged
from core.diagnose.search import prune, search, trust_laws
from core.diagnose.start import motions_of
from core.diagnose.state import Options, RankingCallback, State
from core.diagnose.verdict import channel_rms, within_noise
from core.progress import Progress

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
        if floors is None or progress.stopped():
            break
        before = state.copied()
        if surely_above(state, floors):
            put_in_floors(state, floors, progress.stopped)
            further = search(state, options, progress, on_ranking)
            if state.found != before.found:
                more = further
                continue
        if not progress.stopped():
            state = before
            put_in_floors(state, _at_most_left(state, floors), progress.stopped)
        break
    return state, more


def lower_floors(state: State, options: Options) -> dict[str, Floor] | None:
    """channel -> the floor that the last model shows, at most the one before; None where none is
    much lower, where nothing was found, or where that model leaves more than noise already."""
    if not state.found or not within_noise(state.data, state.refit.errors):
        return None
    old = state.data.floors
    floors = {n: replace(f, value=min(f.value, old[n])) for n, f in _shown(state, options).items()}
    lower = max(old[n] / f.value for n, f in floors.items()) >= LOWER
    return floors if lower else None


def higher_floors(state: State, options: Options) -> dict[str, Floor] | None:
    """channel -> the floor that the last model shows, at least the one before; None where none is
    much higher, where nothing was found, or where no servo leads the joints: then noise does not
    move the arm, and a model says of it only how much it is at most.

    What an arm may miss of itself because it is led does not count here: a model in a wrong valley
    was said to miss eighty times what it left, and an offset of the torque was lost below.
    """
    if not state.found or not state.data.rig.servo:
        return None
    old = state.data.floors
    floors = {n: replace(f, value=max(f.noise, old[n])) for n, f in _shown(state, options).items()}
    higher = max(f.value / old[n] for n, f in floors.items()) >= LOWER
    return floors if higher else None


def _shown(state: State, options: Options) -> dict[str, Floor]:
    """channel -> the floor that the last model shows."""
    h = state.refit.hypothesis
    apart = [b / w for b, w in zip(state.refit.errors, state.data.weights, strict=True)]
    return channel_floors(
        h.residuals.experiments, apart, motions_of(h), options.stated_noise, options.fidelity
    )


def surely_above(state: State, floors: Mapping[str, Floor]) -> bool:
    """Whether the last model leaves more than these floors in a channel, however well they are
    known."""
    return any(rms > floors[n].within * floors[n].value for n, rms in _left(state).items())


def _at_most_left(state: State, floors: Mapping[str, Floor]) -> dict[str, Floor]:
    """The floors where no effect explains what is above: that is noise too, or what no model of
    this kind can follow. As weights of a fit they are nearer to the truth than those before."""
    left, old = _left(state), state.data.floors
    return {n: replace(f, value=min(max(f.value, left[n]), old[n])) for n, f in floors.items()}


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
