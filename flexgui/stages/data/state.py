"""Uploaded files become recordings; unclear columns are asked for first."""

from __future__ import annotations

import logging
import shutil
import threading
from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexgui.core.arm.arm import Arm
from flexgui.core.errors import InputError
from flexgui.core.recording.spec import RecordingSpec
from flexgui.core.scenario.data_folder import check_plain
from flexgui.core.scenario.read import LONGEST_SCENARIO, parse_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.jobs.file_jobs import FileJobs, TaskSteps
from flexgui.jobs.messages import Task
from flexgui.session.scenario_edits import (
    ScenarioDict,
    cached_model,
    recording_path,
    set_value,
)
from flexgui.session.state import INTERNAL_FAULT, Topic
from flexgui.stages.data.imports import Import, Imports
from flexgui.stages.data.inspect import Inspection, headers, inspect_file, read_file
from flexgui.stages.data.rig_statement import RigStatement
from flexgui.stages.data.rows import parted, settings
from flexgui.stages.data.uploads import keep_upload, unpack, unpacking_folder
from flexgui.stages.data.waiting_file import (
    POINT,
    Companion,
    WaitingFile,
    columns_of_rigs,
    waiting_again,
    waiting_for,
    wanted_channels,
)

if TYPE_CHECKING:
    from flexgui.session.session import Session

ASKED = "{}: assign a column to each missing signal, or choose another kind of rig."
REST = " The other files were read: {}."


