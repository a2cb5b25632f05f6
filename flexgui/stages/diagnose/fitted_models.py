"""All models that were fitted in a session, with what was found: to compare and to return to."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from flexgui.core.information_criteria import fall_of_bic, information_criteria
from flexgui.core.results import ErrorProducts, InformationCriteria, LadderStep, Outcome, Profile
from flexgui.core.scenario.schema import Scenario
from flexgui.sentences.figures import validation_rms
from flexgui.session.settings import settings_of
from flexgui.session.state import Topic
from flexgui.stages.diagnose.effects import present
from flexgui.stages.diagnose.model_versions import ModelVersion, step_in_floors

if TYPE_CHECKING:
    from flexgui.session.session import Session

MOST_MODELS = 30
"""Models that a session keeps: the newest."""
GIVEN = "As given"


@dataclass(frozen=True)
class FittedModel:
    """A fitted model with the steps before it."""

    way: tuple[ModelVersion, ...]
    """Its versions, itself last."""
    number: int
    """From 1, in the order in which they were diagnosed first; 0: only identified so far."""
    made: float
    """When it was fitted last, s (Unix time)."""
    seconds: float = 0.0
    """That fit and diagnosis took."""
    name: str = ""
    """A person's own; empty: after its effects."""
    identified: Outcome | None = None
    """Of a later identification than that of its diagnosis."""
    profile: Profile | None = None
    """Of a parameter of its outcome."""

    @property
    def outcome(self) -> Outcome | None:
        """Of its last identification."""
        return self.identified or self.version.outcome

    @cached_property
    def settings(self) -> Mapping[Any, Any]:
        """That it was made with."""
        return settings_of(self.version.scenario)

    @property
    def version(self) -> ModelVersion:
        """The model itself."""
        return self.way[-1]

    @property
    def effects(self) -> tuple[str, ...]:
        """Titles of what was added to the model as given."""
        return tuple(title for _, title in present(self.version.scenario))

    @property
    def title(self) -> str:
        """What it is called."""
        return self.name or " + ".join(self.effects) or GIVEN


