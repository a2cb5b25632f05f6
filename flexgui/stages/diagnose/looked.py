"""What a task finds and the page shows: a look at a model, and what an effect does to an arm."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from flexgui.core.parameters import Parameter
from flexgui.core.progress import Progress
from flexgui.core.results import Diagnosis, LadderStep, Outcome, RankedEffect
from flexgui.views.over_speed import OverSpeed


@dataclass(frozen=True)
class Looked:
    """Of one model: how far it is from the recordings, and what could be missing in it."""

    step: LadderStep
    recordings: tuple[str, ...]
    """That the model was fitted to."""
    channels: tuple[tuple[str, ...], ...]
    """Of each recording."""
    dt: tuple[float, ...]
    """s between the rows of `residual` and of the predictions."""
    residual: tuple[np.ndarray, ...]
    """(rows, channels) per recording, in floors."""
    ranking: tuple[RankedEffect, ...] = ()
    """As it stands; predictions have the rows of `residual`."""
    to_come: int = 0
    """Sizes of effects that are still to be tried before the ranking is more than a first one."""
    untried: tuple[str, ...] = ()
    """Titles of effects of which no size was tried yet."""
    diagnosis: Diagnosis | None = None
    """Once it is complete."""
    laws: tuple[tuple[OverSpeed, ...], ...] = ()
    """For each compared recording, of the first of the ranking; empty where it is no such law."""
    laws_of: str = ""
    """Id of that effect."""
    outcome: Outcome | None = None
    """Of the identification that went with it, where there was one."""


def refitted_only(found: Looked) -> Looked:
    """Without what is only estimated before refitting: a guess is to rest on what was shown."""
    return replace(
        found, ranking=tuple(r for r in found.ranking if r.refit_drop_percent is not None)
    )


class PartialProgress(Progress, Protocol):
    """A progress that also takes what there is so far."""

    def partial(self, name: str, value: Any) -> None:
        """A newer value of the same name stands for all earlier ones."""


@dataclass(frozen=True)
class Demonstration:
    """One output of one recording, where the effect changes it most."""

    kind: str
    title: str
    recording: str
    channel: str
    unit: str
    time: np.ndarray
    """(N,) s, a stretch of the recording"""
    measured: np.ndarray
    without: np.ndarray
    """(N,) of the model with everything else in it"""
    with_it: np.ndarray
    sizes: tuple[Parameter, ...]
    """Of the effect, at the values that were simulated."""
    floor: float | None = None
    """Of the output's error, where it is known."""
    torques: tuple[OverSpeed, ...] = ()
    """What the effect does to each joint, over its speed; empty where no such law says it."""
