"""State and options of a search."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from ..diagnose.base_fit import BaseFit
from ..diagnose.fit_problem import Data, parameter_names
from ..diagnose.ladder_steps import ValidationFit, fit_validation, ladder_step
from ..diagnose.linear_screen import Screen
from ..diagnose.refit import Refit
from ..effects import with_included
from ..effects.effect import Effect
from ..identify.setup import Setup
from ..results import DiagnosisRound, LadderStep, RankedEffect
from ..sentences import listed

FIDELITY = 0.001
"""Relative modelling tolerance: share of a channel's spread, if nothing else is stated."""


@dataclass(frozen=True)
class Options:
    """Options of a diagnosis."""

    max_effects: int = 3
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


@dataclass
class State:
    """State of the ladder."""

    data: Data
    refit: Refit
    present: list[Effect]
    stated_count: int
    """Number of effects that the user stated."""
    rounds: list[DiagnosisRound]
    ladder: list[LadderStep]
    validation: Data | None
    first_screen: Screen | None = None
    """Screen of the first round."""
    last_screen: tuple[Refit, Screen] | None = None
    """Model and screen of the last round."""
    removed: list[str] = field(default_factory=list)
    """Titles of effects that were removed again."""
    validation_cache: dict[tuple[int, int | None], tuple[Refit, ValidationFit]] = field(
        default_factory=dict
    )
    """(id of a refit, steps per sample) -> refit and its validation fit; it is used several
    times."""

    out_of_date: bool = False
    """Whether rounds and steps used other noise floors or another minimum."""
    before_floor_update: State | None = None
    """The search before its noise floors changed the first time."""

    def validation_fit(self, refit: Refit, substeps: int | None = None) -> ValidationFit | None:
        """A refit on the validation recordings, with `substeps` or the usual steps per sample."""
        if self.validation is None:
            return None
        substeps = self.validation.result_substeps if substeps is None else substeps
        key = (id(refit), substeps)
        if key not in self.validation_cache:
            result = fit_validation(replace(self.validation, result_substeps=substeps), refit)
            assert result is not None
            # The refit is kept too, so that no other one gets its id.
            self.validation_cache[key] = refit, result
        return self.validation_cache[key][1]

    def copied(self) -> State:
        """A copy that later changes do not affect."""
        return replace(
            self, present=list(self.present), rounds=list(self.rounds), ladder=list(self.ladder),
            removed=list(self.removed), validation_cache=dict(self.validation_cache),
        )  # fmt: skip

    @property
    def added(self) -> list[Effect]:
        """Effects that were added."""
        return self.present[self.stated_count :]

    @property
    def needless(self) -> tuple[str, ...]:
        """Titles of effects that were added and are no longer in the model."""
        kept = {e.title for e in self.present}
        return tuple(title for title in dict.fromkeys(self.removed) if title not in kept)


def base_ladder_step(base_fit: BaseFit) -> LadderStep:
    """First step of a ladder, named by the effects that its model states."""
    stated = listed([e.title for e in base_fit.base.hypothesis.model.effects])
    title = f"The model with {stated}" if stated else "The model as given"
    return ladder_step(base_fit.data, base_fit.validation_fit, base_fit.base, None, title, ())


def ladder_step_of(state: State, added: Effect | None, title: str) -> LadderStep:
    """The ladder step of the current model, after `added` came in or an effect was removed."""
    names: tuple[str, ...] = ()
    if added is not None:
        names = parameter_names(added, state.refit.hypothesis.model, state.data.sizes) or ("",)
    kind = None if added is None else added.kind
    later = state.validation_fit(state.refit)
    return ladder_step(state.data, later, state.refit, kind, title, names)


def state_from_base_fit(setup: Setup, base_fit: BaseFit) -> State:
    """State of the base model, before the first round."""
    present = list(setup.model.effects)
    state = State(
        base_fit.data, base_fit.base, present, len(present), [], [base_ladder_step(base_fit)],
        base_fit.validation,
    )  # fmt: skip
    if base_fit.validation is not None and base_fit.validation_fit is not None:
        key = id(base_fit.base), base_fit.validation.result_substeps
        state.validation_cache[key] = base_fit.base, base_fit.validation_fit
    return state


def added_effect_settings(state: State) -> list[dict[str, object]]:
    """The added effects, with those that they include, as [model] effects of a scenario."""
    model = state.refit.hypothesis.model
    values = {**model.effect_values, **state.refit.hypothesis.values()}
    stated = {e.kind for e in with_included(state.present[: state.stated_count])}
    listed: list[dict[str, object]] = []
    for effect in with_included(state.added):
        if effect.kind in stated and not effect.repeats:
            continue
        entry: dict[str, object] = {"id": effect.kind}
        for effect_parameter in effect.parameters(model.arm, model.drive, state.data.sizes):
            name = effect_parameter.parameter.name
            if not effect.is_searched(effect_parameter, state.data.rig):
                continue
            entry[name] = {
                "start": float(values.get(name, effect_parameter.parameter.value)),
                "vary": True,
            }
        listed.append(entry)
    return listed
