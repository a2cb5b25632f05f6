"""The versions of a session's model, and what they show together."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flexgui.core.results import MISSING, LinearModel, Outcome, ProposedLaw
from flexgui.stages.diagnose.model_versions import (
    ModelVersion,
    linear_model_of,
    proposed_laws,
    versions_before,
    with_versions,
)
from flexgui.views.headline import estimated_values

if TYPE_CHECKING:
    from flexgui.session.session import Session


class VersionHistory:
    """The way of a diagnosis from model to model."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.versions: tuple[ModelVersion, ...] = ()
        """The way so far, each step complete or stopped by the person."""
        self.pending: ModelVersion | None = None
        """The version that the worker diagnoses now."""

    @property
    def shown_versions(self) -> tuple[ModelVersion, ...]:
        """The way with what the worker has reported so far."""
        if self.pending is None or self.pending.found is None:
            return self.versions
        return (*versions_before(self.versions, self.pending), self.pending)

    @property
    def compared_versions(self) -> tuple[ModelVersion, ...]:
        """The same without one that was just fitted and whose comparison is still to come: its bar,
        its torque and the arm's colours change in one moment."""
        versions = self.shown_versions
        waits = len(versions) > 1 and not versions[-1].comparisons and versions[-2].comparisons
        return versions[:-1] if waits else versions

    def values_of(self, recording: str) -> dict[str, float]:
        """name -> value for a recording by the diagnosis' own fit of the present model, or of the
        one before while an effect is added to it; empty without one."""
        version, scenario = self.newest, self._session.document.scenario
        if version is None or version.found is None:
            return {}
        if version.scenario != scenario and self.pending is None:
            return {}
        return estimated_values(version.found.step.parameters, recording)

    @property
    def newest(self) -> ModelVersion | None:
        """The newest of them."""
        return next(reversed(self.shown_versions), None)

    @property
    def whole(self) -> Outcome | None:
        """The last result with what was found missing and added, as the report states it."""
        outcome, of = self._session.identification.outcome, self._session.identification.outcome_of
        last = self.versions[-1] if self.versions else None
        if outcome is None or last is None or last.scenario != of or outcome.diagnosis is not None:
            return outcome  # that of a run that was opened is whole
        return with_versions(outcome, self._session.comparison.shown, self.versions)

    @property
    def linear_model(self) -> LinearModel | None:
        """What the linear model costs, where the first model of the way was identified with it."""
        return linear_model_of(self.shown_versions)

    @property
    def known_biased(self) -> bool:
        """Whether an effect is known to be missing in the model of the last result."""
        of = self._session.identification.outcome_of
        same = [version.diagnosis for version in self.shown_versions if version.scenario == of]
        return any(found is not None and found.verdict == MISSING for found in same)

    @property
    def laws(self) -> tuple[ProposedLaw, ...]:
        """Those that are proposed for the model as it stands."""
        return proposed_laws(self.newest)
