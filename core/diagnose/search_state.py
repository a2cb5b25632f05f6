"""What a search has so far, and how far it is to look."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from ..diagnose.base_fit import Begun
from ..diagnose.fit_problem import Data, names_of
from ..diagnose.ladder_steps import Validated, ladder_step, validated
from ..diagnose.linear_screen import Screen
from ..diagnose.refit import Refit
from ..effects import with_included
from ..effects.effect import Effect
from ..identify.setup import Setup
from ..results import DiagnosisRound, LadderStep, RankedEffect
from ..sentences import listed

FIDELITY = 0.001
"""Share of a channel's spread that no model is asked to explain where nothing else is stated."""


@dataclass(frozen=True)
class Options:
    """How far to look."""

    max_effects: int = 3
    candidates: tuple[str, ...] = ()
    """Ids to choose from; empty: all that apply."""
    fidelity: float = FIDELITY
    stated_noise: Mapping[str, float] = field(default_factory=dict)
    """channel -> standard deviation of the sensor's noise, SI, where it is known."""
    stated_rig: Mapping[str, str] = field(default_factory=dict)
    """What is known of the rig beforehand: `RigSpec.statements`."""
    per_recording: tuple[str, ...] = ()
    """Effects whose sizes are estimated anew on validation data (another bench's friction)."""
    identified: Mapping[str, float] = field(default_factory=dict)
    """label -> value: where an identification ended, one of the two starts of the first fit."""
    compare: bool = True
    """Whether measured and modelled signals are kept, of the first model and the last."""


class ToCome(NamedTuple):
    """What a ranking does not know yet."""

    sizes: int
    """That are still to be tried."""
    effects: tuple[str, ...]
    """Titles of those of which no size was tried yet."""


RankingCallback = Callable[[tuple[RankedEffect, ...], ToCome], None]
"""Called with the ranking as it stands: while the screen goes on, after it, after each refit."""


@dataclass
class State:
    """What the ladder has so far."""

    data: Data
    refit: Refit
    present: list[Effect]
    given: int
    """How many of them the user put there."""
    rounds: list[DiagnosisRound]
    steps: list[LadderStep]
    validation: Data | None
    first: Screen | None = None
    """Of the first round."""
    screened: tuple[Refit, Screen] | None = None
    """The screen of the last round, and the model that it is of."""
    passed: list[str] = field(default_factory=list)
    """Titles of what was taken out again."""
    unseen: dict[tuple[int, int | None], tuple[Refit, Validated]] = field(default_factory=dict)
    """What `validated` gave for a refit with so many steps: gate, ladder and figures ask alike."""

    out_of_date: bool = False
    """Whether rounds and steps were weighed in other floors, or at another minimum."""
    earlier: State | None = None
    """The search before its floors changed the first time."""

    def validated(self, refit: Refit, fine: int | None = None) -> Validated | None:
        """A refit on the recordings that no fit sees; `fine` steps per sample, else those known."""
        if self.validation is None:
            return None
        fine = self.validation.fine if fine is None else fine
        key = (id(refit), fine)
        if key not in self.unseen:
            found = validated(replace(self.validation, fine=fine), refit)
            assert found is not None
            self.unseen[key] = refit, found  # the refit is held, so that its id stays its own
        return self.unseen[key][1]

    def copied(self) -> State:
        """The same, which stays as it is while this one goes on."""
        return replace(
            self, present=list(self.present), rounds=list(self.rounds), steps=list(self.steps),
            passed=list(self.passed), unseen=dict(self.unseen),
        )  # fmt: skip

    @property
    def found(self) -> list[Effect]:
        """What was added."""
        return self.present[self.given :]

    @property
    def detours(self) -> tuple[str, ...]:
        """Titles of what was added on the way and turned out needless at the end."""
        kept = {e.title for e in self.present}
        return tuple(title for title in dict.fromkeys(self.passed) if title not in kept)


def given_step(begun: Begun) -> LadderStep:
    """The first step of a ladder, named by the effects that its model states."""
    stated = listed([e.title for e in begun.base.hypothesis.model.effects])
    title = f"The model with {stated}" if stated else "The model as given"
    return ladder_step(begun.data, begun.validated, begun.base, None, title, ())


def step_of(state: State, added: Effect | None, title: str) -> LadderStep:
    """The ladder's step for the model as it stands, after `added` came in or something went."""
    names: tuple[str, ...] = ()
    if added is not None:
        names = names_of(added, state.refit.hypothesis.model, state.data.sizes) or ("",)
    kind = None if added is None else added.kind
    later = state.validated(state.refit)
    return ladder_step(state.data, later, state.refit, kind, title, names)


def begun_state(setup: Setup, begun: Begun) -> State:
    """The model as given, before the first round."""
    present = list(setup.model.effects)
    state = State(
        begun.data, begun.base, present, len(present), [], [given_step(begun)], begun.validation
    )
    if begun.validation is not None and begun.validated is not None:
        state.unseen[id(begun.base), begun.validation.fine] = begun.base, begun.validated
    return state


def settings(state: State) -> list[dict[str, object]]:
    """The accepted effects, with what they include, as [model] effects of a scenario."""
    model = state.refit.hypothesis.model
    known = {**model.effect_values, **state.refit.hypothesis.values()}
    have = {e.kind for e in with_included(state.present[: state.given])}
    listed: list[dict[str, object]] = []
    for one in with_included(state.found):
        if one.kind in have and not one.repeats:
            continue
        entry: dict[str, object] = {"id": one.kind}
        for effect_parameter in one.parameters(model.arm, model.drive, state.data.sizes):
            name = effect_parameter.parameter.name
            if not one.sought(effect_parameter, state.data.rig):
                continue
            entry[name] = {
                "start": float(known.get(name, effect_parameter.parameter.value)),
                "vary": True,
            }
        listed.append(entry)
    return listed
