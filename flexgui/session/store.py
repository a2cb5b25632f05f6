"""What was done is written before it is shown: after a crash a person takes it up again."""

from __future__ import annotations

import logging
import shutil
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from flexgui.core.errors import InputError
from flexgui.core.files import replacing
from flexgui.core.results import Outcome
from flexgui.core.scenario.schema import Scenario
from flexgui.places import (
    FRESH,
    OWNER,
    RESULTS,
    WORK,
    earlier_folder,
    is_kept,
    kept_at,
    set_aside,
)  # fmt: skip
from flexgui.session.edit import Document
from flexgui.session.records import packed, unpacked
from flexgui.session.state import STAGES, Cursor, Live, Topic
from flexgui.stages.challenge.state import Challenge
from flexgui.stages.data.state import check_suits
from flexgui.stages.diagnose.model_versions import ModelVersion
from flexgui.stages.study.state import StudyChoice

if TYPE_CHECKING:
    from flexgui.session.session import Session

DURABLE = frozenset({
    Topic.SCENARIO, Topic.RECORDINGS, Topic.OUTCOME, Topic.DIAGNOSIS, Topic.CHALLENGE, Topic.STUDY,
})  # fmt: skip
RESTORED = "Your work of {} is restored; start interrupted computations again."
WITHOUT = "Your work of {} is restored without its results, which are set aside as {}: {}"
UNREAD = "Your work of {} cannot be read and is set aside as {}: {}"
UNMOVED = "Your work of {} cannot be put back now and stays where it is ({}); try again."
NOT_KEPT = "Autosave failed: export now."

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Earlier:
    """Work that may be taken up again."""

    folder: Path
    time: float

    @property
    def words(self) -> str:
        """'14:32', with the day where that is another one."""
        then = time.localtime(self.time)
        today = then[:3] == time.localtime()[:3]
        return time.strftime("%H:%M" if today else "%d %B, %H:%M", then)


class Store:
    """Writes nothing before `begin`: scripts have no use for it."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.earlier: Earlier | None = None
        """What the person is offered."""
        self._keeps = False
        self._writing = threading.Lock()
        """Held while the disk is written; the session's own lock never is."""
        self._written: tuple[Any, ...] = ((), ())
        self._judged: tuple[ModelVersion, tuple[ModelVersion, ...]] | None = None

    def begin(self) -> None:
        """From now on every change is written into the session's folder; looks for earlier work."""
        before = earlier_folder(self._session.folder)
        if is_kept(before):
            self.earlier = Earlier(before, kept_at(before))
        with self._session.lock:
            self._written, self._keeps = (self._stated(), self._found()), True

    def write(self, topics: Sequence[Topic]) -> None:
        """Keeps what the page is about to show, where it is of those topics."""
        if self._keeps and not self._session.closed and DURABLE & set(topics):
            with self._writing:
                self._write_down()

    def decline(self) -> None:
        """Leaves the earlier work where it is; it is offered once more next time."""
        self.earlier = None
        self._session.notify(Topic.KEPT)

    def restore(self) -> bool:
        """Takes the earlier work up in place of what is here; what cannot be read is set aside."""
        earlier = self.earlier
        if earlier is None:
            return False
        words = RESTORED.format(earlier.words)
        try:
            stated = unpacked((earlier.folder / WORK).read_bytes(), SavedWork)
            check_suits(stated.scenario)
        except UNREADABLE as error:
            name = set_aside(earlier.folder, earlier.time)
            self._settle(UNREAD.format(earlier.words, name, _why(error)), bad=True)
            return False
        try:
            found = unpacked((earlier.folder / RESULTS).read_bytes(), SavedResults)
        except FileNotFoundError:  # nothing was found yet
            found = SavedResults()
        except UNREADABLE as error:
            found = SavedResults()
            name = set_aside(earlier.folder / RESULTS, earlier.time)
            words = WITHOUT.format(earlier.words, name, _why(error))
        with self._writing:
            self._keeps = False
            try:
                self._session.recordings.leave_waiting()  # its files lie in the folder that goes
                self._exchange(earlier.folder)
                self._session.begin_with(stated.scenario)
                self._session.document.live = stated.live
                self._take_up(stated, found)
                self._written = (self._stated(), self._found())
            except OSError as error:
                self._session.show_message(UNMOVED.format(earlier.words, error.strerror), bad=True)
                return False
            finally:
                self._keeps = True
        self._settle(words)
        return True

    def _settle(self, words: str, bad: bool = False) -> None:
        """The question about the earlier work is answered."""
        self.earlier = None
        self._session.notify(*Topic)
        self._session.document.refresh()
        self._session.playback.refresh()
        self._session.show_message(words, bad)

    def _take_up(self, stated: SavedWork, found: SavedResults) -> None:
        session = self._session
        session.stage = stated.stage if stated.stage in STAGES else STAGES[0]
        session.playback.cursor = Cursor(recording=stated.recording)
        imports = session.recordings.imports
        imports.replaced, imports.own_files = stated.replaced, frozenset(stated.own_files)
        session.tour.step = stated.tour_step
        session.challenge.nickname, session.challenge.state = stated.nickname, stated.challenge
        if stated.challenge is not None:
            begun = time.monotonic() - stated.challenge_seconds
            session.challenge.state = replace(stated.challenge, started=begun)
        session.identification.take(found.outcome, found.outcome_of)
        session.diagnosis.formulas = dict(stated.formulas)
        session.diagnosis.versions = _with_shared_outcome(found)
        session.study.choice = stated.study
        if stated.studied_scenario is not None:
            session.study.recall(stated.studied_scenario)

    def _exchange(self, earlier: Path) -> None:
        """Two renames: whenever this is interrupted, the earlier work lies in one of its places."""
        folder = self._session.folder
        fresh = folder.with_name(f"{folder.name}{FRESH}")
        shutil.rmtree(fresh, ignore_errors=True)
        folder.rename(fresh)
        try:
            earlier.rename(folder)
        except OSError:
            fresh.rename(folder)
            raise
        for owner in fresh.glob(OWNER):
            owner.replace(folder / OWNER)
        if is_kept(fresh):  # what was done before the question was answered
            set_aside(fresh, kept_at(fresh), "replaced")
        shutil.rmtree(fresh, ignore_errors=True)

    def _write_down(self) -> None:
        with self._session.lock:
            stated, found, words = self._stated(), self._found(), self._in_words()
        before, self._written = self._written, (stated, found)
        try:
            if not _same(found, before[1]):
                _write(self._session.folder / RESULTS, SavedResults(*found))
            if not _same(stated, before[0]) or not is_kept(self._session.folder):
                if _same(stated, before[0]) and _same(found, before[1]):
                    return
                _write(self._session.folder / WORK, words)
        except (InputError, OSError, TypeError) as error:
            self._keeps = False
            log.warning("The work of a session cannot be kept: %r", error)
            self._session.show_message(NOT_KEPT, bad=True)

    def _stated(self) -> tuple[Any, ...]:
        """What is compared to see whether anything has changed: objects that are replaced whole."""
        session = self._session
        imports = session.recordings.imports
        return (
            session.document.scenario, session.challenge.state, imports.replaced, imports.own_files,
            " ".join(session.diagnosis.formulas), session.study.choice,
            session.study.state.settings,
        )  # fmt: skip

    def _found(self) -> tuple[Any, ...]:
        fitted = self._session.identification
        return (fitted.outcome, fitted.outcome_of, self._judged_versions())

    def _judged_versions(self) -> tuple[ModelVersion, ...]:
        """Those that are over, and the one whose verdict is shown while its last fit goes on."""
        version = self._session.diagnosis.pending
        if version is None or version.diagnosis is None:
            return self._session.diagnosis.versions
        if self._judged is None or self._judged[0] is not version:
            self._judged = (version, self._session.diagnosis.shown_versions)
        return self._judged[1]

    def _in_words(self) -> SavedWork:
        session = self._session
        challenge, studied = session.challenge.state, session.study.state.settings
        return SavedWork(
            scenario=session.document.scenario,
            live=session.document.live,
            stage=session.stage,
            recording=session.playback.cursor.recording,
            replaced=session.recordings.imports.replaced,
            own_files=tuple(sorted(session.recordings.imports.own_files)),
            nickname=session.challenge.nickname,
            tour_step=session.tour.step,
            challenge=challenge,
            challenge_seconds=time.monotonic() - challenge.started if challenge else 0.0,
            formulas=dict(session.diagnosis.formulas),
            study=session.study.choice,
            studied_scenario=None if studied is None else studied.scenario,
        )


