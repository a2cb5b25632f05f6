"""Noise floors read anew beyond a better model.

Where no noise is stated and no motion repeats, it is read from what the recordings say beyond the
model, and what the model as given lacks counts as noise: the encoders of an arm whose torque was
limited and rippled seemed twenty times as noisy as they were, and the ripple stayed below. A model
that leaves no more than such a floor is therefore held against the floor that it shows itself. What
is above that may still be noise, or what no shape of the arm can follow: an effect is missing where
one explains it, and else the floor is what is left.

Where a servo leads the joints, a better model may also show that there is more: the encoders' noise
shakes the links, and how far depends on what they are. A soft base doubled it in the torques.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from core.diagnose.data import ANCHORED, Data, NeededSteps, enough_steps, hypothesis
from core.diagnose.descent import cost_of
from core.diagnose.floor import Floor, channel_floors
from core.diagnose.minimum import converged
from core.diagnose.refit import Refit
from core.diagnose.screen import Screen
from core.diagnose.search import prune, search
from core.diagnose.start import Begun, motions_of
from core.diagnose.state import Options, RankingCallback, State
from core.diagnose.verdict import channel_rms, within_noise
from core.identify.predictor import KnownMotions
from core.progress import Progress
from core.results import DiagnosisRound, LadderStep

LOWER = 1.25
"""Times a new floor, that the old one must be for anything to be weighed anew, or the other way
round: draws of the noise scatter by a tenth."""

SURELY = 1.5
"""Times the new floor that the error of a channel must be for an effect to be sought: floors that
are estimated are known within that factor (tests/diagnose/test_floor.py)."""

MOST = 2
"""Times that the noise is read anew: what the model lacked hid most of it the first time."""


def search_sharply(
    state: State, begun: Begun, options: Options, progress: Progress,
    on_ranking: RankingCallback | None,
) -> tuple[State, Begun, bool]:  # fmt: skip
    """The whole search, with the noise read anew beyond what it found: where it ended, the model as
    given in the same floors, and whether another effect is known to be missing."""
    more = search(state, options, progress, on_ranking)
    for _ in range(MOST):
        larger = shaken_more(state, options)
        if larger is not None and not progress.stopped():
            begun = restated(state, begun, larger, progress.stopped)
            prune(state, progress)
            more = more and not within_noise(state.data, state.refit.errors)
            continue
        floors = read_anew(state, options)
        if floors is None or progress.stopped():
            break
        before, given = state.copied(), begun
        if surely_above(state, floors):
            begun = restated(state, begun, floors, progress.stopped)
            further = search(state, options, progress, on_ranking)
            if state.found != before.found:
                more = further
                continue
        if not progress.stopped():
            state = before
            begun = restated(state, given, _at_most_left(state, floors), progress.stopped)
        break
    return state, begun, more


def read_anew(state: State, options: Options) -> dict[str, Floor] | None:
    """channel -> the floor that the last model shows, at most the one before; None where none is
    much lower, where nothing was found, or where that model leaves more than noise already."""
    if not state.found or not within_noise(state.data, state.refit.errors):
        return None
    old = state.data.floors
    floors = {n: replace(f, value=min(f.value, old[n])) for n, f in _shown(state, options).items()}
    lower = max(old[n] / f.value for n, f in floors.items()) >= LOWER
    return floors if lower else None


def shaken_more(state: State, options: Options) -> dict[str, Floor] | None:
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
    return any(rms > SURELY * floors[name].value for name, rms in _left(state).items())


def _at_most_left(state: State, floors: Mapping[str, Floor]) -> dict[str, Floor]:
    """The floors where no effect explains what is above: that is noise too, or what no model of
    this kind can follow. As weights of a fit they are nearer to the truth than those before."""
    left, old = _left(state), state.data.floors
    return {n: replace(f, value=min(max(f.value, left[n]), old[n])) for n, f in floors.items()}


def _left(state: State) -> dict[str, float]:
    """channel -> rms of the last model's error, SI."""
    shares = channel_rms(state.data.experiments, state.refit.errors)
    return {name: share * state.data.floors[name] for name, share in shares.items()}


