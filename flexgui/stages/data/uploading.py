"""Files that a person brings become recordings, if need be with the meaning of their columns."""

from __future__ import annotations

import logging
import shutil
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from flexgui.core.arm.presets import presets
from flexgui.core.errors import InputError
from flexgui.core.model import Model
from flexgui.core.recording.spec import RecordingSpec
from flexgui.core.scenario.data_folder import check_plain
from flexgui.core.scenario.read import LONGEST, parse_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.jobs.inputs import Errands, Steps
from flexgui.jobs.task import Task
from flexgui.session.edit import Document, Edit, put, recording, thawed
from flexgui.session.services import Services
from flexgui.session.state import OURS, Topic
from flexgui.stages.data.checking import Checking
from flexgui.stages.data.glance import Glance, glance
from flexgui.stages.data.rigs import RIGS, arm_edit, rig_edit, rig_of
from flexgui.stages.data.rows import Rows, headers, length_and_rate, parted, rows_of, settings
from flexgui.stages.data.uploads import keep_upload, unpack, unpacking_folder
from flexgui.stages.data.waiting_file import (
    POINT,
    Companion,
    Waiting,
    waiting_again,
    waiting_for,
    wanted_channels,
)

ASKED = (
    "{} has no column {}: assign one below under “Which column is which”, or, where the file comes "
    "from another kind of rig, choose that under “Rig” first."
)
MORE = "{} has columns with other names: assign them below, or read the file as it is."
REST = " The other files were read: {}."
GUESSED = "{}: what its columns seem to be stands below; read it, or correct the table."


@dataclass(frozen=True)
class Arrived:
    """A file that was read and is no recording of the scenario yet."""

    entry: Document
    """The scenario's table of it."""
    words: str
    """What was read."""


