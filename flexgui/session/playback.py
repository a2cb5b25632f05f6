"""The recording and motion that the page plays, and the thread that moves the cursor."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from flexgui.core.errors import InputError
from flexgui.core.recording.recording import Recording
from flexgui.core.results import Outcome
from flexgui.core.scenario.data_folder import ConfinedFolder
from flexgui.core.scenario.schema import Scenario
from flexgui.jobs.file_jobs import run_task
from flexgui.jobs.messages import Task
from flexgui.scene import recorded_motion
from flexgui.scene.recorded_motion import load_motion
from flexgui.session.scheduling import LatestRequest
from flexgui.session.state import STAGES, Cursor, PagePart, Topic
from flexgui.views.headline import fitted_values

if TYPE_CHECKING:
    from flexgui.session.session import Session

RATE = 25.0
"""Frames per second; the page draws arm and cursor at each."""
MOST_PLAYED_SAMPLES = 30_000
"""Samples, as in the paper (3 s at 0.1 ms): simulated in half a second with a few MB."""


class Playback:
    """The cursor of the arm, the measured arm and the plots."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.cursor = Cursor()
        self.recording: Recording | None = None
        """The recording under the cursor, by the present scenario."""
        self.motion: recorded_motion.RecordedMotion | None = None
        self._recording_key: tuple[str, Scenario] | None = None
        self._worker = LatestRequest(session.faults, PagePart.PLAYBACK)
        self._refresh_pending = False
        """Whether the motion is computed when another stage is shown."""
        self._thread_runs = False
        """Whether a thread moves the cursor."""

    def reset(self) -> None:
        """Clears recording and motion: another scenario was opened."""
        self.recording, self.motion, self.cursor = None, None, Cursor()

    def move(self, **changes: Any) -> None:
        """Changes fields of the cursor: time, playing, speed, recording."""
        with self._session.lock:
            before, self.cursor = self.cursor, replace(self.cursor, **changes)
            starts = self.cursor.playing and not self._thread_runs
            self._thread_runs = self._thread_runs or starts
        if before.recording != self.cursor.recording:
            self.refresh()
        if starts:
            threading.Thread(target=self._play, name="player", daemon=True).start()
        self._session.notify(Topic.CURSOR)

    def seek(self, time: float) -> None:
        """Moves the cursor to a time in s, within the recording, and pauses."""
        end = 0.0 if self.motion is None else self.motion.seconds
        self.move(time=min(max(time, 0.0), end), playing=False)

    def _play(self) -> None:
        """The thread that moves the cursor while a recording plays."""
        last = time.monotonic()
        while True:
            time.sleep(1.0 / RATE)
            now = time.monotonic()
            with self._session.lock:
                cursor = self.cursor
                if not cursor.playing or self._session.closed:
                    self._thread_runs = False
                    return
            with self._session.faults.watch(PagePart.CURSOR):
                self.advance((now - last) * cursor.speed)
            last = now

    def advance(self, seconds: float) -> None:
        """Moves the cursor on by `seconds`; starts again at the end."""
        with self._session.lock:
            if self.motion is None:
                return
            end = self.motion.seconds
            time = self.cursor.time + seconds
            self.cursor = replace(self.cursor, time=time if 0.0 <= time <= end else 0.0)
        self._session.notify(Topic.CURSOR)

    def scenario_changed(self) -> None:
        """Computes the motion again; on the first stage, which does not show it, later."""
        if self._session.stage == STAGES[0]:
            self._refresh_pending = True
        else:
            self.refresh()

    def stage_changed(self) -> None:
        """Computes a pending motion."""
        if self._refresh_pending:
            self.refresh()

    def refresh(self) -> None:
        """Simulates or reads the recording under the cursor and computes its motion, soon."""
        self._refresh_pending = False
        self._worker.request(self._compute)

    def wait_idle(self, timeout: float) -> bool:
        """Whether the motion is up to date within `timeout` s."""
        return self._worker.wait_idle(timeout)

    def close(self) -> None:
        """Computes nothing more."""
        self._worker.close()

    def _compute(self) -> None:
        with self._session.lock:
            scenario, name = self._session.document.scenario, self.cursor.recording
            before, fitted = self._recording_key, self._session.identification.current
        names = [spec.name for spec in scenario.recordings]
        if not names:
            with self._session.changing(Topic.RECORDINGS, Topic.CURSOR):
                self.recording, self._recording_key, self.motion = None, None, None
            return
        name = name if name in names else names[0]
        if self._session.recordings.imports.missing:
            return  # the files of a scenario come after it
        try:
            key = (name, _data_part(scenario))
            cached = self.recording if key == before else None
            recording, motion = self._motion_of(scenario, name, fitted, cached)
        except InputError as error:
            self._refresh_pending = True  # again on the next stage: a worker may have been lost
            self._session.show_message(str(error), bad=True)
            return
        with self._session.changing(Topic.RECORDINGS, Topic.CURSOR):
            self.recording, self._recording_key, self.motion = recording, key, motion
            if self.cursor.recording != name:
                self.cursor = replace(self.cursor, recording=name, time=0.0)

    def _motion_of(
        self, scenario: Scenario, name: str, fitted: Outcome | None, cached: Recording | None
    ) -> tuple[Recording, recorded_motion.RecordedMotion]:
        """The recording (`cached` if given) and its motion; long ones are made in a worker."""
        values = fitted_values(fitted, name) or self._session.diagnosis.values_of(name)
        if not _short(scenario, name):
            arguments = {"recording": name, "folder": str(self._session.folder), "values": values}
            task = Task.of(load_motion, f"Recording {name}", scenario=scenario, **arguments)
            read, motion = run_task(self._session.key, task)
            return cached or read, motion
        folder = ConfinedFolder(self._session.folder)
        recording = cached or recorded_motion.read_recording(scenario, name, folder)
        return recording, recorded_motion.simulated_motion(scenario, values, recording)


def _short(scenario: Scenario, name: str) -> bool:
    simulate = next((s.simulate for s in scenario.recordings if s.name == name), None)
    return simulate is not None and simulate.samples <= MOST_PLAYED_SAMPLES


def _data_part(scenario: Scenario) -> Scenario:
    """What recordings depend on: the scenario without the identification's settings."""
    plain = Scenario(title="-", arm=scenario.arm)
    return scenario.model_copy(
        update={"title": "-", "identify": plain.identify, "compare": (), "model": plain.model}
    )
