"""What could be missing, and a model that grows by it."""

from __future__ import annotations

from abc import ABC
from dataclasses import replace
from functools import partial
from pathlib import Path

from flexgui.core.errors import InputError
from flexgui.core.results import Outcome, RecordingComparison
from flexgui.core.scenario.read import scenario_toml
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.jobs import Event, Finished, Partial, Stopped, Task
from flexgui.jobs.events import Ended
from flexgui.sentences.figures import times
from flexgui.session.edit import Edit, edited, put, thawed
from flexgui.session.running import Then
from flexgui.session.services import Services
from flexgui.session.state import Topic
from flexgui.stages.compare.comparing import Comparing
from flexgui.stages.diagnose.effects import (
    present,
    ranked_with_own,
    titled,
    with_effect,
    with_own,
    without_effect,
)
from flexgui.stages.diagnose.look import Look, last_change, worse
from flexgui.stages.diagnose.looked import Looked
from flexgui.stages.diagnose.task import AFTER, BEFORE, COMPARED, diagnose

BUSY = "Something is being computed already; stop it or wait."


class Diagnosing(Comparing, ABC):
    """One look per model; the last complete one survives whatever happens to a newer one."""

    def __init__(self, key: str, folder: Path) -> None:
        super().__init__(key, folder)
        self._then: Then = None
        """What is done once the worker has stopped."""
        self.to_add = ""
        """Title of the effect that is added once a ranking has been ended for it."""
        self._formulas: dict[str, tuple[str, str, str]] = {}
        """Own effects that were tried, by their id: target, formula, parameters."""

    def diagnose(self, services: Services) -> bool:
        """Looks for what the scenario's model lacks."""
        known = self.outcome is not None and self.outcome_of == self.scenario
        last = next((k for k in reversed(self.looks) if k.scenario == self.scenario), None)
        look = Look(self.scenario) if last is None else replace(last, found=None)
        return self._look_at(look, services, "" if known else AFTER, self.scenario)

    def add(self, kind: str, services: Services) -> bool:
        """Puts a listed effect into the model and fits it; a ranking that still goes on ends."""
        if self.busy and self.pending is not None and self.pending.found is not None:
            self._then = partial(self._add_now, kind, services)
            self.to_add = titled([kind])[0]
            self.stop()
            self.notify(Topic.DIAGNOSIS)
            return True
        found = (
            next((r for r in self.look.ranking if r.effect == kind), None) if self.look else None
        )
        if kind in self._formulas:
            return self.add_own(*self._formulas[kind], services)
        try:
            return self._go_on(with_effect(kind, found), titled([kind])[0], kind, services)
        except InputError as error:
            return self.refuse(error)

    def _add_now(self, kind: str, services: Services) -> None:
        self.add(kind, services)
        self.to_add = ""

    def add_own(self, target: str, formula: str, parameters: str, services: Services) -> bool:
        """Puts a formula into the model and fits it; says what is wrong with it."""
        try:
            edit = with_own(target, formula, parameters)
            kind, title = present(edited(self.scenario, edit))[-1]
            done = self._go_on(edit, title, kind, services)
        except InputError as error:
            return self.refuse(error)
        if done:
            self._formulas[kind] = (target, formula, parameters)
        return done

    def remove(self, kind: str, services: Services) -> bool:
        """Takes an effect out of the model and fits what is left."""
        title = dict(present(self.scenario)).get(kind, kind)
        last = self.looks[-1] if self.looks else None
        if last is not None and last.added == kind and last.scenario == self.scenario:
            return self.undo()
        return self._go_on(without_effect(kind), f"without: {title}", None, services)

    def undo(self) -> bool:
        """One step back on the way; nothing is computed."""
        with self._beginning:
            if self.busy or len(self.looks) < 2:
                return self.refuse(BUSY if self.busy else "There is no step to undo.")
            back = self.looks[-2]
            model = thawed(back.scenario.model_dump(exclude_defaults=True)).get("model")
        if not self.change(put(("model",), model)):
            return False
        with self._lock:
            undone, self.looks = self.looks[-1], self.looks[:-1]
            if back.outcome is not None and back.scenario == self.scenario:
                self.outcome, self.outcome_of = back.outcome, back.scenario
        self.notify(Topic.DIAGNOSIS, Topic.OUTCOME)
        self.refresh_playback()
        self.show_message(f"Undone: {undone.title}.")
        return True

    def _go_on(self, edit: Edit, title: str, added: str | None, services: Services) -> bool:
        """Changes the model and looks at it."""
        with self._beginning:
            if self.busy:
                return self.refuse(BUSY)
            before = self.scenario
            base_model(edited(before, edit))
            if not self.change(edit):
                return False
            look = Look(self.scenario, title, added)
            if self._look_at(look, services, BEFORE, before):
                return True
            self._restore(before, self.outcome, self.outcome_of)
        return False

    def _look_at(self, look: Look, services: Services, fit: str, was: Scenario) -> bool:
        before = (was, self.outcome, self.outcome_of)
        arguments = {
            "scenario_toml": scenario_toml(look.scenario), "folder": str(self.folder), "fit": fit,
        }  # fmt: skip
        task = Task.of(diagnose, "The search for what is missing", **arguments)

        def on_event(event: Event) -> Then:
            if isinstance(event, Ended):
                return self._over(event, before)
            if isinstance(event, Partial) and event.name == COMPARED:
                self._compared(event.value)
            elif isinstance(event, Partial):
                self._take_partial(event.value)
            return None

        with self._beginning:  # or who comes at the same moment takes the look away
            if self.busy:
                return self.refuse(BUSY)
            self.pending, self._then = look, None
            done = self._submit(services, "diagnose", task, on_event)
            if not done:
                self.pending = None
        return done

    def _take_partial(self, found: Looked) -> None:
        """A first or a finer picture."""
        with self._lock:
            if self.pending is None:
                return
            fresh = found.outcome is not None and self.pending.outcome is not found.outcome
            look = self.pending = replace(self.pending, found=found)
            if fresh and found.outcome is not None:
                self.outcome, self.outcome_of = found.outcome, look.scenario
                self.pending = replace(look, outcome=found.outcome)
        self.notify(Topic.DIAGNOSIS)
        if fresh:
            self.notify(Topic.OUTCOME)
            self.refresh_playback()

    def _compared(self, found: tuple[RecordingComparison, ...]) -> None:
        """Measured against the fit that the look is about."""
        with self._lock:
            if self.pending is not None:
                self.pending = replace(self.pending, comparisons=found)
        _ = self.failing  # worked out here: whoever draws has others waiting
        self.notify(Topic.DIAGNOSIS)

    def _over(self, event: Ended, before: tuple[Scenario, Outcome | None, Scenario | None]) -> Then:
        """Keeps what was found; without anything the state is what it was before."""
        found = getattr(event, "result", None)
        if isinstance(found, Looked):
            self._take_partial(found)
        with self._lock:
            look, self.pending = self.pending, None
        if look is None:
            return None
        kept = self._worth_keeping(look, event)
        if kept:
            self._keep(look)
        else:
            self._restore(*before)
        self.notify(Topic.DIAGNOSIS)
        if self._then is None and isinstance(event, Stopped):
            self.show_message(_stopped(kept, bool(self.looks)))
        elif self._then is None and isinstance(event, Finished) and look.title:
            self.show_message(self._fallen(), bad=worse(self.looks))
        return self._then

    def _worth_keeping(self, look: Look, event: Ended) -> bool:
        """A complete look always; one that was stopped where there is no complete one of it."""
        if isinstance(event, Finished):
            return look.found is not None
        complete = any(k.scenario == look.scenario and k.diagnosis for k in self.looks)
        return isinstance(event, Stopped) and look.found is not None and not complete

    def _keep(self, look: Look) -> None:
        with self._lock:
            outcome = self.outcome if self.outcome_of == look.scenario else None
            before = self._before(look)
            if before and look.added in self._formulas:
                before = (*before[:-1], ranked_with_own(before[-1], look))
            self.looks = (*before, replace(look, outcome=outcome))

    def _restore(
        self, scenario: Scenario, outcome: Outcome | None, outcome_of: Scenario | None
    ) -> None:
        model = thawed(scenario.model_dump(exclude_defaults=True)).get("model")
        if scenario.model != self.scenario.model:
            self.change(put(("model",), model))
        with self._lock:
            self.outcome, self.outcome_of = outcome, outcome_of
        self.notify(Topic.OUTCOME)

    def _fallen(self) -> str:
        """How the error changed in the last step."""
        last, change = self.looks[-1], last_change(self.looks)
        if change is None:
            return f"{last.title}: the error is {times(last.error)} the noise floor."
        return f"{last.title}: the error went {change.words}."


def _stopped(kept: bool, any_left: bool) -> str:
    if kept:
        return "Stopped; what was found so far is shown."
    return "Stopped; the last complete result is kept." if any_left else "Stopped."
