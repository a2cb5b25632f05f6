"""Saves a session's work before it is shown, so that a person can restore it after a crash."""

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

from flexgui import places
from flexgui.core.errors import InputError
from flexgui.core.files import replacing
from flexgui.core.results import Outcome
from flexgui.core.scenario.schema import Scenario
from flexgui.export.serialization import deserialize, serialize
from flexgui.session.replaced_work import Work
from flexgui.session.state import STAGES, Cursor, LiveSettings, Topic
from flexgui.stages.challenge.state import Challenge
from flexgui.stages.compare.state import SIGNALS
from flexgui.stages.data.state import check_suits
from flexgui.stages.diagnose.fitted_models import FittedModel
from flexgui.stages.diagnose.model_versions import ModelVersion
from flexgui.stages.study.state import StudyChoice

if TYPE_CHECKING:
    from flexgui.session.session import Session

DURABLE = frozenset({
    Topic.SCENARIO, Topic.RECORDINGS, Topic.OUTCOME, Topic.DIAGNOSIS, Topic.CHALLENGE, Topic.STUDY,
})  # fmt: skip
RESTORED = "Your work of {} is restored; start interrupted computations again."
WITHOUT_RESULTS = "Your work of {} is restored without its results, which are set aside as {}: {}"
NOT_READ = "Your work of {} cannot be read and is set aside as {}: {}"
NOT_MOVED = "Your work of {} cannot be put back now and stays where it is ({}); try again."
AUTOSAVE_FAILED = "Autosave failed: export now."

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class EarlierWork:
    """The folder of earlier work that can be restored, and when it was saved (s, Unix time)."""

    folder: Path
    time: float

    @property
    def date(self) -> str:
        """'14:32', with the day if it was not today."""
        then = time.localtime(self.time)
        today = then[:3] == time.localtime()[:3]
        return time.strftime("%H:%M" if today else "%d %B, %H:%M", then)


