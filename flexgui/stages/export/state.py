"""What a person takes away: the report, and the plan of the next experiments."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from flexgui.core.errors import InputError
from flexgui.jobs import Task
from flexgui.session.scenario_edits import ScenarioDict, apply_edits, set_value
from flexgui.session.state import Topic
from flexgui.stages.export.task import Planned, export, plan_next

if TYPE_CHECKING:
    from flexgui.session.session import Session


class Export:
    """Made in the pool, from the last result."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.reset()

    def reset(self) -> None:
        """Another scenario follows."""
        self.planned = Planned()

    def report(self, done: Callable[[Path], None]) -> bool:
        """Writes the export of the last result in the pool; `done` gets its folder."""
        outcome, scenario = self._session.diagnosis.whole, self._session.identification.outcome_of
        if outcome is None or scenario is None:
            return self._session.refuse("There is no result yet; identify first.")
        out = self._session.folder / "export"
        where = {"folder": str(self._session.folder), "out": str(out)}
        task = Task.of(export, "The report", outcome=outcome, scenario=scenario, **where)
        return self._session.run.start_export(task, lambda _: done(out))

    def plan(self, seconds: float, limits: ScenarioDict, done: Callable[[Path], None]) -> bool:
        """Plans the next experiments, `seconds` together, in the pool; `done` gets the folder of
        their files.

        `limits` are a scenario's `[limits]`; a wrong one is said.
        """
        try:
            plain = apply_edits(
                self._session.document.scenario, set_value(("limits",), limits or None)
            )
        except InputError as error:
            return self._session.refuse(error)
        out = self._session.folder / "plan"
        where = {"folder": str(self._session.folder), "out": str(out)}
        task = Task.of(plan_next, "The plan", scenario=plain, seconds=seconds, **where)

        def show(planned: Planned) -> None:
            with self._session.changing(Topic.OUTCOME):
                self.planned = planned
            done(out)

        return self._session.run.start_export(task, show, "plan")
