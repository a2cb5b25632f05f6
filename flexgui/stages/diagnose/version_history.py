"""The versions of a session's model, and what they show together."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from flexgui.core.results import MISSING, LinearModel, Outcome, ProposedLaw, RankedEffect
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
        self.to_add = ""
        """Title of the effect that is added once a ranking has been ended for it."""

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

    @property
    def expected(self) -> tuple[str, float] | None:
        """Title of the effect that is being added and the error, in noise floors, that its ranking
        predicts; None where nothing is added or its fit is shown."""
        pending, shown = self.pending, self.compared_versions
        if pending is None or not shown or shown[-1].found is None:
            return None
        title = self.to_add or (pending.title if pending is not shown[-1] else "")
        ranked = next((r for r in shown[-1].ranking if r.title == title), None)
        return None if ranked is None else (title, _expected_error(shown[-1], ranked))

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


def _expected_error(version: ModelVersion, ranked: RankedEffect) -> float:
    """Noise floors that are left of a version's error by what an effect explains of it."""
    refitted, screened = ranked.refit_drop_percent, ranked.expected_drop_percent
    share = (screened if refitted is None else refitted) / 100.0
    square = version.error**2
    return math.sqrt(square - share * max(square - 1.0, 0.0))