class WorkStore:
    """Saves and restores one session's work; saves nothing before `begin`, so scripts do not."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.earlier: EarlierWork | None = None
        """The work that the page offers to restore."""
        self._enabled = False
        self._writing = threading.Lock()
        """Held while files are written; the session's own lock is not held then."""
        self._saved: tuple[Any, ...] = ((), ())
        self._pending_versions: tuple[tuple[object, ...], tuple[ModelVersion, ...]] | None = None

    def begin(self) -> None:
        """Finds earlier work; from now on every change is saved into the session's folder."""
        before = places.earlier_folder(self._session.folder)
        if places.has_saved_work(before):
            self.earlier = EarlierWork(before, places.saved_at(before))
        with self._session.lock:
            self._saved, self._enabled = (self._work_fields(), self._result_fields()), True

    def write(self, topics: Sequence[Topic]) -> None:
        """Saves the work if one of the topics changes it, before the page shows the change."""
        if self._enabled and not self._session.closed and DURABLE & set(topics):
            with self._writing:
                self._save()

    def decline(self) -> None:
        """Does not restore the earlier work now; it is offered once more next time."""
        self.earlier = None
        self._session.notify(Topic.KEPT)

    def restore(self) -> bool:
        """Replaces the present work by the earlier one; sets aside files that cannot be read."""
        earlier = self.earlier
        if earlier is None:
            return False
        message = RESTORED.format(earlier.date)
        try:
            work = deserialize((earlier.folder / places.WORK).read_bytes(), SavedWork)
            check_suits(work.scenario)
        except UNREADABLE as error:
            name = places.set_aside(earlier.folder, earlier.time)
            self._finish(NOT_READ.format(earlier.date, name, _reason(error)), bad=True)
            return False
        try:
            results = deserialize((earlier.folder / places.RESULTS).read_bytes(), SavedResults)
        except FileNotFoundError:  # nothing was found yet
            results = SavedResults()
        except UNREADABLE as error:
            results = SavedResults()
            name = places.set_aside(earlier.folder / places.RESULTS, earlier.time)
            message = WITHOUT_RESULTS.format(earlier.date, name, _reason(error))
        with self._writing:
            self._enabled = False
            try:
                self._session.recordings.leave_waiting()  # its files lie in the folder that goes
                self._swap_folders(earlier.folder)
                self._session.start_with(_with_fitted_model(work.scenario, results.versions))
                self._session.document.live = work.live
                self._apply(work, results)
                self._saved = (self._work_fields(), self._result_fields())
            except OSError as error:
                self._session.show_message(NOT_MOVED.format(earlier.date, error.strerror), bad=True)
                return False
            finally:
                self._enabled = True
        self._finish(message)
        return True

    def _finish(self, message: str, bad: bool = False) -> None:
        """Removes the offer and shows the restored session with a message."""
        self.earlier = None
        self._session.notify(*Topic)
        self._session.document.refresh()
        self._session.playback.refresh()
        self._session.show_message(message, bad)

    def _apply(self, work: SavedWork, results: SavedResults) -> None:
        session = self._session
        session.stage = work.stage if work.stage in STAGES else STAGES[0]
        session.playback.cursor = Cursor(recording=work.recording)
        session.recordings.imports.own_files = frozenset(work.own_files)
        session.tour.step = work.tour_step
        session.challenge.nickname, session.challenge.state = work.nickname, work.challenge
        session.replaced.left = work.left
        results = _with_shared_outcomes(results)
        session.diagnosis.formulas = dict(work.formulas)
        session.diagnosis.versions, session.diagnosis.models.all = results.versions, results.models
        session.identification.take(results.outcome, results.outcome_of)
        session.study.choice = work.study
        session.comparison.picked, session.comparison.view = work.picked, work.view
        if work.studied_scenario is not None:
            session.study.recall(work.studied_scenario)

    def _swap_folders(self, earlier: Path) -> None:
        """Puts the earlier folder in place of the present one by two renames: an interruption loses
        neither."""
        folder = self._session.folder
        fresh = folder.with_name(f"{folder.name}{places.REPLACED_SUFFIX}")
        shutil.rmtree(fresh, ignore_errors=True)
        folder.rename(fresh)
        try:
            earlier.rename(folder)
        except OSError:
            fresh.rename(folder)
            raise
        for owner in fresh.glob(places.OWNER):
            owner.replace(folder / places.OWNER)
        if places.has_saved_work(fresh):  # what was done before the question was answered
            places.set_aside(fresh, places.saved_at(fresh), "replaced")
        shutil.rmtree(fresh, ignore_errors=True)

    def _save(self) -> None:
        with self._session.lock:
            work, results, content = self._work_fields(), self._result_fields(), self._saved_work()
        before, self._saved = self._saved, (work, results)
        try:
            if not _unchanged(results, before[1]):
                _write_file(self._session.folder / places.RESULTS, SavedResults(*results))
            if not _unchanged(work, before[0]) or not places.has_saved_work(self._session.folder):
                if _unchanged(work, before[0]) and _unchanged(results, before[1]):
                    return
                _write_file(self._session.folder / places.WORK, content)
        except (InputError, OSError, TypeError) as error:
            self._enabled = False
            log.warning("The work of a session cannot be kept: %r", error)
            self._session.show_message(AUTOSAVE_FAILED, bad=True)

    def _work_fields(self) -> tuple[Any, ...]:
        """The objects whose replacement means that the work has changed."""
        session = self._session
        imports = session.recordings.imports
        return (
            session.document.scenario, session.challenge.state, imports.own_files,
            " ".join(session.diagnosis.formulas), session.study.choice,
            " ".join(session.comparison.picked), session.comparison.view,
            session.study.state.settings, session.replaced.left,
        )  # fmt: skip

    def _result_fields(self) -> tuple[Any, ...]:
        fitted = self._session.identification
        models = self._session.diagnosis.models.all
        return (fitted.outcome, fitted.outcome_of, self._finished_versions(), models)

    def _finished_versions(self) -> tuple[ModelVersion, ...]:
        """The ended versions, and a pending one once it is fitted and compared: what is shown of it
        must survive. It is written again only with its verdict, not with each ranking."""
        version, known = self._session.diagnosis.pending, self._pending_versions
        if version is None or version.found is None or not version.comparisons:
            return self._session.diagnosis.versions
        key = (version.comparisons, version.diagnosis)
        if known is None or any(a is not b for a, b in zip(known[0], key, strict=True)):
            known = self._pending_versions = (key, self._session.diagnosis.shown_versions)
        return known[1]

    def _saved_work(self) -> SavedWork:
        session = self._session
        studied = session.study.state.settings
        return SavedWork(
            scenario=session.document.scenario,
            live=session.document.live,
            stage=session.stage,
            recording=session.playback.cursor.recording,
            own_files=tuple(sorted(session.recordings.imports.own_files)),
            nickname=session.challenge.nickname,
            tour_step=session.tour.step,
            challenge=session.challenge.state,
            formulas=dict(session.diagnosis.formulas),
            study=session.study.choice,
            picked=session.comparison.picked,
            view=session.comparison.view,
            studied_scenario=None if studied is None else studied.scenario,
            left=session.replaced.left,
        )


