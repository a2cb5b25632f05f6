"""Files that a person brings become recordings, if need be with the meaning of their columns."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any

from core.errors import InputError
from core.loading import joint_units
from core.model import Model
from core.recording.load import load_recording
from core.recording.spec import RecordingSpec
from core.scenario.read import parse_scenario
from core.scenario.schema import Scenario
from core.workbench import base_model
from flexgui.session.columns import Waiting, waiting_again, waiting_for
from flexgui.session.demonstrating import Demonstrating
from flexgui.session.edit import put, recording
from flexgui.session.services import Services
from flexgui.session.topics import Topic
from flexgui.session.uploads import keep_upload, unpacked

CHOOSE = "Or say under “Which column is which” what the file's columns hold."


class Uploading(Demonstrating, ABC):
    """At most one file waits for its columns; it is forgotten when another one comes."""

    def __init__(self, key: str, folder: Path) -> None:
        super().__init__(key, folder)
        self.waiting: Waiting | None = None

    @abstractmethod
    def open(self, scenario: Scenario) -> bool:
        """Starts over with a scenario; its files must lie in the session's folder."""

    def upload(self, name: str, content: bytes, services: Services) -> bool:
        """Keeps a file and adds it to the scenario; a scenario file is opened instead."""
        self.leave_waiting()
        try:
            path = keep_upload(self.folder, name, content, services.upload_limit_bytes)
            try:
                self._take_in(path, services.upload_limit_bytes)
            except InputError as error:
                if not self._waits(path, str(error)):
                    path.unlink(missing_ok=True)
                    raise
                return False
        except InputError as error:
            self.say(str(error), bad=True)
            return False
        return True

    def choose_columns(self, name: str) -> bool:
        """Opens the file of a recording again, to say what its columns hold."""
        spec = next((s for s in self.scenario.recordings if s.name == name), None)
        if spec is None or spec.file is None:
            self.say("Only a recording from a file has columns to choose.", bad=True)
            return False
        model = base_model(self.scenario)
        try:
            path = self.folder / spec.file
            self._wait(waiting_again(path, model.arm, _needed(model), spec))
        except InputError as error:
            self.say(str(error), bad=True)
            return False
        return True

    def map_column(
        self, channel: str, header: str, gain: float = 1.0, sign: int = 1, unit: str = ""
    ) -> bool:
        """Says that a column of the waiting file holds a channel."""
        waiting = self.waiting
        if waiting is None or channel not in waiting.offered or header not in waiting.headers:
            return False
        self._wait(waiting.mapped(channel, header, gain, sign, unit))
        return True

    def read_waiting(self) -> bool:
        """Reads the waiting file with the columns that were chosen."""
        waiting = self.waiting
        if waiting is None:
            return False
        try:
            self._read(waiting.file, waiting.columns, waiting.recording)
        except InputError as error:
            self.say(str(error), bad=True)
            return False
        self._wait(None)
        return True

    def leave_waiting(self) -> None:
        """Forgets the waiting file; a recording that has it already keeps it."""
        waiting = self.waiting
        if waiting is None:
            return
        if waiting.file not in {spec.file for spec in self.scenario.recordings}:
            (self.folder / waiting.file).unlink(missing_ok=True)
        self._wait(None)

    def _waits(self, path: Path, sentence: str) -> bool:
        """Whether only the names of the columns are in the way."""
        if path.suffix.lower() in (".zip", ".toml"):
            return False
        model = base_model(self.scenario)
        waiting = waiting_for(path, model.arm, _needed(model))
        if waiting is None:
            return False
        self._wait(waiting)
        self.say(f"{sentence} {CHOOSE}", bad=True)
        return True

    def _wait(self, waiting: Waiting | None) -> None:
        with self._lock:
            self.waiting = waiting
        self.tell(Topic.RECORDINGS)

    def _take_in(self, path: Path, limit: int) -> None:
        if path.suffix.lower() == ".zip":
            path = unpacked(path, self.folder, limit)
        if path.suffix.lower() == ".toml":
            self.open(parse_scenario(path.read_text("utf-8", "replace"), path.name))
            return
        self._read(path.name, {}, "")

    def _read(self, file: str, columns: dict[str, dict[str, Any]], name: str) -> None:
        """Adds the file, or gives the recording of that name other columns; InputError else."""
        with self._lock:
            model = base_model(self.scenario)
        names = [spec.name for spec in self.scenario.recordings]
        known = self.scenario.recordings[names.index(name)] if name in names else None
        entry: dict[str, Any] = {"file": file} | ({"columns": columns} if columns else {})
        spec = RecordingSpec.model_validate(entry)
        found = load_recording(self.folder / file, spec, _needed(model), joint_units(model.arm))
        if known is not None:
            done = self.change(put(recording(names.index(name), "columns"), columns or None))
        else:
            done = self.change(lambda d: d.setdefault("recordings", []).append(entry))
        if done:
            rate = 1.0 / found.sample_time
            self.say(f"{file}: {len(found.time)} samples at {rate:.4g} Hz.")
            shown = name if known is not None else self.scenario.recordings[-1].name
            self.set_cursor(recording=shown, time=0.0, playing=False)


def _needed(model: Model) -> tuple[str, ...]:
    return tuple(model.drive.reference_channels(model.arm))
