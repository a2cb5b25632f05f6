"""One person's work. Thread-safe, without a viewer; a page is rebuilt from it after a reload."""

from __future__ import annotations

import logging
import shutil
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from core.errors import InputError
from core.recording.load import load_recording
from core.recording.recording import Recording
from core.recording.spec import RecordingSpec
from core.results import Outcome
from core.scenario.read import parse_scenario, read_scenario
from core.scenario.schema import Scenario
from core.scenario.write import scenario_toml
from core.workbench import base_model
from flexgui.jobs import Event, Finished, Job, Stopped, Task
from flexgui.jobs.tasks.export import export
from flexgui.jobs.tasks.identify import identify
from flexgui.session.demo import demo_scenario, scenario_choices
from flexgui.session.edit import Edit, edited, noise_of_simulations
from flexgui.session.latest import LatestWins
from flexgui.session.live import LiveModel, live_model
from flexgui.session.playback import Playback, playback, read_one
from flexgui.session.player import Player
from flexgui.session.run import FAILED, LOST, QUEUED, STOPPING, Run
from flexgui.session.services import Services
from flexgui.session.state import STAGES, Cursor, Live, Message
from flexgui.session.topics import Topic
from flexgui.session.uploads import fetch_files, keep_upload, unpacked

Subscriber = Callable[[Topic], None]
log = logging.getLogger(__name__)


