"""Files that were read become recordings: alone, or in addition to the present ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from flexgui.library.shipped import is_as_begun
from flexgui.session.scenario_edits import ScenarioDict, set_value, with_lists
from flexgui.session.state import Topic
from flexgui.stages.data.rigs import measured_edit, titled_edit

if TYPE_CHECKING:
    from flexgui.session.session import Session


@dataclass(frozen=True)
class Import:
    """A file that was read and is not yet a recording of the scenario."""

    entry: ScenarioDict
    """The scenario's table of it."""
    words: str
    """What was read."""


class Imports:
    """Adds a person's files to the recordings, or puts them in their place."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.pending: tuple[Import, ...] = ()
        """Files of which the person has not said yet whether they are used alone."""
        self.own_files: frozenset[str] = frozenset()
        """Files of the person that are recordings by now."""

    def add(self, imports: tuple[Import, ...]) -> None:
        """Adds recordings; asks first if there is work that they would change."""
        files = {spec.file for spec in self._session.document.scenario.recordings}
        with self._session.lock:
            self.pending = (*self.pending, *imports)
        if not files or files & self.own_files:
            self.use(alone=False)
            return
        if self._nothing_done():
            self.use(alone=True)
            return
        self._session.show_message(" ".join(arrival.words for arrival in imports))
        self._session.notify(Topic.RECORDINGS)

    def use(self, alone: bool) -> bool:
        """Makes the pending files recordings, instead of the present ones or in addition."""
        pending, before = self.pending, self._entries()
        entries = [arrival.entry for arrival in pending]
        alone = alone or not before
        edits = [set_value(("recordings",), entries if alone else [*before, *entries])]
        scenario = self._session.document.scenario
        edits += [titled_edit(scenario), *([measured_edit(scenario)] if alone else [])]
        if not pending:
            return False
        if alone and before:
            self._session.replaced.keep()
        if not self._session.document.change(*edits):
            return False
        with self._session.lock:
            self.own_files |= {arrival.entry["file"] for arrival in pending}
            self.pending = ()
            if alone:
                self._session.challenge.reset()
        self._session.show_message(" ".join(arrival.words for arrival in pending))
        last = self._session.document.scenario.recordings[-1].name
        self._session.playback.move(recording=last, time=0.0, playing=False)
        self._session.notify(Topic.RECORDINGS, Topic.CHALLENGE)
        self._session.check.start()
        return True

    @property
    def awaited(self) -> tuple[str, ...]:
        """Files that the scenario names and that nobody brought as a recording."""
        files = [f for spec in self._session.document.scenario.recordings for f in spec.files]
        return tuple(f for f in dict.fromkeys(files) if f not in self.own_files)

    @property
    def missing(self) -> tuple[str, ...]:
        """Those of them that are not there yet."""
        return tuple(f for f in self.awaited if not (self._session.folder / f).exists())

    def complete(self, file: str) -> bool:
        """A file that the scenario was waiting for has come."""
        missing = self.missing
        rest = f"still missing: {', '.join(missing)}." if missing else "all recordings are here."
        self._session.show_message(f"{file} belongs to the scenario; {rest}")
        self._session.playback.refresh()
        self._session.notify(Topic.RECORDINGS)
        if not missing:
            self._session.check.start()
        return True

    def cancel(self) -> None:
        """Drops the pending files."""
        with self._session.lock:
            pending, self.pending = self.pending, ()
        for arrival in pending:
            self.drop(arrival.entry["file"])
        self._session.notify(Topic.RECORDINGS)

    def drop(self, file: str) -> None:
        """Deletes a file that no recording uses."""
        specs = self._session.document.scenario.recordings
        if not any(file in spec.files for spec in specs):
            (self._session.folder / file).unlink(missing_ok=True)

    def _entries(self) -> list[ScenarioDict]:
        document = self._session.document.scenario.model_dump(exclude_defaults=True)
        entries: list[ScenarioDict] = with_lists(document.get("recordings", ()))
        return entries

    def _nothing_done(self) -> bool:
        """Whether the recordings are still those of the start, and unused."""
        session = self._session
        unused = session.identification.outcome is None and session.challenge.state is None
        return unused and is_as_begun(session.document.scenario)
