"""What a complete model may still miss: a beam bends in more shapes than a model has, and laws such
as that of dry friction are idealised."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from core.arm.segment import MAX_MODES
from core.diagnose.data import Data, Hypothesis, hypothesis, moved
from core.diagnose.refit import Refit
from core.diagnose.verdict import channel_rms
from core.effects.effect import Effect
from core.identify.predictor import on_all_cores
from core.results import Remains

STEPS = 8
"""Per sample, at least: the third shape swings within a sample."""


def within_resolution(data: Data, h: Hypothesis, left: Remains) -> bool:
    """Whether what is left above the floor is no more, in every channel, than what the model's
    shapes cannot follow.

    Args:
        data: the recordings.
        h: the model at its minimum; only with all shapes that there are is anything said.
        left: its error, in floors.

    What the next shape would change is estimated from the last two, as a geometric series. Smooth
    motions leave less; where forces have edges it was seen to leave up to 1.8 times as much, which
    is then not excused.
    """
    if not any(h.model.arm.modes) or any(m not in (0, MAX_MODES) for m in h.model.arm.modes):
        return False
    models = (MAX_MODES, MAX_MODES - 1, MAX_MODES - 2)
    errors = list(on_all_cores(lambda modes: _errors(data, h, modes), models))
    last, before = (_change(data, errors[k], errors[k + 1]) for k in (0, 1))
    return all(
        np.sqrt(max(rms**2 - 1.0, 0.0)) <= last[name] ** 2 / max(before[name], 1e-300)
        for name, rms in left.by_channel.items()
    )


def missed_by_laws(data: Data, refit: Refit) -> dict[str, float]:
    """channel -> mean square, in floors, that the laws of the model's effects may miss: of each the
    share that it states of what it does to the outputs, everything else as it is."""
    h, missed = refit.hypothesis, dict[str, float]()
    for one in h.model.effects:
        if not one.idealised:
            continue
        rest = [e for e in h.model.effects if e is not one and one.kind not in e.includes]
        without = hypothesis(data, rest, {**h.model.effect_values, **h.values()})
        for name, rms in _change(data, without.errors(without.vector), refit.errors).items():
            missed[name] = missed.get(name, 0.0) + (one.idealised * rms) ** 2
    return missed


def _errors(data: Data, h: Hypothesis, modes: int) -> list[np.ndarray]:
    """Of the same parameters on an arm with so many shapes per bending segment."""
    arm = data.bare.arm
    segments = tuple(s.model_copy(update={"modes": modes}) if s.modes else s for s in arm.segments)
    bare = replace(data.bare, arm=arm.model_copy(update={"segments": segments}))
    experiments = tuple(moved(e, bare) for e in data.experiments)
    fine = max(data.fine or 0, STEPS)
    coarser = replace(
        data, bare=bare, experiments=experiments, anchor=None, needed=None, steps=fine
    )
    found = hypothesis(coarser, _physical(h.model.effects), {**h.model.effect_values, **h.values()})
    return found.errors(found.vector)


def _physical(effects: Sequence[Effect]) -> list[Effect]:
    return [one for one in effects if not one.resolution]


def _change(data: Data, a: Sequence[np.ndarray], b: Sequence[np.ndarray]) -> dict[str, float]:
    """channel -> rms in floors of what changes between two models."""
    return channel_rms(data.experiments, [x - y for x, y in zip(a, b, strict=True)])