class Session:
    """State and what may be done with it; subscribers hear which part changed, then read it."""

    def __init__(self, key: str, folder: Path) -> None:
        self.key, self.folder = key, folder
        self.scenario: Scenario = demo_scenario()
        self.live, self.stage, self.cursor = Live(), STAGES[0], Cursor()
        self.view: LiveModel | None = None
        self.recording: Recording | None = None
        """The one under the time-line's cursor, as the scenario states it now."""
        self.recording_key: tuple[str, Scenario] | None = None
        self.playback: Playback | None = None
        self.run = Run()
        self.job: Job | None = None
        self.outcome: Outcome | None = None
        self.outcome_of: Scenario | None = None
        self.message = Message("")
        self._lock = threading.RLock()
        self._subscribers: list[Subscriber] = []
        self._live_worker = LatestWins(f"live-{key[:8]}")
        self._motion_worker = LatestWins(f"motion-{key[:8]}")
        self.closed = False
        self._playback_waits = False
        self._player = Player(self)

    # Listening.

    def subscribe(self, callback: Subscriber) -> Callable[[], None]:
        """Calls back with each topic that changes, from any thread; returns how to end that."""
        with self._lock:
            self._subscribers.append(callback)

        def end() -> None:
            with self._lock:
                if callback in self._subscribers:
                    self._subscribers.remove(callback)

        return end

    def tell(self, *topics: Topic) -> None:
        """Lets the subscribers know."""
        with self._lock:
            subscribers = tuple(self._subscribers)
        for topic in topics:
            for subscriber in subscribers:
                try:
                    subscriber(topic)
                except Exception:
                    log.exception("A subscriber failed on %s", topic)

    def say(self, text: str, bad: bool = False) -> None:
        """A sentence for the person."""
        with self._lock:
            self.message = Message(text, bad, self.message.number + 1)
        self.tell(Topic.MESSAGE)

    # The scenario.

    def change(self, *edits: Edit) -> bool:
        """Edits the scenario; where the result is none, says why and changes nothing."""
        try:
            with self._lock:
                changed = edited(self.scenario, *edits)
                base_model(changed)
                self.scenario = changed
        except InputError as error:
            self.say(str(error), bad=True)
            return False
        self.tell(Topic.SCENARIO)
        self.refresh_live()
        self._renew_playback()
        return True

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
        self.stop()
        with self._lock:
            self.scenario, self.recording, self.playback = scenario, None, None
            self.outcome, self.outcome_of, self.run = None, None, Run()
            self.cursor = Cursor()
        self.tell(Topic.SCENARIO, Topic.RECORDINGS, Topic.RUN, Topic.OUTCOME, Topic.CURSOR)
        self.refresh_live()
        self.refresh_playback()
        return True

    # The live model.

    def set_live(self, **changes: Any) -> None:
        """Moves sliders that belong to no scenario."""
        with self._lock:
            self.live = replace(self.live, **changes)
        self.refresh_live()

    def set_noise(self, snr_db: float | None) -> bool:
        """The same signal-to-noise ratio for all that is simulated."""
        if not self.change(noise_of_simulations(snr_db)):
            return False
        self.set_live(snr_db=snr_db)
        return True

    def refresh_live(self) -> None:
        """Computes the live model anew, soon and on a thread of its own."""
        self._live_worker.ask(self._compute_live)

    def _compute_live(self) -> None:
        with self._lock:
            scenario, live, before = self.scenario, self.live, self.view
        try:
            view = live_model(scenario, live, before)
        except InputError as error:
            self.say(str(error), bad=True)
            return
        with self._lock:
            self.view = view
        self.tell(Topic.LIVE)

    def show(self, stage: str) -> None:
        """Another stage of the work."""
        if stage in STAGES and stage != self.stage:
            self.stage = stage
            self.tell(Topic.STAGE)
            self.say("")
            if self._playback_waits:
                self.refresh_playback()

    # Recordings.

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

    # Identification.

    def identify(self, services: Services) -> bool:
        """Runs the scenario in the pool."""
        scenario = self.scenario
        arguments = {"scenario_toml": scenario_toml(scenario), "folder": str(self.folder)}
        task = Task.of(identify, "The identification", **arguments)
        return self._submit(services, "identify", task, lambda e: self._identified(e, scenario))

    def _identified(self, event: Event, scenario: Scenario) -> None:
        found = getattr(event, "result", None)
        if not isinstance(found, Outcome):
            return
        if isinstance(event, Stopped) and self.outcome is not None:
            self.say("Stopped; the last complete result is kept.")
            return
        with self._lock:
            self.outcome, self.outcome_of = found, scenario
        self.tell(Topic.OUTCOME)
        if isinstance(event, Stopped):
            self.say("Stopped; the best found so far is shown.")
        self.refresh_playback()

    def report(self, services: Services, done: Callable[[Path], None]) -> bool:
        """Writes the export of the last result in the pool; `done` gets its folder."""
        outcome, scenario = self.outcome, self.outcome_of
        if outcome is None or scenario is None:
            self.say("There is no result yet; identify first.", bad=True)
            return False
        out = self.folder / "export"
        text = scenario_toml(scenario)
        task = Task.of(export, "The report", outcome=outcome, scenario_toml=text, out=str(out))

        def told(event: Event) -> None:
            if isinstance(event, Finished):
                done(out)

        return self._submit(services, "report", task, told)

    def pause(self) -> None:
        """Holds the job."""
        if self.job is not None:
            self.job.pause()

    def resume(self) -> None:
        """Lets it go on."""
        if self.job is not None:
            self.job.resume()

    def stop(self) -> None:
        """Ends the job with the best it has."""
        with self._lock:
            job = self.job
            if job is None or job.over:
                return
            self.run = replace(self.run, phase=STOPPING)
        self.tell(Topic.RUN)
        job.stop()

    @property
    def remaining_seconds(self) -> float | None:
        """Of the job's stage."""
        return None if self.job is None else self.job.remaining_seconds

    def _submit(
        self, services: Services, kind: str, task: Task, more: Callable[[Event], None]
    ) -> bool:
        try:
            with self._lock:
                if self.job is not None and not self.job.over:
                    raise InputError("Something is being computed already; stop it or wait.")
                self.run = Run(kind=kind, phase=QUEUED)

                def hear(event: Event) -> None:
                    self._heard(event)
                    more(event)

                self.job = services.pool.submit(self.key, task, hear)
        except InputError as error:
            self.say(str(error), bad=True)
            return False
        self.tell(Topic.RUN)
        return True

    def _heard(self, event: Event) -> None:
        with self._lock:
            stopping = self.run.phase == STOPPING
            self.run = self.run.after(event)
            if stopping and self.run.busy:
                self.run = replace(self.run, phase=STOPPING)
            run = self.run
        self.tell(Topic.RUN)
        if run.phase in (FAILED, LOST):
            self.say(run.sentence, bad=True)

    # The time-line.

    def set_cursor(self, **changes: Any) -> None:
        """Moves the cursor, plays, changes speed or recording."""
        with self._lock:
            before, self.cursor = self.cursor, replace(self.cursor, **changes)
        if before.recording != self.cursor.recording:
            self.refresh_playback()
        self._player.wake()
        self.tell(Topic.CURSOR)

    def advance(self, seconds: float) -> None:
        """Moves the cursor on; at the end it starts again."""
        with self._lock:
            if self.playback is None:
                return
            end = self.playback.seconds
            time = self.cursor.time + seconds
            self.cursor = replace(self.cursor, time=time if 0.0 <= time <= end else 0.0)
        self.tell(Topic.CURSOR)

    def _renew_playback(self) -> None:
        """At once where it is seen; under the sliders of the first stage it would be in the way."""
        if self.stage == STAGES[0]:
            self._playback_waits = True
        else:
            self.refresh_playback()

    def refresh_playback(self) -> None:
        """Makes or reads the recording under the cursor and computes its motion, soon."""
        self._playback_waits = False
        self._motion_worker.ask(self._compute_playback)

    def _compute_playback(self) -> None:
        with self._lock:
            scenario, name, before = self.scenario, self.cursor.recording, self.recording_key
            fitted = self.outcome if self.outcome_of == scenario else None
        names = [spec.name for spec in scenario.recordings]
        if not names:
            return
        name = name if name in names else names[0]
        try:
            key = (name, _data_part(scenario))
            recording = self.recording if key == before else None
            if recording is None:
                recording = read_one(scenario, name, self.folder)
            found = playback(scenario, fitted, recording)
        except InputError as error:
            self.say(str(error), bad=True)
            return
        with self._lock:
            self.recording, self.recording_key, self.playback = recording, key, found
            if self.cursor.recording != name:
                self.cursor = replace(self.cursor, recording=name, time=0.0)
        self.tell(Topic.RECORDINGS, Topic.CURSOR)

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


def _data_part(scenario: Scenario) -> Scenario:
    """What the recordings depend on: everything but the identification's settings."""
    plain = Scenario(title="-", arm=scenario.arm)
    return scenario.model_copy(
        update={"title": "-", "identify": plain.identify, "compare": (), "model": plain.model}
    )