class Recordings:
    """At most one file waits for its columns, with others that have the same columns."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.waiting: WaitingFile | None = None
        self.imports, self.rig = Imports(session), RigStatement(session)
        self.refused: tuple[str, ...] = ()
        """Why files of the last upload were not read."""
        self._queued: tuple[str, ...] = ()
        """Files with other columns, which are asked about once the one that waits is read."""
        self._bringing = threading.Lock()
        """Held while a file is written: several chosen at once come one by one."""
        self._file_jobs = FileJobs(
            session.key, lambda text: session.show_message(f"{text} …"), self._show_error
        )

    def close(self) -> None:
        """Stops reading."""
        self._file_jobs.close()

    def upload(self, name: str, content: bytes) -> Future[bool]:
        """Stores a file; then reads it, asks for its columns, or opens it as a scenario.

        Whether it is used alone is asked where recordings of another origin stand already. While a
        file waits, one that needs no answers is read; of the others, one with the same columns is
        read with it, and one with other columns is asked about next.
        """
        limit = self._session.services.upload_limit_bytes
        if self.refused and self._file_jobs.idle:  # files chosen at once come one by one
            self.refused = ()
        try:
            with self._bringing:
                path = keep_upload(self._session.folder, name, content, limit)
        except InputError as error:
            self._show_error(error)
            refused: Future[bool] = Future()
            refused.set_result(False)
            return refused
        return self._file_jobs.start(self._brought(path, limit))

    def _brought(self, path: Path, limit: int) -> TaskSteps:
        kind = path.suffix.lower()
        try:
            if self.waiting is not None and (self.waiting.recording or kind in (".zip", ".toml")):
                self._forget_file()
                yield from self._ask_next()
            if path.name in self.imports.awaited:
                return self.imports.complete(path.name)
            if kind not in (".zip", ".toml"):
                return (yield from self._read_or_ask(path))
            scenario = path if kind == ".toml" else (yield from self._unpacked(path, limit))
            with scenario.open(encoding="utf-8", errors="replace") as file:
                text = file.read(LONGEST_SCENARIO + 1)
            self._session.start_with(parse_scenario(text, scenario.name))
            if missing := self.imports.missing:
                self._session.show_message(f"Upload its recordings too: {', '.join(missing)}.")
            return True
        except (InputError, GeneratorExit):
            path.unlink(missing_ok=True)
            raise

    def _unpacked(self, path: Path, limit: int) -> TaskSteps:
        try:
            scenario = yield from self._asked(unpack, path.name, limit=limit)
        finally:
            shutil.rmtree(unpacking_folder(path), ignore_errors=True)
        return self._session.folder / scenario

    def _read_or_ask(self, path: Path) -> TaskSteps:
        """Reads a file, or lets it wait for answers."""
        before = self.waiting
        inspection: Inspection = yield from self._inspected(path.name, before)
        waiting = self._questions(path.name, inspection)
        if waiting is None:
            if inspection.refusal:
                raise InputError(inspection.refusal)
            self.imports.add((Import({"file": path.name}, inspection.words),))
            return True
        current = self.waiting  # answered or left meanwhile
        if current is None:
            self._ask(waiting)
        elif inspection.rows_as_known is not None and inspection.headers == current.headers:
            companion = Companion(path.name, inspection.rows_as_known)
            self._wait(replace(current, companions=(*current.companions, companion)))
        else:
            with self._session.lock:
                self._queued = (*self._queued, path.name)
        return False

    def _inspected(self, file: str, like: WaitingFile | None = None) -> TaskSteps:
        columns = None if like is None else (like.headers, like.columns)
        wanted, scenario = wanted_channels(*self._rig()), self._session.document.scenario
        arguments = {"scenario": scenario, "wanted": wanted, "like": columns}
        rigs = columns_of_rigs(scenario)
        return (yield from self._asked(inspect_file, file, rigs=rigs, **arguments))

    def _rig(self) -> tuple[Arm, tuple[str, ...]]:
        """The arm and the channels that its drive needs."""
        model = cached_model(self._session.document.scenario)
        return model.arm, tuple(model.drive.needed_channels(model.arm))

    def _questions(
        self, file: str, inspection: Inspection, again: bool = False
    ) -> WaitingFile | None:
        """Open questions about a file with guessed answers; None if there are none."""
        waiting = waiting_for(file, inspection.headers, *self._rig())
        to_say = settings(inspection.rows) or inspection.unread
        if waiting is None and not (again or to_say):
            return None
        if waiting is None:
            waiting = waiting_again(inspection.headers, *self._rig(), RecordingSpec(file=file))
        return waiting.guessed(inspection)

    def _ask(self, waiting: WaitingFile) -> None:
        """Lets a file wait for its columns."""
        self._wait(waiting)
        lacks = bool(waiting.missing) and not waiting.suits
        self._session.show_message(ASKED.format(waiting.file) if lacks else "", bad=lacks)

    def _ask_next(self) -> TaskSteps:
        """Inspects the files that came while another one waited."""
        while self.waiting is None and self._queued:
            with self._session.lock:
                queued, self._queued = self._queued, ()
            for file in queued:  # those behind may have the columns of the first
                try:
                    yield from self._read_or_ask(self._session.folder / file)
                except InputError as error:
                    self.imports.drop(file)
                    self._show_error(error)

    def choose_columns(self, name: str) -> Future[bool]:
        """Opens the file of a recording again to change its columns."""
        return self._file_jobs.start(self._opened_again(name))

    def _opened_again(self, name: str) -> TaskSteps:
        specs = self._session.document.scenario.recordings
        spec = next((s for s in specs if s.name == name), None)
        if spec is None or spec.file is None:
            raise InputError("Only a recording from a file has columns to choose.")
        headings = yield from self._asked(headers, spec.file)
        self._wait(waiting_again(headings, *self._rig(), spec))
        return True

    def _show_error(self, error: Exception) -> None:
        if not isinstance(error, InputError):
            logging.getLogger(__name__).error("A file was not read", exc_info=error)
            error = InputError(f"The file could not be read: {INTERNAL_FAULT}.")
        self._session.refuse(error)
        with self._session.changing(Topic.RECORDINGS):
            self.refused = (*self.refused, self._session.message.text)

    def map_column(
        self, channel: str, header: str, gain: float = 1.0, sign: int = 1, unit: str = ""
    ) -> bool:
        """Assigns a column of the waiting file, times the factors `gain` and `sign`, to a
        channel."""
        waiting = self.waiting
        if waiting is None or channel not in waiting.offered or header not in waiting.headers:
            return False
        try:
            self._answered(waiting.mapped(channel, header, gain, sign, unit))
        except InputError as error:
            return self._session.refuse(error)
        return True

    def no_column(self, channel: str) -> None:
        """States that the waiting file has no column for an optional channel."""
        if self.waiting is not None and channel not in self.waiting.missing:
            self._answered(self.waiting.without(channel))

    def answer(self, **answers: Any) -> None:
        """Answers for the waiting file: `theta2`, `gaps`, `clock`, `rate` of `WaitingFile`."""
        if self.waiting is not None:
            self._answered(replace(self.waiting, **answers))

    def ask_again(self) -> None:
        """Clears the answers about the waiting file."""
        if self.waiting is not None:
            self._answered(self.waiting.without_answers())

    def _answered(self, waiting: WaitingFile) -> None:
        """Stores an answer and clears the previous error."""
        if self._session.message.bad:
            self._session.show_message("")
        self._wait(waiting)

    def read_waiting(self) -> Future[bool]:
        """Reads the waiting file with the chosen columns."""
        file = "" if self.waiting is None else self.waiting.file
        return self._file_jobs.start(self._read_all(file))

    def _read_all(self, file: str) -> TaskSteps:
        waiting = self.waiting
        if waiting is None or waiting.file != file:
            return False
        if waiting.missing:
            channel = waiting.missing[0]
            meaning = waiting.words(channel)
            raise InputError(f"{file}: first assign a column to {meaning}, {channel}.")
        failed = []
        for k, one in enumerate(waiting.files):
            try:
                yield from self._read(one, waiting, waiting.settings(k))
            except InputError as error:
                failed.append(str(error))
        read = len(waiting.files) - len(failed)
        if failed:
            self._session.refuse(f"{failed[0]}{REST.format(read) if read else ''}")
        if not read:
            return False
        self._wait(None)
        yield from self._ask_next()
        return True

    def _read(self, file: str, waiting: WaitingFile, extra: Mapping[str, Any]) -> TaskSteps:
        """Adds the file as recordings, or changes the columns of one; InputError if it fails."""
        entry: ScenarioDict = {"file": file}
        entry |= {"columns": waiting.columns} if waiting.columns else {}
        entry |= {} if waiting.theta2 is None else {"theta2": waiting.theta2}
        entry |= extra
        scenario = self._session.document.scenario
        names = [spec.name for spec in scenario.recordings]
        entries = [entry] if waiting.recording in names else parted(entry)
        words = yield from self._asked(read_file, file, entries=entries, scenario=scenario)
        if waiting.recording not in names:
            self.imports.add(tuple(Import(*each) for each in zip(entries, words, strict=True)))
            return
        place = recording_path(names.index(waiting.recording))
        values = {"columns": waiting.columns or None, POINT: waiting.theta2, **extra}
        if self._session.document.change(*(set_value((*place, k), v) for k, v in values.items())):
            self._session.show_message(words[0])
            self._session.playback.move(recording=waiting.recording, time=0.0, playing=False)
            self._session.check.start()

    def leave_file(self) -> None:
        """Drops the waiting file; a recording that uses it stays."""
        self._forget_file()
        self._file_jobs.start(self._ask_next())

    def _forget_file(self) -> None:
        if self.waiting is not None:
            for file in self.waiting.files:
                self.imports.drop(file)
            self._wait(None)

    def leave_waiting(self) -> None:
        """Drops all waiting files."""
        with self._session.lock:
            queued, self._queued = self._queued, ()
        for file in queued:
            self.imports.drop(file)
        self._forget_file()
        self.imports.cancel()
        self.refused = ()
        self.rig.reset()

    def rig_changed(self) -> None:
        """Looks at a waiting file again, and at the recordings, by another rig."""
        if self.waiting is not None:
            self._file_jobs.start(self._inspect_again())
        self._session.notify(Topic.RECORDINGS)
        if any(spec.file for spec in self._session.document.scenario.recordings):
            self._session.check.start()

    def _inspect_again(self) -> TaskSteps:
        waiting = self.waiting
        if waiting is None or waiting.recording:
            return
        inspection: Inspection = yield from self._inspected(waiting.file)
        again = self._questions(waiting.file, inspection, again=True)
        if again is not None and self.waiting is not None:  # still
            self._ask(replace(again, companions=self.waiting.companions))

    def _asked(self, function: Any, file: str, **arguments: Any) -> TaskSteps:
        """Result of a function that runs in the reading worker.

        It is given the name, and finds no file by it but one of the session's folder.
        """
        check_plain(file)  # it is the title of the task too
        folder = str(self._session.folder)
        answer = yield Task.of(function, file, folder=folder, file=file, **arguments)
        if self._session.message.text.endswith("…"):
            self._session.show_message("")
        return answer

    def _wait(self, waiting: WaitingFile | None) -> None:
        with self._session.changing(Topic.RECORDINGS):
            self.waiting = waiting


def check_suits(scenario: Scenario) -> None:
    """Raises InputError if a session cannot use the scenario."""
    for spec in scenario.recordings:
        for file in spec.files:
            check_plain(file)
    cached_model(scenario)
