"""What could be missing, and a model that grows by it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from flexgui.core.errors import InputError
from flexgui.core.results import (
    Outcome,
    RecordingComparison,
)
from flexgui.core.results.identification import final_values
from flexgui.core.scenario.schema import Scenario
from flexgui.jobs import Event, Finished, Partial, Stopped, Task
from flexgui.jobs.messages import Ended
from flexgui.session.running_job import AfterEnd
from flexgui.session.scenario_edits import Edit, apply_edits, cached_model, set_value, with_lists
from flexgui.session.state import BUSY, Topic
from flexgui.stages.diagnose.effects import (
    of_formula,
    present,
    ranked_with_own,
    titled,
    with_effect,
    with_law,
    with_own,
    without_effect,
    without_events,
)
from flexgui.stages.diagnose.fitted_models import FittedModels
from flexgui.stages.diagnose.model_versions import (
    ModelFindings,
    ModelVersion,
    last_step_sentence,
    proposed_events,
    stopped_sentence,
    versions_before,
)
from flexgui.stages.diagnose.task import AFTER, BEFORE, COMPARED, diagnose, propose_laws
from flexgui.stages.diagnose.version_history import VersionHistory

if TYPE_CHECKING:
    from flexgui.session.session import Session


class Diagnosis(VersionHistory):
    """One version per change of the model; the last complete one survives any newer one."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self._then: AfterEnd = None
        """What is done once the worker has stopped."""
        self.formulas: dict[str, tuple[str, str, str]] = {}
        """Own effects that were tried, by their id: target, formula, parameters."""
        self.models = FittedModels(session)
        self.reset()

    def reset(self) -> None:
        """Another scenario follows."""
        self.versions, self.pending = (), None
        self._started = 0.0
        """When the running diagnosis was started, s (Unix time)."""

    @property
    def _estimated(self) -> dict[str, float]:
        """label -> value of the last identification."""
        outcome = self._session.identification.outcome
        return {} if outcome is None else final_values(outcome.fits)

    def search(self) -> bool:
        """Searches for what the scenario's model lacks."""
        scenario = self._session.document.scenario
        last = next((k for k in reversed(self.versions) if k.scenario == scenario), None)
        version = ModelVersion(scenario) if last is None else replace(last, found=None)
        is_identified = self._session.identification.current is not None
        return self._diagnose(version, "" if is_identified else AFTER, scenario)

    def add(self, kind: str) -> bool:
        """Puts a listed effect into the model and fits it; a ranking that still goes on ends."""
        if self._session.run.busy and self.pending is not None and self.pending.found is not None:
            return self._after_stop(partial(self.add, kind), titled([kind])[0])
        ranking = self.newest.ranking if self.newest else ()
        findings = next((r for r in ranking if r.effect == kind), None)
        if kind in self.formulas:
            return self.add_own(*self.formulas[kind])
        try:
            return self._go_on(with_effect(kind, findings), titled([kind])[0], kind)
        except InputError as error:
            return self._session.refuse(error)

    def _after_stop(self, then: Callable[[], object], title: str) -> bool:
        """Stops what is computed, and adds what has this title afterwards."""

        def add() -> None:
            then()
            self.to_add = ""

        self._then, self.to_add = add, title
        self._session.run.stop()
        self._session.notify(Topic.DIAGNOSIS)
        return True

    def add_own(self, target: str, formula: str, parameters: str) -> bool:
        """Puts a formula into the model and fits it; says what is wrong with it."""
        try:
            edit = with_own(target, formula, parameters)
        except InputError as error:
            return self._session.refuse(error)
        kind = self._add_last(edit)
        if kind:
            self.formulas[kind] = (target, formula, parameters)
        return bool(kind)

    def _add_last(self, edit: Edit) -> str:
        """Makes an edit that adds an own effect, and fits the model; its id, or '' if refused."""
        try:
            kind, title = present(apply_edits(self._session.document.scenario, edit))[-1]
            return kind if self._go_on(edit, title, kind) else ""
        except InputError as error:
            self._session.refuse(of_formula(str(error)))
            return ""

    def add_law(self, number: int) -> bool:
        """Puts a proposed law, from 0, into the model and fits it; what is still computed on the
        model as it was ends."""
        laws = self.laws
        if number >= len(laws):
            return False
        add = partial(self._add_last, with_law(laws[number]))
        if self._session.run.busy and self.pending is not None:
            return self._after_stop(add, laws[number].title)
        return bool(add())

    def leave_out(self) -> bool:
        """States the recordings without what happened once in them, and diagnoses what is left."""
        events = proposed_events(self.newest)
        edit = without_events(events)
        return bool(events) and self._session.document.change(edit) and self.search()

    def propose(self) -> bool:
        """Looks for laws for what the model leaves."""
        version = self.newest
        if version is None or version.found is None or version.diagnosis is None:
            return False
        fitted = self._session.identification
        before = (version.scenario, fitted.outcome, fitted.outcome_of)
        task = Task.of(
            propose_laws, "The search for a law", identified=self._estimated, found=version.found,
            scenario=version.scenario, folder=str(self._session.folder),
        )  # fmt: skip
        return self._submit(version, task, before)

    def remove(self, kind: str) -> bool:
        """Takes an effect out of the model and fits what is left."""
        scenario = self._session.document.scenario
        title = dict(present(scenario)).get(kind, kind)
        last = self.versions[-1] if self.versions else None
        is_last = last is not None and last.added == kind and last.scenario == scenario
        if is_last and len(self.versions) > 1:
            return self.undo()
        return self._go_on(without_effect(kind), f"without: {title}", None)

    def undo(self) -> bool:
        """One step back on the way; nothing is computed."""
        *before, undone = self.versions or (None,)
        if not before or undone is None:
            return self._session.refuse("There is no step to undo.")
        return self._stand_at(tuple(before), f"Undone: {undone.title}.")

    def return_to(self, number: int) -> bool:
        """Makes another of the session's models the present one, with the settings that it was made
        with; nothing is computed."""
        model = next((m for m in self.models.listed if m.number == number), None)
        if model is None:
            return False
        if model in self.models.comparable:
            return self._stand_at(model.way, f"Back to: {model.title}.")
        return self._session.go_to(model.version.scenario)

    def _stand_at(self, way: tuple[ModelVersion, ...], message: str) -> bool:
        """Makes the last of a way's versions the present model."""
        with self._session.run.start_lock:
            if self._session.run.busy:
                return self._session.refuse(BUSY)
            model = with_lists(way[-1].scenario.model_dump(exclude_defaults=True)).get("model")
        if not self._session.document.change(set_value(("model",), model)):
            return False
        with self._session.changing(Topic.DIAGNOSIS, Topic.OUTCOME):
            self.versions = way
            self.models.take_up(way[-1])
        self._session.playback.refresh()
        self._session.show_message(message)
        return True

    def _go_on(self, edit: Edit, title: str, added: str | None) -> bool:
        """Changes the model and diagnoses it."""
        with self._session.run.start_lock:
            if self._session.run.busy:
                return self._session.refuse(BUSY)
            before = self._session.document.scenario
            cached_model(apply_edits(before, edit))
            if not self._session.document.change(edit):
                return False
            self._session.show_message("")
            version = ModelVersion(self._session.document.scenario, title, added)
            if self._diagnose(version, BEFORE, before):
                self._session.playback.refresh()  # by the last fit until there is another
                return True
            fitted = self._session.identification
            self._restore(before, fitted.outcome, fitted.outcome_of)
        return False

    def _diagnose(self, version: ModelVersion, fit: str, was: Scenario) -> bool:
        fitted = self._session.identification
        before = (was, fitted.outcome, fitted.outcome_of)
        task = Task.of(
            diagnose, "The search for what is missing", fit=fit, identified=self._estimated,
            scenario=version.scenario, folder=str(self._session.folder),
        )  # fmt: skip

        return self._submit(version, task, before)

    def _submit(
        self, version: ModelVersion, task: Task,
        before: tuple[Scenario, Outcome | None, Scenario | None],
    ) -> bool:  # fmt: skip
        """Begins a task on a version, which stands as `pending` until it ends."""

        def on_event(event: Event) -> AfterEnd:
            if isinstance(event, Ended):
                return self._over(event, before)
            if isinstance(event, Partial) and event.name == COMPARED:
                self._compared(event.value)
            elif isinstance(event, Partial):
                self._take_partial(event.value)
            return None

        with (
            self._session.run.start_lock
        ):  # or a second call at the same moment replaces this version
            if self._session.run.busy:
                return self._session.refuse(BUSY)
            self.pending, self._then, self._started = version, None, time.time()
            done = self._session.run.submit("diagnose", task, on_event)
            if not done:
                self.pending = None
        return done

    def _take_partial(self, findings: ModelFindings) -> None:
        """A first or a finer picture."""
        with self._session.lock:
            if self.pending is None:
                return
            fresh = findings.outcome is not None and self.pending.outcome is not findings.outcome
            version = self.pending = replace(self.pending, found=findings)
            if fresh and findings.outcome is not None:
                self._session.identification.take(findings.outcome, version.scenario)
                self.pending = replace(version, outcome=findings.outcome)
        self._session.notify(Topic.DIAGNOSIS)
        if fresh:
            self._session.notify(Topic.OUTCOME)
            self._session.playback.refresh()

    def _compared(self, comparisons: tuple[RecordingComparison, ...]) -> None:
        """Measured against the fit of the version."""
        with self._session.lock:
            if self.pending is not None:
                self.pending = replace(self.pending, comparisons=comparisons)
        _ = self._session.comparison.failing  # worked out here: whoever draws has others waiting
        self._session.notify(Topic.DIAGNOSIS)
        self._session.playback.refresh()

    def _over(
        self, event: Ended, before: tuple[Scenario, Outcome | None, Scenario | None]
    ) -> AfterEnd:
        """Keeps what was found; without anything the state is what it was before."""
        result = getattr(event, "result", None)
        if isinstance(result, ModelFindings):
            self._take_partial(result)
        with self._session.lock:
            version, self.pending = self.pending, None
        if version is None:
            return None
        kept = self._worth_keeping(version, event)
        if kept:
            self._keep(version)
        else:
            self._restore(*before)
        self._session.notify(Topic.DIAGNOSIS)
        if self._then is None and isinstance(event, Stopped):
            self._session.show_message(stopped_sentence(kept, bool(self.versions)))
        elif self._then is None and isinstance(event, Finished):
            self._session.show_message(last_step_sentence(self.versions) if version.title else "")
        return self._then

    def _worth_keeping(self, version: ModelVersion, event: Ended) -> bool:
        """A complete version always; a stopped one where there is no complete one of it."""
        if isinstance(event, Finished):
            return version.found is not None
        complete = any(k.scenario == version.scenario and k.diagnosis for k in self.versions)
        return isinstance(event, Stopped) and version.found is not None and not complete

    def _keep(self, version: ModelVersion) -> None:
        with self._session.lock:
            fitted = self._session.identification
            outcome = fitted.outcome if fitted.outcome_of == version.scenario else None
            before = versions_before(self.versions, version)
            if before and version.added in self.formulas:
                before = (*before[:-1], ranked_with_own(before[-1], version))
            self.versions = (*before, replace(version, outcome=outcome))
            self.models.add(self.versions, time.time() - self._started)

    def _restore(
        self, scenario: Scenario, outcome: Outcome | None, outcome_of: Scenario | None
    ) -> None:
        model = with_lists(scenario.model_dump(exclude_defaults=True)).get("model")
        if scenario.model != self._session.document.scenario.model:
            self._session.document.change(set_value(("model",), model))
        with self._session.changing(Topic.OUTCOME):
            self._session.identification.take(outcome, outcome_of)
