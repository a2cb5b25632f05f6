"""What one effect would do to the arm, shown while a diagnosis goes on."""

from __future__ import annotations

from abc import ABC
from pathlib import Path

from flexgui.core.errors import InputError
from flexgui.core.results import MissingTorque
from flexgui.core.scenario.read import scenario_toml
from flexgui.jobs import Event, Failed, Finished, Job, WorkerLost
from flexgui.jobs.task import Task
from flexgui.scene.recorded import fitted_values
from flexgui.session.services import Services
from flexgui.session.state import Topic
from flexgui.stages.diagnose.demonstrate import demonstrate
from flexgui.stages.diagnose.diagnosing import Diagnosing
from flexgui.stages.diagnose.effects import present
from flexgui.stages.diagnose.looked import Demonstration

LEAST = 1e-9


class Demonstrating(Diagnosing, ABC):
    """One demonstration at a time, beside whatever else is computed; the newest wish wins."""

    def __init__(self, key: str, folder: Path) -> None:
        super().__init__(key, folder)
        self.demonstration: Demonstration | None = None
        self.demonstrated = ""
        """Id of the effect that is shown or will be; empty: none."""
        self.not_shown = ""
        """Why there is nothing to show, a sentence."""
        self._shower: Job | None = None

    def demonstrate(self, kind: str, services: Services) -> bool:
        """Simulates the recording under the cursor with and without the effect."""
        self.end_demonstration()
        scenario, names = self.scenario, [r.name for r in self.scenario.recordings]
        if not names:
            return self._cannot(kind, "There is no recording to show it on.")
        name = self.cursor.recording if self.cursor.recording in names else names[0]
        fitted = self.outcome if self.outcome_of == scenario else None
        task = Task.of(
            demonstrate, "The demonstration", scenario_toml=scenario_toml(scenario), kind=kind,
            recording=name, values=fitted_values(fitted, name), sizes=self._sizes(kind),
            floors=self.floors or {}, folder=str(self.folder),
        )  # fmt: skip
        with self._lock:
            self.demonstrated = kind
        try:
            job = services.pool.submit(self.key, task, lambda event: self._shown(kind, event))
        except InputError as error:
            return self._cannot(kind, str(error))
        with self._lock:
            self._shower = job
        self.notify(Topic.DEMONSTRATION)
        return True

    @property
    def torques_demonstrated(self) -> tuple[MissingTorque, ...]:
        """What the demonstrated effect would have to explain at the joints of its recording; empty
        where no diagnosis of the model without the effect has found it."""
        shown, look = self.demonstration, self.look
        if shown is None or look is None or not shown.torques:
            return ()
        if look.scenario != self.scenario or shown.kind in dict(present(look.scenario)):
            return ()
        found = [c for c in look.comparisons if c.recording == shown.recording]
        return found[0].missing_torque if found else ()

    def end_demonstration(self) -> None:
        """Shows none any more."""
        with self._lock:
            job, self._shower = self._shower, None
            self.demonstration, self.demonstrated, self.not_shown = None, "", ""
        if job is not None and not job.over:
            job.stop()
        self.notify(Topic.DEMONSTRATION)

    def _scenario_changed(self) -> None:
        super()._scenario_changed()
        if self.demonstrated:
            self.end_demonstration()

    def _cannot(self, kind: str, sentence: str) -> bool:
        with self._lock:
            self.demonstrated, self.not_shown = kind, sentence
        self.notify(Topic.DEMONSTRATION)
        return False

    def _sizes(self, kind: str) -> dict[str, float]:
        """That the ranking has found, where it has refitted the effect."""
        ranked = self.look.ranking if self.look is not None else ()
        found = next((r for r in ranked if r.effect == kind), None)
        sizes = {e.name: e.value for e in found.parameters} if found is not None else {}
        return sizes if any(abs(value) > LEAST for value in sizes.values()) else {}

    def _shown(self, kind: str, event: Event) -> None:
        if kind != self.demonstrated:
            return
        if isinstance(event, Finished):
            with self._lock:
                self.demonstration = event.result
            self.notify(Topic.DEMONSTRATION)
        elif isinstance(event, Failed | WorkerLost):
            self._cannot(kind, event.sentence)
