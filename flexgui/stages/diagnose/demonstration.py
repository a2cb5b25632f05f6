"""What one effect would do to the arm, shown while a diagnosis goes on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flexgui.core.errors import InputError
from flexgui.core.results import MissingTorque
from flexgui.jobs import Event, Failed, Finished, Job, WorkerLost
from flexgui.jobs.task import Task
from flexgui.scene.recorded import fitted_values
from flexgui.session.state import Topic
from flexgui.stages.diagnose.demonstrate import demonstrate
from flexgui.stages.diagnose.effects import present
from flexgui.stages.diagnose.look import Demonstration

if TYPE_CHECKING:
    from flexgui.session.session import Session

LEAST = 1e-9


class Demonstrations:
    """One demonstration at a time, beside whatever else is computed; the newest wish wins."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.shown: Demonstration | None = None
        self.kind = ""
        """Id of the effect that is shown or will be; empty: none."""
        self.not_shown = ""
        """Why there is nothing to show, a sentence."""
        self._shower: Job | None = None

    def start(self, kind: str) -> bool:
        """Simulates the recording under the cursor with and without the effect."""
        self.end()
        scenario = self._session.document.scenario
        names = [spec.name for spec in scenario.recordings]
        if not names:
            return self._cannot(kind, "There is no recording to show it on.")
        cursor = self._session.playback.cursor
        name = cursor.recording if cursor.recording in names else names[0]
        fitted = self._session.identification.current
        task = Task.of(
            demonstrate, "The demonstration", scenario=scenario, kind=kind,
            recording=name, values=fitted_values(fitted, name), sizes=self._sizes(kind),
            floors=self._session.comparison.floors or {}, folder=str(self._session.folder),
        )  # fmt: skip
        with self._session.lock:
            self.kind = kind
        try:
            pool = self._session.services.pool
            job = pool.submit(self._session.key, task, lambda event: self._hear(kind, event))
        except InputError as error:
            return self._cannot(kind, str(error))
        with self._session.lock:
            self._shower = job
        self._session.notify(Topic.DEMONSTRATION)
        return True

    @property
    def torques(self) -> tuple[MissingTorque, ...]:
        """What the demonstrated effect would have to explain at the joints of its recording; empty
        where no diagnosis of the model without the effect has found it."""
        shown, look = self.shown, self._session.diagnosis.look
        if shown is None or look is None or not shown.torques:
            return ()
        scenario = self._session.document.scenario
        if look.scenario != scenario or shown.kind in dict(present(scenario)):
            return ()
        found = [c for c in look.comparisons if c.recording == shown.recording]
        return found[0].missing_torque if found else ()

    def end(self) -> None:
        """Shows none any more."""
        with self._session.lock:
            job, self._shower = self._shower, None
            self.shown, self.kind, self.not_shown = None, "", ""
        if job is not None and not job.over:
            job.stop()
        self._session.notify(Topic.DEMONSTRATION)

    def scenario_changed(self) -> None:
        """What is shown is of another arm by now."""
        if self.kind:
            self.end()

    def _cannot(self, kind: str, sentence: str) -> bool:
        with self._session.lock:
            self.kind, self.not_shown = kind, sentence
        self._session.notify(Topic.DEMONSTRATION)
        return False

    def _sizes(self, kind: str) -> dict[str, float]:
        """That the ranking has found, where it has refitted the effect."""
        look = self._session.diagnosis.look
        ranked = () if look is None else look.ranking
        found = next((r for r in ranked if r.effect == kind), None)
        sizes = {e.name: e.value for e in found.parameters} if found is not None else {}
        return sizes if any(abs(value) > LEAST for value in sizes.values()) else {}

    def _hear(self, kind: str, event: Event) -> None:
        if kind != self.kind:
            return
        if isinstance(event, Finished):
            with self._session.lock:
                self.shown = event.result
            self._session.notify(Topic.DEMONSTRATION)
        elif isinstance(event, Failed | WorkerLost):
            self._cannot(kind, event.sentence)
