"""Options of a diagnosis, and what a search reports while it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from ..results import RankedEffect

FIDELITY = 0.001
"""Relative modelling tolerance: share of a channel's spread, if nothing else is stated."""


DEFAULT_EFFECTS = 3
"""Effects that a search may find, if nothing else is stated."""


@dataclass(frozen=True)
class Options:
    """Options of a diagnosis."""

    max_effects: int = DEFAULT_EFFECTS
    """Effects that the search may find."""
    adds: bool = True
    """Whether they are added to the model; else they are proposed."""
    candidates: tuple[str, ...] = ()
    """Ids of the candidates; empty: all that apply."""
    fidelity: float = FIDELITY
    stated_noise: Mapping[str, float] = field(default_factory=dict)
    """channel -> stated standard deviation of the sensor's noise, SI."""
    stated_rig: Mapping[str, str] = field(default_factory=dict)
    """What is stated of the rig: `RigSpec.statements`."""
    per_recording: tuple[str, ...] = ()
    """Effects whose sizes are estimated again on validation data (another bench's friction)."""
    identified: Mapping[str, float] = field(default_factory=dict)
    """label -> value: the estimates of an identification, one of two starts of the base fit."""
    compare: bool = True
    """Whether measured and modelled signals of the first and the last model are kept."""


class RemainingTrials(NamedTuple):
    """Trials that the screen has not made yet."""

    sizes: int
    """Number of sizes still to be tried."""
    effects: tuple[str, ...]
    """Titles of effects of which no size was tried."""


RankingCallback = Callable[[tuple[RankedEffect, ...], RemainingTrials], None]
"""Called with the current ranking: during the screen, after it, after each refit."""