class FittedModels:
    """All results of a session by the settings that they were made with, also of models that were
    undone, and the model that is drawn beside. A change of a setting throws no result away."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.all: tuple[FittedModel, ...] = ()
        """Those that were fitted last stand last."""
        self._beside: int | None = None

    @property
    def listed(self) -> tuple[FittedModel, ...]:
        """Those that were diagnosed, so that their errors are known."""
        return tuple(sorted((m for m in self.all if m.number), key=lambda m: m.number))

    @property
    def comparable(self) -> tuple[FittedModel, ...]:
        """Those of them that differ from the present model in their effects only."""
        now = _settings(self._session.document.scenario)
        return tuple(m for m in self.listed if _settings(m.version.scenario) == now)

    @property
    def present(self) -> FittedModel | None:
        """The one that stands now."""
        last = next(reversed(self._session.diagnosis.versions), None)
        return None if last is None else self._of(last.scenario)

    @property
    def beside(self) -> FittedModel | None:
        """The one that is drawn beside the present one; None without one."""
        chosen = next((m for m in self.comparable if m.number == self._beside), None)
        return None if chosen is self.present else chosen

    def show_beside(self, number: int | None) -> None:
        """Draws another model beside the present one; None ends that."""
        with self._session.changing(Topic.DIAGNOSIS):
            self._beside = number

    def rename(self, name: str) -> bool:
        """Names the present model."""
        present = self.present
        if present is None:
            return False
        with self._session.changing(Topic.DIAGNOSIS):
            named = replace(present, name=name.strip()[:LONGEST_NAME])
            self.all = tuple(named if m is present else m for m in self.all)
        return True

    def add(self, way: tuple[ModelVersion, ...], seconds: float) -> None:
        """Keeps the last model of a way, which took `seconds`; fitted again it keeps its number and
        its name. The models before it are kept as they stand on this way."""
        known, outcome = self._of(way[-1].scenario), way[-1].outcome
        number = (known and known.number) or 1 + max((m.number for m in self.all), default=0)
        fitted = FittedModel(way, number, time.time(), seconds)
        if known is not None:
            profile = known.profile if outcome is known.outcome else None
            identified = known.identified if outcome is None else None
            fitted = replace(fitted, name=known.name, identified=identified, profile=profile)
        for k in range(1, len(way)):
            before = self._of(way[k - 1].scenario)
            if before is not None:
                self._put(replace(before, way=way[:k]))
        self._put(fitted)

    def identified(self, of: Scenario, outcome: Outcome, profile: Profile | None) -> None:
        """Keeps an identification and the last profile of a parameter of it."""
        known = self._of(of) or FittedModel((ModelVersion(of),), 0, time.time())
        own = outcome is known.version.outcome
        if known.outcome is not outcome or known.profile is not profile:
            self._put(replace(known, identified=None if own else outcome, profile=profile))

    def recall(self) -> tuple[Topic, ...]:
        """Shows what was found with the settings as they stand now; the topics that it changes.
        What was shown before is kept, and stays where nothing was found with them."""
        session = self._session
        known = self._of(session.document.scenario)
        if known is None:
            return ()
        self.take_up(known.version)
        if known.number:
            session.diagnosis.versions = known.way
        return Topic.OUTCOME, Topic.DIAGNOSIS

    def take_up(self, version: ModelVersion) -> None:
        """Makes the last identification of a model the result that is shown; none where it has
        none, rather than that of another model."""
        known = self._of(version.scenario)
        outcome = version.outcome if known is None else known.outcome
        profile = None if known is None else known.profile
        self._session.identification.take(outcome, version.scenario, profile)

    def _of(self, scenario: Scenario) -> FittedModel | None:
        return next((m for m in self.all if m.version.scenario == scenario), None)

    def _put(self, model: FittedModel) -> None:
        others = [m for m in self.all if m.version.scenario != model.version.scenario]
        self.all = (*others[1 - MOST_MODELS :], model)


LONGEST_NAME = 60


def _settings(scenario: Scenario) -> dict[str, Any]:
    """All but the effects."""
    return {name: getattr(scenario, name) for name in Scenario.model_fields if name != "model"}


class Errors(NamedTuple):
    """Rms errors over all outputs, in noise floors; NaN without such recordings."""

    fitted: float
    unseen: float


def errors_of(model: FittedModel, like: ModelVersion | None) -> Errors:
    """Errors of a model in the noise floors of another one, so that rows can be compared."""
    found = model.version.found
    if found is None:
        return Errors(math.nan, math.nan)
    step = step_like(found.step, like)
    return Errors(math.sqrt(step.cost_per_sample), validation_rms(step.errors))


class Evidence(NamedTuple):
    """For a model, against one noise; None where it was not fitted to its end."""

    criteria: InformationCriteria | None
    fall: float | None
    """Of BIC from the model before: more than 10 is very strong evidence for the last effect."""


def evidence_of(model: FittedModel, like: ModelVersion | None) -> Evidence:
    """The criteria of a model against the noise of another one, so that rows can be compared."""
    found = None if like is None else like.diagnosis
    noise, left = None if found is None else found.noise, _left(model.version)
    if noise is None or left is None:
        return Evidence(None, None)
    before = _left(model.way[-2]) if len(model.way) > 1 else None
    return Evidence(information_criteria(left, noise), fall_of_bic(before, left, noise))


def _left(version: ModelVersion) -> ErrorProducts | None:
    return None if version.found is None else version.found.step.left


def step_like(step: LadderStep, like: ModelVersion | None) -> LadderStep:
    """The step in the noise floors of another model."""
    errors = () if like is None or like.found is None else like.found.step.errors
    return step_in_floors(step, {e.channel: e.floor for e in errors})