ENCODED = {
    "own_files": "own", "tour_step": "tour", "studied_scenario": "studied",
}  # fmt: skip
"""Field -> its name in saved files."""


class SavedWork(msgspec.Struct, frozen=True, rename=ENCODED):
    """What a person did, as it is stored; unknown fields of another version are ignored."""

    scenario: Scenario
    live: LiveSettings = LiveSettings()
    stage: str = STAGES[0]
    recording: str = ""
    own_files: tuple[str, ...] = ()
    nickname: str = ""
    tour_step: int | None = 0
    challenge: Challenge | None = None
    formulas: dict[str, tuple[str, str, str]] = {}
    study: StudyChoice = StudyChoice()
    picked: tuple[str, ...] = ()
    view: str = SIGNALS
    studied_scenario: Scenario | None = None
    """The scenario whose study cases lie in the folder."""
    left: Work | None = None
    """What another scenario has replaced."""


class SavedResults(msgspec.Struct, frozen=True, rename={"versions": "looks"}):
    """The results, as they are stored."""

    outcome: Outcome | None = None
    outcome_of: Scenario | None = None
    versions: tuple[ModelVersion, ...] = ()
    models: tuple[FittedModel, ...] = ()


UNREADABLE = (InputError, OSError)


def _with_fitted_model(scenario: Scenario, versions: Sequence[ModelVersion]) -> Scenario:
    """The scenario with the effects of the last fitted version: one that was being added when the
    program ended is not in the results."""
    last = versions[-1].scenario if versions else scenario
    restored = scenario.model_copy(update={"model": last.model})
    return restored if restored == last else scenario


def _with_shared_outcomes(results: SavedResults) -> SavedResults:
    """The results; equal outcomes are one object, as they were."""
    known: dict[bytes, Outcome] = {}

    def shared(outcome: Outcome | None) -> Outcome | None:
        return None if outcome is None else known.setdefault(serialize(outcome), outcome)

    def way(versions: Sequence[ModelVersion]) -> tuple[ModelVersion, ...]:
        return tuple(replace(version, outcome=shared(version.outcome)) for version in versions)

    models = [replace(m, way=way(m.way), identified=shared(m.identified)) for m in results.models]
    return SavedResults(
        shared(results.outcome), results.outcome_of, way(results.versions), tuple(models)
    )


def _reason(error: Exception) -> str:
    """One sentence for the person; the full error goes to the log."""
    log.warning("Earlier work could not be read: %r", error)
    return str(error) if isinstance(error, InputError) else "parts of it are missing."


def _unchanged(new: tuple[Any, ...], old: tuple[Any, ...]) -> bool:
    """Whether no object was replaced: records are frozen, so equal ones are identical."""

    def one(a: Any, b: Any) -> bool:
        return a is b or (isinstance(a, str) and a == b)

    return len(new) == len(old) and all(one(a, b) for a, b in zip(new, old, strict=True))


def _write_file(path: Path, record: SavedWork | SavedResults) -> None:
    content = serialize(record)
    with replacing(path) as temporary:
        temporary.write_bytes(content)