class Uploading(Checking, ABC):
    """At most one file waits for its columns, with those that have the same ones."""

    def __init__(self, key: str, folder: Path) -> None:
        super().__init__(key, folder)
        self.waiting: Waiting | None = None
        self.arrived: tuple[Arrived, ...] = ()
        """Files of which the person has not said yet whether they are used alone."""
        self.aside: tuple[Document, ...] = ()
        """Recordings that made room for them."""
        self._bringing = threading.Lock()
        """Held while a file is written: several that are chosen at once come one by one."""
        self._errands = Errands(key, lambda text: self.show_message(f"{text} …"), self._show_error)
        self._queued: tuple[str, ...] = ()
        """Files with other columns, which are asked about once the one that waits is settled."""
        self._own: frozenset[str] = frozenset()
        """Files of the person that are recordings by now."""

    @abstractmethod
    def open(self, scenario: Scenario) -> bool:
        """Starts over with a scenario; its files must lie in the session's folder."""

    @abstractmethod
    def begin_with(self, scenario: Scenario) -> None:
        """Starts over with a scenario; InputError where it is none for this session."""

    def upload(self, name: str, content: bytes, services: Services) -> Future[bool]:
        """Keeps a file; soon it is read, or its columns are asked for, or a scenario is opened.

        Whether it is used alone is asked where recordings of another origin stand already. While a
        file waits, one that needs no answers is read; of the others, one with the same columns is
        read with it, and one with other columns is asked about next.
        """
        limit = services.upload_limit_bytes
        try:
            with self._bringing:
                path = keep_upload(self.folder, name, content, limit)
        except InputError as error:
            self._show_error(error)
            refused: Future[bool] = Future()
            refused.set_result(False)
            return refused
        return self._errands.begin(self._brought(path, limit))

    def _brought(self, path: Path, limit: int) -> Steps:
        table = path.suffix.lower() not in (".zip", ".toml")
        try:
            if self.waiting is not None and (self.waiting.recording or not table):
                self._forget_file()
                yield from self._ask_next()
            if table and (yield from self._asks(path)):
                return False
            yield from self._take_in(path, limit)
        except (InputError, GeneratorExit):
            path.unlink(missing_ok=True)
            raise
        return True

    def choose_columns(self, name: str) -> Future[bool]:
        """Opens the file of a recording again, to say what its columns hold."""
        return self._errands.begin(self._opened_again(name))

    def _opened_again(self, name: str) -> Steps:
        spec = next((s for s in self.scenario.recordings if s.name == name), None)
        if spec is None or spec.file is None:
            raise InputError("Only a recording from a file has columns to choose.")
        model = base_model(self.scenario)
        headings = yield from self._asked(headers, spec.file)
        self._wait(waiting_again(headings, model.arm, _references(model), spec))
        return True

    def _show_error(self, error: Exception) -> None:
        if not isinstance(error, InputError):
            logging.getLogger(__name__).error("A file was not read", exc_info=error)
            error = InputError(f"The file could not be read: {OURS}.")
        self.show_message(str(error), bad=True)

    def map_column(
        self, channel: str, header: str, gain: float = 1.0, sign: int = 1, unit: str = ""
    ) -> bool:
        """Says that a column of the waiting file holds a channel."""
        waiting = self.waiting
        if waiting is None or channel not in waiting.offered or header not in waiting.headers:
            return False
        try:
            self._answered(waiting.mapped(channel, header, gain, sign, unit))
        except InputError as error:
            return self.refuse(error)
        return True

    def no_column(self, channel: str) -> None:
        """Says that the waiting file has none of a channel that it could do without."""
        if self.waiting is not None and channel not in self.waiting.missing:
            self._answered(self.waiting.without(channel))

    def answer(self, **answers: Any) -> None:
        """Says something about the waiting file: `theta2`, `gaps`, `clock`, `rate` of `Waiting`."""
        if self.waiting is not None:
            self._answered(replace(self.waiting, **answers))

    def ask_again(self) -> None:
        """Forgets what was said about the waiting file."""
        if self.waiting is not None:
            self._answered(self.waiting.begun_again())

    def read_waiting(self) -> Future[bool]:
        """Reads the waiting file with the columns that were chosen."""
        return self._errands.begin(
            self._read_all("" if self.waiting is None else self.waiting.file)
        )

    def _read_all(self, file: str) -> Steps:
        waiting = self.waiting
        if waiting is None or waiting.file != file:
            return False
        if waiting.missing:
            raise InputError(_still(waiting))
        failed = []
        for k, one in enumerate(waiting.files):
            given = waiting.columns, waiting.theta2, waiting.recording, waiting.settings(k)
            try:
                yield from self._read(one, *given)
            except InputError as error:
                failed.append(str(error))
        if failed:
            rest = len(waiting.files) - len(failed)
            self.show_message(f"{failed[0]}{REST.format(rest) if rest else ''}", bad=True)
        if len(failed) == len(waiting.files):
            return False
        self._wait(None)
        yield from self._ask_next()
        return True

    def use_arrived(self, alone: bool) -> bool:
        """Makes what has arrived recordings, in place of those that stand or beside them."""
        arrived, before = self.arrived, self._entries()
        entries = [one.entry for one in arrived]
        if not arrived or not self._put_recordings(entries if alone else [*before, *entries]):
            return False
        with self._lock:
            self._own |= {one.entry["file"] for one in arrived}
            self.arrived, self.aside = (), (*self.aside, *(before if alone else ()))
        self.show_message(" ".join(one.words for one in arrived))
        self.set_cursor(recording=self.scenario.recordings[-1].name, time=0.0, playing=False)
        self.notify(Topic.RECORDINGS)
        self.check_recordings()
        return True

    def bring_back(self) -> bool:
        """Puts the recordings that made room before those that stand now."""
        if not self.aside or not self._put_recordings([*self.aside, *self._entries()]):
            return False
        with self._lock:
            self.aside = ()
        self.notify(Topic.RECORDINGS)
        return True

    def leave_arrived(self) -> None:
        """Forgets the files of which was asked whether they are used alone."""
        with self._lock:
            left, self.arrived = self.arrived, ()
        for one in left:
            self._drop(one.entry["file"])
        self.notify(Topic.RECORDINGS)

    def leave_file(self) -> None:
        """Forgets the waiting file; a recording that has it already keeps it."""
        self._forget_file()
        self._errands.begin(self._ask_next())

    def _forget_file(self) -> None:
        if self.waiting is not None:
            for file in self.waiting.files:
                self._drop(file)
            self._wait(None)

    def leave_waiting(self) -> None:
        """Forgets all that a person was asked about, and what stands aside."""
        with self._lock:
            queued, self._queued = self._queued, ()
        for file in queued:
            self._drop(file)
        self._forget_file()
        self.leave_arrived()
        with self._lock:
            self.aside, self._own = (), frozenset()

    def _drop(self, file: str) -> None:
        if not any(file in spec.files for spec in self.scenario.recordings):
            (self.folder / file).unlink(missing_ok=True)

    def _joins(self, path: Path) -> Steps:
        """Whether it is read together with the file that waits, or asked about after it."""
        before = self.waiting
        if before is None:
            return False
        headings = yield from self._asked(headers, path.name)
        if headings != before.headers:
            with self._lock:
                self._queued = (*self._queued, path.name)
            return True
        found: Rows = yield from self._asked(rows_of, path.name, columns=before.columns)
        waiting = self.waiting  # answered or left meanwhile
        if waiting is None:
            return False
        self._wait(replace(waiting, companions=(*waiting.companions, Companion(path.name, found))))
        return True

    def _ask_next(self) -> Steps:
        """Looks at the files that came while another one waited."""
        while self.waiting is None and self._queued:
            with self._lock:
                file, self._queued = self._queued[0], self._queued[1:]
            try:
                if not (yield from self._asks(self.folder / file)):
                    yield from self._take_in(self.folder / file, 0)
            except InputError as error:
                self._drop(file)
                self._show_error(error)
            yield from self._queue_again()

    def _queue_again(self) -> Steps:
        """Those behind may have the columns of the one that waits now."""
        with self._lock:
            queued, self._queued = self._queued, ()
        for file in queued:
            if not (yield from self._joins(self.folder / file)):
                self._queued = (*self._queued, file)

    def _asks(self, path: Path) -> Steps:
        """Whether its columns have to be asked for; then it waits, or joins the one that does."""
        asked = yield from self._questions(path)
        if asked is None:
            return False
        if not (yield from self._joins(path)):
            self._ask(asked)
        return True

    def _questions(self, path: Path) -> Steps:
        """What has to be asked about a file, and what a first look guesses; None: nothing."""
        model = base_model(self.scenario)
        references = _references(model)
        headings = yield from self._asked(headers, path.name)
        waiting = waiting_for(path.name, headings, model.arm, references)
        wanted = wanted_channels(model.arm, references)
        found: Glance = yield from self._asked(
            glance, path.name, scenario=self.scenario, wanted=wanted
        )
        if waiting is None and not settings(found.rows):
            return None
        if waiting is None:
            plain = RecordingSpec(file=path.name)
            waiting = waiting_again(headings, model.arm, references, plain)
        return waiting.guessed(found)

    def _ask(self, waiting: Waiting) -> None:
        """Lets a file wait for its columns."""
        self._wait(waiting)
        missing = waiting.missing
        done = MORE if waiting.questions else GUESSED
        file = waiting.file
        message = ASKED.format(file, _named(missing[0])) if missing else done.format(file)
        self.show_message(message, bad=bool(missing))

    def choose_rig(self, title: str) -> bool:
        """Makes the scenario one of another kind of rig; a waiting file is looked at anew."""
        rig = next((r for r in RIGS if r.title == title), None)
        if rig is None or rig == rig_of(self.scenario):
            return False
        return self._become(rig_edit(self.scenario, rig))

    def choose_arm(self, preset: str) -> bool:
        """Makes the scenario's arm one that ships; a waiting file is looked at anew."""
        if preset == self.scenario.arm.preset or preset not in presets():
            return False
        return self._become(arm_edit(self.scenario, preset))

    def _become(self, edit: Edit) -> bool:
        """Another rig: a waiting file is looked at anew."""
        if not self.change(edit):
            return False
        self._errands.begin(self._looked_anew())
        self.notify(Topic.RECORDINGS)
        return True

    def _looked_anew(self) -> Steps:
        if self.waiting is None or self.waiting.recording:
            return
        asked = yield from self._questions(self.folder / self.waiting.file)
        if asked is not None and self.waiting is not None:  # still
            self._ask(replace(asked, companions=self.waiting.companions))

    def _asked(self, function: Callable[..., Any], file: str, **arguments: Any) -> Steps:
        """What the worker that reads says of a file.

        It is given the name, and finds no file by it but one of the session's folder.
        """
        check_plain(file)  # it is the title of the task too
        found = yield Task.of(function, file, folder=str(self.folder), file=file, **arguments)
        if self.message.text.endswith("…"):
            self.show_message("")
        return found

    def _answered(self, waiting: Waiting) -> None:
        """A sentence about the answer before is out of date."""
        if self.message.bad:
            self.show_message("")
        self._wait(waiting)

    def _wait(self, waiting: Waiting | None) -> None:
        with self._lock:
            self.waiting = waiting
        self.notify(Topic.RECORDINGS)

    def _take_in(self, path: Path, limit: int) -> Steps:
        if path.suffix.lower() == ".zip":
            try:
                scenario = yield from self._asked(unpack, path.name, limit=limit)
            finally:
                shutil.rmtree(unpacking_folder(path), ignore_errors=True)
            path = self.folder / scenario
        if path.suffix.lower() == ".toml":
            with path.open(encoding="utf-8", errors="replace") as file:
                text = file.read(LONGEST + 1)
            self.begin_with(parse_scenario(text, path.name))
            return
        yield from self._read(path.name, {}, None, "")

    def _read(
        self,
        file: str,
        columns: dict[str, dict[str, Any]],
        theta2: float | None,
        name: str,
        settings: Mapping[str, Any] | None = None,
    ) -> Steps:
        """Takes the file in, or gives the recording of that name other columns; InputError else."""
        entry: Document = {"file": file} | ({"columns": columns} if columns else {})
        entry |= {} if theta2 is None else {"theta2": theta2}
        entry |= settings or {}
        names = [spec.name for spec in self.scenario.recordings]
        if name not in names:
            arrived = []
            for each in parted(entry):
                arrived.append(Arrived(each, (yield from self._words(each))))
            for one in arrived:
                self._arrive(one)
            return
        words = yield from self._words(entry)
        place = recording(names.index(name))
        edits = put((*place, "columns"), columns or None), put((*place, POINT), theta2)
        more = [put((*place, key), value) for key, value in (settings or {}).items()]
        if self.change(*edits, *more):
            self.show_message(words)
            self.set_cursor(recording=name, time=0.0, playing=False)
            self.check_recordings()

    def _words(self, entry: Document) -> Steps:
        """What is read of a file; InputError where it cannot be."""
        arguments = {"entry": entry, "scenario": self.scenario}
        samples, rate = yield from self._asked(length_and_rate, entry["file"], **arguments)
        name = entry.get("name", entry["file"])
        return f"{name}: {samples} samples at {rate:.4g} Hz, {samples / rate:.2f} s."

    def _arrive(self, one: Arrived) -> None:
        """Asks where recordings of another origin stand alone; a person's own stand together."""
        files = {spec.file for spec in self.scenario.recordings}
        with self._lock:
            self.arrived = (*self.arrived, one)
        if not files or files & self._own:
            self.use_arrived(alone=False)
            return
        self.show_message(one.words)
        self.notify(Topic.RECORDINGS)

    def _entries(self) -> list[Document]:
        found: list[Document] = thawed(
            self.scenario.model_dump(exclude_defaults=True).get("recordings", ())
        )
        return found

    def _put_recordings(self, entries: list[Document]) -> bool:
        return self.change(put(("recordings",), entries))


def check_suits(scenario: Scenario) -> None:
    """InputError where a session cannot have the scenario."""
    for spec in scenario.recordings:
        for file in spec.files:
            check_plain(file)
    base_model(scenario)


def _references(model: Model) -> tuple[str, ...]:
    return tuple(model.drive.needed_channels(model.arm))


def _named(channel: str) -> str:
    return "t (time)" if channel == "t" else channel


def _still(waiting: Waiting) -> str:
    channel = waiting.missing[0]
    return f"{waiting.file}: first assign a column to {waiting.words(channel)}, {channel}."
