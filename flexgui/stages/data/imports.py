"""Files that were read become recordings of the scenario: alone, or beside those that stand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from flexgui.library.shipped import is_as_begun
from flexgui.session.scenario_edits import ScenarioDict, set_value, with_lists
from flexgui.session.state import Topic
from flexgui.stages.data.rigs import measured_edit

if TYPE_CHECKING:
    from flexgui.session.session import Session


@dataclass(frozen=True)
class Import:
    """A file that was read and is no recording of the scenario yet."""

    entry: ScenarioDict
    """The scenario's table of it."""
    words: str
    """What was read."""


class Imports:
    """A person's files take their place among the recordings, and others make room for them."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.pending: tuple[Import, ...] = ()
        """Files of which the person has not said yet whether they are used alone."""
        self.replaced: tuple[ScenarioDict, ...] = ()
        """Recordings that made room for them."""
        self.own_files: frozenset[str] = frozenset()
        """Files of the person that are recordings by now."""

    def add(self, imports: tuple[Import, ...]) -> None:
        """Asks where a person's work stands; own recordings stand together, and in the place of
        those that the page began with."""
        files = {spec.file for spec in self._session.document.scenario.recordings}
        with self._session.lock:
            self.pending = (*self.pending, *imports)
        if not files or files & self.own_files:
            self.use(alone=False)
            return
        if self._nothing_done():
            self.use(alone=True)
            with self._session.lock:
                self.replaced = ()
            self._session.notify(Topic.RECORDINGS)
            return
        self._session.show_message(" ".join(one.words for one in imports))
        self._session.notify(Topic.RECORDINGS)

    def use(self, alone: bool) -> bool:
        """Makes what is pending recordings, in place of those that stand or beside them."""
        pending, before = self.pending, self._entries()
        entries = [one.entry for one in pending]
        alone = alone or not before
        edits = [set_value(("recordings",), entries if alone else [*before, *entries])]
        edits += [measured_edit(self._session.document.scenario)] if alone else []
        if not pending or not self._session.document.change(*edits):
            return False
        with self._session.lock:
            self.own_files |= {one.entry["file"] for one in pending}
            self.pending, self.replaced = (), (*self.replaced, *(before if alone else ()))
        self._session.show_message(" ".join(one.words for one in pending))
        last = self._session.document.scenario.recordings[-1].name
        self._session.playback.move(recording=last, time=0.0, playing=False)
        self._session.notify(Topic.RECORDINGS)
        self._session.check.start()
        if alone:
            self._session.challenge.lay_aside()
        return True

    def restore(self) -> bool:
        """Puts the recordings that made room before those that stand now."""
        together = set_value(("recordings",), [*self.replaced, *self._entries()])
        if not self.replaced or not self._session.document.change(together):
            return False
        with self._session.lock:
            self.replaced = ()
        self._session.notify(Topic.RECORDINGS)
        self._session.challenge.take_back()
        return True

    def cancel(self) -> None:
        """Forgets the files of which was asked whether they are used alone."""
        with self._session.lock:
            pending, self.pending = self.pending, ()
        for one in pending:
            self.drop(one.entry["file"])
        self._session.notify(Topic.RECORDINGS)

    def clear(self) -> None:
        """Forgets what is pending, and what it replaced."""
        self.cancel()
        with self._session.lock:
            self.replaced, self.own_files = (), frozenset()

    def drop(self, file: str) -> None:
        """Deletes a file that is no recording's."""
        specs = self._session.document.scenario.recordings
        if not any(file in spec.files for spec in specs):
            (self._session.folder / file).unlink(missing_ok=True)

    def _entries(self) -> list[ScenarioDict]:
        document = self._session.document.scenario.model_dump(exclude_defaults=True)
        entries: list[ScenarioDict] = with_lists(document.get("recordings", ()))
        return entries

    def _nothing_done(self) -> bool:
        """Whether the recordings are those that the page began with, and nobody has used them."""
        session = self._session
        unused = session.identification.outcome is None and session.challenge.state is None
        return unused and is_as_begun(session.document.scenario)