class SavedWork(
    msgspec.Struct,
    frozen=True,
    rename={
        "replaced": "aside", "own_files": "own", "tour_step": "tour",
        "challenge_seconds": "challenged_for", "studied_scenario": "studied",
    },
):  # fmt: skip
    """What a person did, as it is stored; unknown fields of another version are ignored."""

    scenario: Scenario
    live: Live = Live()
    stage: str = STAGES[0]
    recording: str = ""
    replaced: tuple[Document, ...] = ()
    own_files: tuple[str, ...] = ()
    nickname: str = ""
    tour_step: int | None = 0
    challenge: Challenge | None = None
    challenge_seconds: float = 0.0
    """s since the challenge began."""
    formulas: dict[str, tuple[str, str, str]] = {}
    study: StudyChoice = StudyChoice()
    studied_scenario: Scenario | None = None
    """The scenario whose study cases lie in the folder."""


class SavedResults(msgspec.Struct, frozen=True, rename={"versions": "looks"}):
    """The results, as they are stored."""

    outcome: Outcome | None = None
    outcome_of: Scenario | None = None
    versions: tuple[ModelVersion, ...] = ()


UNREADABLE = (InputError, OSError)


def _with_shared_outcome(found: SavedResults) -> tuple[ModelVersion, ...]:
    """The versions; those of the last result share its object."""
    if found.outcome is None:
        return found.versions
    last = packed(found.outcome)
    same = [one.outcome is not None and packed(one.outcome) == last for one in found.versions]
    return tuple(
        replace(one, outcome=found.outcome) if is_last else one
        for one, is_last in zip(found.versions, same, strict=True)
    )


def _why(error: Exception) -> str:
    """One sentence; what is not the file's fault is in the log."""
    log.warning("Earlier work could not be read: %r", error)
    return str(error) if isinstance(error, InputError) else "parts of it are missing."


def _same(new: tuple[Any, ...], old: tuple[Any, ...]) -> bool:
    """Records are frozen: equal ones are the same ones."""

    def one(a: Any, b: Any) -> bool:
        return a is b or (isinstance(a, str) and a == b)

    return len(new) == len(old) and all(one(a, b) for a, b in zip(new, old, strict=True))


def _write(path: Path, record: SavedWork | SavedResults) -> None:
    content = packed(record)
    with replacing(path) as temporary:
        temporary.write_bytes(content)
