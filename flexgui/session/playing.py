"""The motion that a page plays, and the thread that moves its cursor."""

from __future__ import annotations

import threading
import time
from abc import ABC
from dataclasses import replace
from pathlib import Path
from typing import Any

from flexgui.core.errors import InputError
from flexgui.core.recording.recording import Recording
from flexgui.core.results import Outcome
from flexgui.core.scenario.data_folder import Within
from flexgui.core.scenario.schema import Scenario
from flexgui.jobs.inputs import ask
from flexgui.jobs.task import Task
from flexgui.places import without_places
from flexgui.scene.recorded import Playback, fitted_values, played, read_one
from flexgui.session.editing import Editing
from flexgui.session.latest import LatestWins
from flexgui.session.state import STAGES, Cursor, Part, Topic
from flexgui.stages.data.task import play

SHORT = 30_000
"""Samples, as the paper has them (3 s at 0.1 ms): simulated in half a second with a few MB."""


class Playing(Editing, ABC):
    """One cursor for the arm, its ghost and the plots."""

    def __init__(self, key: str, folder: Path) -> None:
        super().__init__(key)
        self.key, self.folder = key, folder
        self.cursor = Cursor()
        self.recording: Recording | None = None
        """The one under the cursor, as the scenario states it now."""
        self.playback: Playback | None = None
        self.outcome: Outcome | None = None
        """The last good result."""
        self.outcome_of: Scenario | None = None
        self.closed = False
        self._recording_key: tuple[str, Scenario] | None = None
        self._motion_worker = LatestWins(self.faults, Part.PLAYBACK)
        self._playback_waits = False
        self._player = Player(self)

    def show_message(self, text: str, bad: bool = False) -> None:
        """A sentence for the person, which does not say where the server keeps what."""
        super().show_message(without_places(text, self.folder), bad)

    def set_cursor(self, **changes: Any) -> None:
        """Moves the cursor, plays, changes speed or recording."""
        with self._lock:
            before, self.cursor = self.cursor, replace(self.cursor, **changes)
        if before.recording != self.cursor.recording:
            self.refresh_playback()
        self._player.wake()
        self.notify(Topic.CURSOR)

    def advance(self, seconds: float) -> None:
        """Moves the cursor on; at the end it starts again."""
        with self._lock:
            if self.playback is None:
                return
            end = self.playback.seconds
            time = self.cursor.time + seconds
            self.cursor = replace(self.cursor, time=time if 0.0 <= time <= end else 0.0)
        self.notify(Topic.CURSOR)

    def _scenario_changed(self) -> None:
        """At once where it is seen; under the sliders of the first stage it would be in the way."""
        if self.stage == STAGES[0]:
            self._playback_waits = True
        else:
            self.refresh_playback()

    def _stage_changed(self) -> None:
        if self._playback_waits:
            self.refresh_playback()

    def refresh_playback(self) -> None:
        """Makes or reads the recording under the cursor and computes its motion, soon."""
        self._playback_waits = False
        self._motion_worker.ask(self._compute_playback)

    def _compute_playback(self) -> None:
        with self._lock:
            scenario, name, before = self.scenario, self.cursor.recording, self._recording_key
            fitted = self.outcome if self.outcome_of == scenario else None
        names = [spec.name for spec in scenario.recordings]
        if not names:
            with self._lock:
                self.recording, self._recording_key, self.playback = None, None, None
            self.notify(Topic.RECORDINGS, Topic.CURSOR)
            return
        name = name if name in names else names[0]
        try:
            key = (name, _data_part(scenario))
            kept = self.recording if key == before else None
            recording, found = self._played(scenario, name, fitted, kept)
        except InputError as error:
            self._playback_waits = True  # for the next stage: a worker may have been late or lost
            self.show_message(str(error), bad=True)
            return
        with self._lock:
            self.recording, self._recording_key, self.playback = recording, key, found
            if self.cursor.recording != name:
                self.cursor = replace(self.cursor, recording=name, time=0.0)
        self.notify(Topic.RECORDINGS, Topic.CURSOR)

    def _played(
        self, scenario: Scenario, name: str, fitted: Outcome | None, kept: Recording | None
    ) -> tuple[Recording, Playback]:
        """The recording, as it is `kept` where it is, and its motion; the server itself does only
        what is known to be short."""
        values = fitted_values(fitted, name)
        if not _short(scenario, name):
            arguments = {"recording": name, "folder": str(self.folder), "values": values}
            task = Task.of(play, f"Recording {name}", scenario=scenario, **arguments)
            again, found = ask(self.key, task)
            return kept or again, found
        recording = kept or read_one(scenario, name, Within(self.folder))
        return recording, played(scenario, values, recording)


def _short(scenario: Scenario, name: str) -> bool:
    simulate = next((s.simulate for s in scenario.recordings if s.name == name), None)
    return simulate is not None and simulate.samples <= SHORT


def _data_part(scenario: Scenario) -> Scenario:
    """What the recordings depend on: everything but the identification's settings."""
    plain = Scenario(title="-", arm=scenario.arm)
    return scenario.model_copy(
        update={"title": "-", "identify": plain.identify, "compare": (), "model": plain.model}
    )


RATE = 25.0
"""Frames a second; the page draws arm and cursor at each."""


class Player:
    """A thread that lives only while something plays."""

    def __init__(self, session: Playing) -> None:
        self._session = session
        self._lock = threading.Lock()
        self._running = False

    def wake(self) -> None:
        """Starts to move the cursor where it should and nobody does yet."""
        with self._lock:
            if self._running or not self._session.cursor.playing:
                return
            self._running = True
        threading.Thread(target=self._run, name="player", daemon=True).start()

    def _run(self) -> None:
        last = time.monotonic()
        while True:
            time.sleep(1.0 / RATE)
            now = time.monotonic()
            with self._lock:
                cursor = self._session.cursor
                if not cursor.playing or self._session.closed:
                    self._running = False
                    return
            with self._session.faults.watch(Part.CURSOR):
                self._session.advance((now - last) * cursor.speed)
            last = now