def restated(
    state: State, begun: Begun, floors: Mapping[str, Floor], stopped: Callable[[], bool]
) -> Begun:
    """The model as given against other floors; `state` then stands in them too."""
    shares = {name: state.data.floors[name] / floor.value for name, floor in floors.items()}
    scaled = [_scales(names, shares) for names in _channels(state.data)]
    _restate(state, floors, shares, stopped)
    data = _against(begun.data, floors)
    base = _rescaled(begun.base, scaled)
    h = hypothesis(data, base.hypothesis.model.effects, base.hypothesis.values())
    base = replace(base, hypothesis=h.at(base.hypothesis.vector))
    return replace(begun, data=data, base=base, validation=state.validation, known=None)


def _restate(
    state: State, floors: Mapping[str, Floor], shares: Mapping[str, float],
    stopped: Callable[[], bool],
) -> None:  # fmt: skip
    """All that a search has so far, in the new floors; the last model at its minimum in them."""
    values = {**state.refit.hypothesis.model.effect_values, **state.refit.hypothesis.values()}
    data = _against(state.data, floors)
    few = enough_steps(data, state.present, values, ANCHORED)
    steps = enough_steps(data, state.present, values, least=few)
    data = replace(data, steps=steps, few=few, needed=NeededSteps())
    scales = [_scales(names, shares) for names in _channels(state.data)]
    counts = dict.fromkeys(floors, 0)
    for e in data.experiments:
        for (name, _), mask in zip(e.channels, e.counted.T, strict=True):
            counts[name] += int(mask.sum())
    state.rounds[:] = [_round(one, scales) for one in state.rounds]
    state.steps[:] = [_step(one, floors, shares, counts) for one in state.steps]
    if state.first is not None:
        state.first = _screen(state.first, scales[0])
    if state.validation is not None:
        state.validation = _against(state.validation, floors)
    state.unseen.clear()
    start = hypothesis(data, state.present, values)
    state.data, state.refit = converged(data, start, None, stopped)


def _against(data: Data, floors: Mapping[str, Floor]) -> Data:
    values = {n: f.value for n, f in floors.items()}
    return replace(
        data, weights=data.weights_at(values), floors=values,
        floor_sources={n: f.source for n, f in floors.items()}, anchor=None, known=KnownMotions(),
    )  # fmt: skip


def _channels(data: Data) -> list[list[str]]:
    return [[name for name, _ in e.channels] for e in data.experiments]


def _scales(names: Sequence[str], shares: Mapping[str, float]) -> np.ndarray:
    """(k,) by which what is stated in floors grows."""
    return np.array([shares[n] for n in names])


def _rescaled(refit: Refit, scales: Sequence[np.ndarray]) -> Refit:
    """What is known of a fit, in other floors; where it stands stays."""
    found = refit.descended
    blocks = tuple(b * s for b, s in zip(found.blocks, scales, strict=True))
    slopes = tuple(S * s[:, None] for S, s in zip(found.slopes, scales, strict=True))
    cost = cost_of(blocks)
    there = replace(found, blocks=blocks, slopes=slopes, cost=cost)
    return replace(refit, descended=there, white_cost=cost)


def _round(known: DiagnosisRound, scales: Sequence[np.ndarray]) -> DiagnosisRound:
    ranking = tuple(
        replace(r, predicted=tuple(b * s for b, s in zip(r.predicted, scales, strict=False)))
        for r in known.ranking
    )
    return replace(known, ranking=ranking)


def _step(
    known: LadderStep, floors: Mapping[str, Floor], shares: Mapping[str, float],
    counts: Mapping[str, int],
) -> LadderStep:  # fmt: skip
    """`counts`: channel -> samples that count."""
    errors = tuple(
        replace(e, floor=e.floor / shares[e.channel], floor_source=floors[e.channel].source)
        for e in known.errors
    )
    cost = sum(counts[e.channel] * (e.rms / e.floor) ** 2 for e in errors)
    return replace(known, errors=errors, cost_per_sample=cost / sum(counts.values()))


def _screen(seen: Screen, scale: np.ndarray) -> Screen:
    return replace(seen, whitener=seen.whitener.scaled(scale))
