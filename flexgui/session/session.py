"""One person's work. Thread-safe, without a viewer; a page is rebuilt from it after a reload."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import final

from core.errors import InputError
from core.recording.load import load_recording
from core.recording.spec import RecordingSpec
from core.scenario.read import parse_scenario, read_scenario
from core.scenario.schema import Scenario
from core.workbench import base_model
from flexgui.session.demo import demo_scenario, scenario_choices
from flexgui.session.running import Running
from flexgui.session.services import Services
from flexgui.session.state import Cursor
from flexgui.session.topics import Topic
from flexgui.session.uploads import fetch_files, keep_upload, unpacked


@final
class Session(Running):
    """State and what may be done with it; subscribers hear which part changed, then read it.

    Its parts stand in files of their own: listened -> editing -> playing -> running -> here.
    """

    def choose(self, name: str, services: Services) -> bool:
        """Starts over with the demo or a ready-made scenario."""
        choices = scenario_choices()
        try:
            if name not in choices:
                raise InputError(f"There is no scenario {name}; choose one of the list.")
            path = choices[name]
            scenario = demo_scenario() if path is None else read_scenario(path)
            if path is not None:
                fetch_files(scenario, path.parent, services.data_folder, self.folder)
        except InputError as error:
            self.say(str(error), bad=True)
            return False
        return self.open(scenario)

    def open(self, scenario: Scenario) -> bool:
        """Starts over with a scenario; its files must lie in the session's folder."""
        try:
            base_model(scenario)
        except InputError as error:
            self.say(str(error), bad=True)
            return False
        self.forget_job()
        with self._lock:
            self.scenario, self.recording, self.playback = scenario, None, None
            self.outcome, self.outcome_of = None, None
            self.cursor = Cursor()
        self.tell(Topic.SCENARIO, Topic.RECORDINGS, Topic.RUN, Topic.OUTCOME, Topic.CURSOR)
        self.refresh_live()
        self.refresh_playback()
        return True

    def upload(self, name: str, content: bytes, services: Services) -> bool:
        """Keeps a file and adds it to the scenario; a scenario file is opened instead."""
        try:
            path = keep_upload(self.folder, name, content, services.upload_limit_bytes)
            try:
                self._take_in(path, services.upload_limit_bytes)
            except InputError:
                path.unlink(missing_ok=True)
                raise
        except InputError as error:
            self.say(str(error), bad=True)
            return False
        return True

    def _take_in(self, path: Path, limit: int) -> None:
        if path.suffix.lower() == ".zip":
            path = unpacked(path, self.folder, limit)
        if path.suffix.lower() == ".toml":
            self.open(parse_scenario(path.read_text("utf-8", "replace"), path.name))
            return
        with self._lock:
            model = base_model(self.scenario)
        required = model.drive.reference_channels(model.arm)
        found = load_recording(path, RecordingSpec(file=path.name), required)
        entry = {"file": path.name}
        if self.change(lambda d: d.setdefault("recordings", []).append(entry)):
            rate = 1.0 / found.sample_time
            self.say(f"{path.name}: {len(found.time)} samples at {rate:.4g} Hz.")
            self.set_cursor(recording=self.scenario.recordings[-1].name, time=0.0, playing=False)

    def wait_idle(self, timeout: float = 10.0) -> bool:
        """Whether the session's own threads are at rest; for tests and scripts."""
        return self._live_worker.wait_idle(timeout) and self._motion_worker.wait_idle(timeout)

    def close(self) -> None:
        """Ends its threads and its job, and removes its folder."""
        self.closed = True
        self.stop()
        self._live_worker.close()
        self._motion_worker.close()
        with self._lock:
            self._subscribers.clear()
        shutil.rmtree(self.folder, ignore_errors=True)
