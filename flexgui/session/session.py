"""One person's work, thread-safe; a page is built from it again after a reload."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, final

from flexgui.core.errors import InputError
from flexgui.core.scenario.read import read_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.core.sentences import brief
from flexgui.jobs.file_jobs import cancel_session
from flexgui.library.shipped import EMBEDDED, scenario_choices
from flexgui.places import has_saved_work, hide_paths
from flexgui.session.edited_scenario import EditedScenario
from flexgui.session.playback import Playback
from flexgui.session.replaced_work import ReplacedWork
from flexgui.session.running_job import RunningJob
from flexgui.session.saved_work import WorkStore
from flexgui.session.scenario_edits import becoming
from flexgui.session.state import (
    BUSY,
    STAGES,
    Faults,
    Message,
    PagePart,
    Subscriber,
    Topic,
)
from flexgui.session.tour import Tour
from flexgui.stages.challenge.state import Challenges
from flexgui.stages.compare.state import Comparison
from flexgui.stages.data.check import Check
from flexgui.stages.data.state import Recordings, check_suits
from flexgui.stages.data.uploads import fetch_files
from flexgui.stages.diagnose.demonstration import Demonstrations
from flexgui.stages.diagnose.state import Diagnosis
from flexgui.stages.export.state import Export
from flexgui.stages.identify.state import Identification
from flexgui.stages.study.studying import Study

if TYPE_CHECKING:
    from flexgui.server.services import Services


@final
class Session:
    """Owns the parts and their common lock. Subscribers get a topic for each change and read the
    part. The lock is held briefly: never while something is computed or written."""

    def __init__(self, key: str, folder: Path, services: Services) -> None:
        self.key, self.folder, self.services = key, folder, services
        self.lock = threading.RLock()
        self.closed = False
        self.stage = STAGES[0]
        """The stage that is shown."""
        self.message = Message("")
        self.faults = Faults(lambda: self.notify(Topic.MESSAGE))
        self._subscribers: list[Subscriber] = []
        self.document = EditedScenario(self)
        self.playback = Playback(self)
        self.run = RunningJob(self)
        self.recordings, self.check = Recordings(self), Check(self)
        self.identification = Identification(self)
        self.comparison = Comparison(self)
        self.diagnosis, self.demonstration = Diagnosis(self), Demonstrations(self)
        self.export = Export(self)
        self.study = Study(self)
        self.challenge, self.tour = Challenges(self), Tour(self)
        self.replaced, self.store = ReplacedWork(self), WorkStore(self)

    def subscribe(self, callback: Subscriber) -> Callable[[], None]:
        """Calls `callback` with each changed topic, from any thread; returns how to end that."""
        with self.lock:
            self._subscribers.append(callback)

        def end() -> None:
            with self.lock:
                if callback in self._subscribers:
                    self._subscribers.remove(callback)

        return end

    def notify(self, *topics: Topic) -> None:
        """Saves the work, then calls the subscribers with the topics."""
        self.store.write(topics)
        with self.lock:
            subscribers = tuple(self._subscribers)
        for topic in topics:
            for subscriber in subscribers:
                try:
                    subscriber(topic)
                except Exception:
                    self.faults.fail(PagePart.PAGE)

    @contextmanager
    def changing(self, *topics: Topic) -> Iterator[None]:
        """Holds the lock while a part is changed, then notifies of the topics."""
        with self.lock:
            yield
        self.notify(*topics)

    def show_message(self, text: str, bad: bool = False) -> None:
        """Shows a sentence; paths of the server are hidden in it."""
        text = hide_paths(text, self.folder)
        with self.lock:
            self.message = Message(brief(text) if bad else text, bad, self.message.number + 1)
        self.notify(Topic.MESSAGE)

    def refuse(self, why: object) -> bool:
        """Shows why an action is refused, and returns False."""
        self.show_message(str(why), bad=True)
        return False

    def show(self, stage: str) -> None:
        """Shows another stage."""
        if stage in STAGES and stage != self.stage:
            self.stage = stage
            self.notify(Topic.STAGE)
            if self.message.text:
                self.show_message("")
            self.playback.stage_changed()

    def choose(self, name: str) -> bool:
        """Opens a supplied scenario in place of the present work."""
        choices = scenario_choices()
        try:
            if name not in choices:
                raise InputError(f"There is no scenario {name}; choose one from the list.")
            self.recordings.leave_waiting()
            path = choices[name]
            scenario = EMBEDDED[name]() if path is None else read_scenario(path)
            if path is not None:
                data = self.services.data_folder
                scenario = fetch_files(scenario, path.parent, data, self.folder)
        except InputError as error:
            return self.refuse(error)
        return self.open(scenario)

    def open(self, scenario: Scenario) -> bool:
        """Opens a scenario in place of the present work; its files are in the session's folder."""
        try:
            self.start_with(scenario)
        except InputError as error:
            return self.refuse(error)
        return True

    def start_with(self, scenario: Scenario) -> None:
        """As `open`, but raises InputError for an unsuitable scenario."""
        check_suits(scenario)
        self.replaced.keep()
        self.run.reset()
        self.study.reset()
        self.demonstration.end()
        self.recordings.leave_waiting()
        with self.lock:
            self.recordings.imports.own_files = frozenset()
            self.document.become(scenario)
            for part in (
                self.playback, self.identification, self.export, self.diagnosis, self.challenge,
                self.check,
            ):  # fmt: skip
                part.reset()
            self.diagnosis.models.recall()
        self.notify(Topic.SCENARIO, Topic.RECORDINGS, Topic.RUN, Topic.OUTCOME, Topic.CURSOR)
        self.notify(Topic.DIAGNOSIS, Topic.CHALLENGE)
        self.document.refresh()
        self.playback.refresh()

    def go_to(self, scenario: Scenario) -> bool:
        """Makes a scenario of which something was found the present one again."""
        if self.run.busy:
            return self.refuse(BUSY)
        names = [[spec.name for spec in s.recordings] for s in (scenario, self.document.scenario)]
        if names[0] != names[1]:
            return self.open(scenario)
        return self.document.change(becoming(scenario))

    def scenario_changed(self) -> None:
        """Updates the parts that depend on the scenario, except the live model."""
        self.playback.scenario_changed()
        self.demonstration.scenario_changed()

    def wait_idle(self, timeout: float = 60.0) -> bool:
        """Whether the session's threads are idle within `timeout` s; for scripts."""
        return self.document.wait_idle(timeout) and self.playback.wait_idle(timeout)

    def close(self) -> None:
        """Ends its threads and its job; removes its folder if it holds no saved work."""
        self.closed = True
        self.challenge.reset()
        self.demonstration.end()
        self.study.close()
        self.check.close()
        self.run.stop()
        self.recordings.close()
        cancel_session(self.key)
        self.document.close()
        self.playback.close()
        with self.lock:
            self._subscribers.clear()
        if not has_saved_work(self.folder):
            shutil.rmtree(self.folder, ignore_errors=True)
