"""What was done is written before it is shown: after a crash a person takes it up again."""

from __future__ import annotations

import logging
import shutil
import time
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from core.errors import InputError
from core.files import replacing
from core.scenario.schema import Scenario
from flexgui.places import FRESH, OWNER, RESULTS, WORK, earlier_folder, is_kept, kept_at
from flexgui.session.look import Look
from flexgui.session.records import packed, unpacked
from flexgui.session.state import Cursor, Topic
from flexgui.session.studying import Studying

DURABLE = frozenset(
    {Topic.SCENARIO, Topic.RECORDINGS, Topic.OUTCOME, Topic.DIAGNOSIS, Topic.CHALLENGE}
)
RESTORED = "Your work of {} is restored; start interrupted computations again."
NOT_KEPT = "Your work cannot be written to the disk, so it ends with this server: export it."

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


class Keeping(Studying, ABC):
    """Keeps nothing before `keep_here`: tests and scripts have no use for it."""

    def __init__(self, key: str, folder: Path) -> None:
        super().__init__(key, folder)
        self.earlier: Earlier | None = None
        """What the person is offered."""
        self._keeps = False
        self._written: tuple[Any, ...] = ((), ())
        self._judged: tuple[Look, tuple[Look, ...]] | None = None

    @abstractmethod
    def begin_with(self, scenario: Scenario) -> None: ...

    def keep_here(self) -> None:
        """From now on every change is written into the session's folder; looks for earlier work."""
        before = earlier_folder(self.folder)
        if is_kept(before):
            self.earlier = Earlier(before, kept_at(before))
        with self._lock:
            self._written, self._keeps = (self._stated(), self._found()), True

    def notify(self, *topics: Topic) -> None:
        """Writes first what the page is about to show."""
        if self._keeps and not self.closed and DURABLE & set(topics):
            with self._lock:
                self._write_down()
        super().notify(*topics)

    def decline(self) -> None:
        """Leaves the earlier work where it is; it is offered once more next time."""
        self.earlier = None
        self.notify(Topic.KEPT)

    def restore(self) -> bool:
        """Takes the earlier work up in place of what is here."""
        earlier = self.earlier
        if earlier is None:
            return False
        try:
            stated = unpacked((earlier.folder / WORK).read_bytes())
            found = _results(earlier.folder)
            with self._lock:
                self._keeps = False
                try:
                    self._take_up(earlier, stated, found)
                finally:
                    self._written, self._keeps = (self._stated(), self._found()), True
        except (InputError, OSError, KeyError, TypeError, AttributeError) as error:
            log.warning("Earlier work could not be restored: %r", error)
            self.earlier = None
            self.notify(Topic.KEPT)
            self.show_message("The earlier work is damaged and cannot be restored.", bad=True)
            return False
        self.earlier = None
        self.notify(*Topic)
        self.refresh_live()
        self.refresh_playback()
        self.show_message(RESTORED.format(earlier.words))
        return True

    def _take_up(self, earlier: Earlier, stated: dict[str, Any], found: dict[str, Any]) -> None:
        self.begin_with(stated["scenario"])
        self._exchange(earlier.folder)
        self.live, self.stage = type(self.live)(**stated["live"]), stated["stage"]
        self.cursor = Cursor(recording=stated["recording"])
        self.aside, self._own = stated["aside"], frozenset(stated["own"])
        self.nickname, self.tour = stated["nickname"], stated["tour"]
        self.challenge, self._formulas = stated["challenge"], stated["formulas"]
        if self.challenge is not None:
            begun = time.monotonic() - stated["challenged_for"]
            self.challenge = replace(self.challenge, started=begun)
        self.outcome, self.outcome_of = found.get("outcome"), found.get("outcome_of")
        self.looks = found.get("looks", ())

    def _exchange(self, earlier: Path) -> None:
        """Two renames: whenever this is interrupted, the earlier work lies in one of its places."""
        fresh = self.folder.with_name(f"{self.folder.name}{FRESH}")
        owner = {p.name: p.read_bytes() for p in self.folder.glob(OWNER)}
        shutil.rmtree(fresh, ignore_errors=True)
        self.folder.rename(fresh)
        earlier.rename(self.folder)
        for name, content in owner.items():
            (self.folder / name).write_bytes(content)
        shutil.rmtree(fresh, ignore_errors=True)

    def _write_down(self) -> None:
        stated, found = self._stated(), self._found()
        before, self._written = self._written, (stated, found)
        try:
            if not _same(found, before[1]):
                _write(self.folder / RESULTS, dict(zip(_FOUND, found, strict=True)))
            if not _same(stated, before[0]) or not is_kept(self.folder):
                if _same(stated, before[0]) and _same(found, before[1]):
                    return
                _write(self.folder / WORK, self._in_words())
        except (InputError, OSError, TypeError) as error:
            self._keeps = False
            log.warning("The work of a session cannot be kept: %r", error)
            self.show_message(NOT_KEPT, bad=True)

    def _stated(self) -> tuple[Any, ...]:
        tried = " ".join(self._formulas)
        return (self.scenario, self.challenge, self.aside, self._own, tried)

    def _found(self) -> tuple[Any, ...]:
        return (self.outcome, self.outcome_of, self._judged_looks())

    def _judged_looks(self) -> tuple[Look, ...]:
        """Those that are over, and the one whose verdict is shown while its last fit goes on."""
        look = self.pending
        if look is None or look.diagnosis is None:
            return self.looks
        if self._judged is None or self._judged[0] is not look:
            self._judged = (look, self.shown_looks)
        return self._judged[1]

    def _in_words(self) -> dict[str, Any]:
        return {
            "scenario": self.scenario,
            "live": vars(self.live),
            "stage": self.stage,
            "recording": self.cursor.recording,
            "aside": self.aside,
            "own": sorted(self._own),
            "nickname": self.nickname,
            "tour": self.tour,
            "challenge": self.challenge,
            "challenged_for": time.monotonic() - self.challenge.started if self.challenge else 0.0,
            "formulas": self._formulas,
        }


_FOUND = ("outcome", "outcome_of", "looks")


def _same(new: tuple[Any, ...], old: tuple[Any, ...]) -> bool:
    """Records are frozen: equal ones are the same ones."""

    def one(a: Any, b: Any) -> bool:
        return a is b or (isinstance(a, str) and a == b)

    return len(new) == len(old) and all(one(a, b) for a, b in zip(new, old, strict=True))


def _write(path: Path, value: dict[str, Any]) -> None:
    content = packed(value)
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def _results(folder: Path) -> dict[str, Any]:
    """Empty where nothing was found yet."""
    path = folder / RESULTS
    found = unpacked(path.read_bytes()) if path.exists() else {}
    assert isinstance(found, dict)
    return found
