"""The identification, and the last good result."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flexgui.core.results import Outcome
from flexgui.core.scenario.read import scenario_toml
from flexgui.core.scenario.schema import Scenario
from flexgui.jobs import Event, Stopped, Task
from flexgui.session.edit import edited, put
from flexgui.session.run import Then
from flexgui.session.state import Topic
from flexgui.stages.identify.task import identify

if TYPE_CHECKING:
    from flexgui.session.session import Session


class Identification:
    """What was identified last, of which scenario."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.forget()

    def forget(self) -> None:
        """Another scenario follows."""
        self.outcome: Outcome | None = None
        """The last good result."""
        self.outcome_of: Scenario | None = None

    @property
    def current(self) -> Outcome | None:
        """The result, where it is of the scenario as it is now."""
        return self.outcome if self.outcome_of == self._session.document.scenario else None

    def take(self, outcome: Outcome | None, of: Scenario | None) -> None:
        """Another result, of the scenario `of`; the caller lets the subscribers know."""
        with self._session.lock:
            self.outcome, self.outcome_of = outcome, of

    def start(self, then: Then = None) -> bool:
        """Runs the scenario in the pool; `then` follows however it ends."""
        scenario = self._session.document.scenario
        # What is missing is looked for at a stage of its own.
        plain = edited(scenario, put(("diagnose",), None))
        arguments = {"scenario_toml": scenario_toml(plain), "folder": str(self._session.folder)}
        task = Task.of(identify, "The identification", **arguments)

        def on_event(event: Event) -> Then:
            self._identified(event, scenario)
            return then

        return self._session.run.submit("identify", task, on_event)

    def _identified(self, event: Event, scenario: Scenario) -> None:
        found = getattr(event, "result", None)
        if not isinstance(found, Outcome):
            return
        if isinstance(event, Stopped) and self.outcome is not None:
            self._session.show_message("Stopped; the last complete result is kept.")
            return
        self.take(found, scenario)
        self._session.notify(Topic.OUTCOME)
        if isinstance(event, Stopped):
            self._session.show_message("Stopped; the best found so far is shown.")
        self._session.playback.refresh()
