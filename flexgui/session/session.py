"""One person's work. Thread-safe, without a viewer; a page is rebuilt from it after a reload."""

from __future__ import annotations

import shutil
from typing import final

from flexgui.core.errors import InputError
from flexgui.core.scenario.read import read_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.jobs.inputs import leave
from flexgui.places import is_kept
from flexgui.session.demo import EMBEDDED, scenario_choices
from flexgui.session.keeping import Keeping
from flexgui.session.services import Services
from flexgui.session.state import Cursor, Topic
from flexgui.stages.data.uploading import check_suits
from flexgui.stages.data.uploads import fetch_files


@final
class Session(Keeping):
    """State and what may be done with it; subscribers hear which part changed, then read it.

    Its parts stand in files of their own: listened -> editing -> playing -> running ->
    diagnosing -> demonstrating -> checking -> uploading -> challenging -> studying ->
    keeping -> here.
    """

    def choose(self, name: str, services: Services) -> bool:
        """Starts over with the demo or a ready-made scenario."""
        choices = scenario_choices()
        try:
            if name not in choices:
                raise InputError(f"There is no scenario {name}; choose one of the list.")
            self.leave_waiting()
            path = choices[name]
            scenario = EMBEDDED[name]() if path is None else read_scenario(path)
            if path is not None:
                scenario = fetch_files(scenario, path.parent, services.data_folder, self.folder)
        except InputError as error:
            return self.refuse(error)
        return self.open(scenario)

    def open(self, scenario: Scenario) -> bool:
        """Starts over with a scenario; its files must lie in the session's folder."""
        try:
            self.begin_with(scenario)
        except InputError as error:
            return self.refuse(error)
        return True

    def begin_with(self, scenario: Scenario) -> None:
        """As `open`, but InputError where the scenario is none for this session."""
        check_suits(scenario)
        self.forget_job()
        self.forget_study()
        self.end_demonstration()
        self.leave_waiting()
        self._unsubscribe()
        with self._lock:
            self.scenario, self.recording, self.playback = scenario, None, None
            self.outcome, self.outcome_of = None, None
            self.looks, self.pending, self.challenge = (), None, None
            self.mended = {}
            self.cursor = Cursor()
        self.notify(Topic.SCENARIO, Topic.RECORDINGS, Topic.RUN, Topic.OUTCOME, Topic.CURSOR)
        self.notify(Topic.DIAGNOSIS, Topic.CHALLENGE)
        self.refresh_live()
        self.refresh_playback()

    def wait_idle(self, timeout: float = 60.0) -> bool:
        """Whether the session's own threads are at rest; for tests and scripts."""
        return self._live_worker.wait_idle(timeout) and self._motion_worker.wait_idle(timeout)

    def close(self) -> None:
        """Ends its threads and its job, and removes its folder where no work is kept in it."""
        self.closed = True
        self._unsubscribe()
        self.end_demonstration()
        self.end_study()
        self.end_check()
        self.stop()
        self._errands.close()
        leave(self.key)
        self._live_worker.close()
        self._motion_worker.close()
        with self._lock:
            self._subscribers.clear()
        if not is_kept(self.folder):
            shutil.rmtree(self.folder, ignore_errors=True)
