"""All models that were fitted in a session, to compare and to return to."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from flexgui.core.information_criteria import fall_of_bic, information_criteria
from flexgui.core.results import ErrorProducts, InformationCriteria, LadderStep
from flexgui.core.scenario.schema import Scenario
from flexgui.sentences.figures import validation_rms
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
    """From 1, in the order in which they were fitted first."""
    made: float
    """When it was fitted last, s (Unix time)."""
    seconds: float = 0.0
    """That fit and diagnosis took."""
    name: str = ""
    """A person's own; empty: after its effects."""

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
    """All models of a session, also those that were undone, and the one that is drawn beside."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.reset()

    def reset(self) -> None:
        """Another scenario follows."""
        self.all: tuple[FittedModel, ...] = ()
        self._beside: int | None = None

    @property
    def comparable(self) -> tuple[FittedModel, ...]:
        """Those that differ from the present model in their effects only."""
        now = _settings(self._session.document.scenario)
        return tuple(m for m in self.all if _settings(m.version.scenario) == now)

    @property
    def present(self) -> FittedModel | None:
        """The one that stands now."""
        last = next(reversed(self._session.diagnosis.versions), None)
        return next((m for m in self.all if last and m.version.scenario == last.scenario), None)

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
        its name."""
        known = next((m for m in self.all if m.version.scenario == way[-1].scenario), None)
        number = 1 + max((m.number for m in self.all), default=0)
        fitted = FittedModel(way, number, time.time(), seconds)
        if known is not None:
            fitted = replace(fitted, number=known.number, name=known.name)
        others = [m for m in self.all if m is not known][1 - MOST_MODELS :]
        self.all = tuple(sorted([*others, fitted], key=lambda m: m.number))


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
