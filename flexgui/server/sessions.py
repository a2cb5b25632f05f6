"""Sessions by the key that a browser stores."""

from __future__ import annotations

import contextlib
import logging
import secrets
import shutil
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

from flexgui.core.errors import InputError
from flexgui.server.services import Limits
from flexgui.server.work_folders import SavedWorkFolders, new_root

if TYPE_CHECKING:
    from flexgui.session.session import Session

FULL_ADDRESS = "sessions were opened from your network address. Use one of them, or"
FULL_SERVER = "sessions are open, which is the limit. Please"

log = logging.getLogger(__name__)


@dataclass
class _Entry:
    """The place of a session, which is taken before the session is made."""

    key: str
    address: str = ""
    made: Future[Session] = field(default_factory=Future)
    clients: int = 0
    left_at: float = 0.0
    stopped: bool = False
    pinned: bool = False
    touched: bool = False
    """Whether the person has done anything in it."""


class SessionStore:
    """Makes sessions, and closes them some time after their last browser left.

    A browser cannot choose its key: an unknown key gets a new session.
    """

    def __init__(
        self,
        make: Callable[[str, Path], Session],
        limits: Limits,
        kept: SavedWorkFolders | None = None,
    ) -> None:
        """`kept` holds the folders; without it they are temporary."""
        self._make, self._limits, self._saved_folders = make, limits, kept
        self.root = new_root()
        """Of temporary folders."""
        self._lock = threading.RLock()
        self._entries: dict[str, _Entry] = {}

    def __len__(self) -> int:
        return len(self._entries)

    def knows(self, key: str | None) -> bool:
        """Whether a session or saved work has this key."""
        kept = self._saved_folders is not None and self._saved_folders.knows(key)
        return kept or key in self._entries

    def join(self, key: str | None, *, pinned: bool = False, address: str = "") -> Session:
        """Adds a browser to the key's session, or to a new one; InputError if all places are taken.

        A new session counts for the browser's network address. Files are touched outside the lock:
        a slow disk delays only the browsers of this session.
        """
        saved = key not in self._entries and self.knows(key)
        with self._lock:
            entry = self._entries.get(key or "")
            is_new, evicted = entry is None, None
            if entry is None:
                evicted = self._free_place(address)
                entry = _Entry(key if key and saved else secrets.token_urlsafe(24), address)
                self._entries[entry.key] = entry
            entry.clients += 1
            entry.stopped, entry.pinned = False, entry.pinned or pinned
        if is_new:
            self._fill(entry, evicted)
        return entry.made.result()

    def leave(self, session: Session) -> None:
        """Removes a browser from the session."""
        with self._lock:
            entry = self._entries.get(session.key)
            if entry is not None:
                entry.clients -= 1
                entry.left_at = monotonic()

    def touch(self, session: Session) -> None:
        """Notes that the person does something in the session."""
        entry = self._entries.get(session.key)
        if entry is not None:
            entry.touched = True

    def sweep(self) -> None:
        """Stops the jobs of unused sessions, and closes sessions that are unused for long."""
        limits, now = self._limits, monotonic()
        idle, closing = list[_Entry](), list[_Entry]()
        with self._lock:
            for entry in self._unused():
                seconds = now - entry.left_at
                if seconds >= (limits.keep if entry.touched else limits.keep_untouched):
                    closing.append(self._entries.pop(entry.key))
                elif seconds >= limits.grace and not entry.stopped:
                    entry.stopped = True
                    idle.append(entry)
        for entry in idle:
            _carefully(stop_jobs, entry.made.result())
        for entry in closing:
            self._close(entry.made.result())

    def close(self) -> None:
        """Closes them all, also those that are being made, and removes their folders."""
        with self._lock:
            entries, self._entries = list(self._entries.values()), {}
        for entry in entries:
            if entry.made.exception() is None:  # waits for it
                self._close(entry.made.result())
        shutil.rmtree(self.root, ignore_errors=True)

    def _unused(self) -> list[_Entry]:
        """Without browsers; who waits for a session that is being made counts as one."""
        return [e for e in self._entries.values() if e.clients <= 0 and not e.pinned]

    def _free_place(self, address: str) -> Session | None:
        """Frees a place for a new session if all places, or all of its address, are taken."""
        same = [e for e in self._entries.values() if address and e.address == address]
        if len(same) >= self._limits.sessions_per_address:
            return self._take_unused(same, FULL_ADDRESS)
        if len(self._entries) >= self._limits.sessions:
            return self._take_unused(list(self._entries.values()), FULL_SERVER)
        return None

    def _take_unused(self, entries: list[_Entry], why: str) -> Session:
        """Takes out an unused session, untouched or left long ago; InputError without one."""
        latest = monotonic() - self._limits.give_up_after
        unused = [e for e in self._unused() if any(e is entry for entry in entries)]
        free = [e for e in unused if not e.touched or e.left_at <= latest]
        if not free:
            raise InputError(f"{len(entries)} {why} come back in a few minutes.")
        oldest = min(free, key=lambda entry: (entry.touched, entry.left_at))
        return self._entries.pop(oldest.key).made.result()

    def _fill(self, entry: _Entry, evicted: Session | None) -> None:
        """Closes the session that gave its place, and makes the new one or frees the place."""
        try:
            if evicted is not None:
                self._close(evicted)
            entry.made.set_result(self._new(entry.key))
        except BaseException as error:
            with self._lock:
                self._entries.pop(entry.key, None)
            entry.made.set_exception(error)

    def _new(self, key: str) -> Session:
        if self._saved_folders is not None:
            folder = self._saved_folders.begin(key)
        else:
            folder = self.root / secrets.token_hex(8)  # lists of files reveal no keys
            folder.mkdir(mode=0o700)
        try:
            return self._make(key, folder)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise

    def _close(self, session: Session) -> None:
        folder = session.folder
        _carefully(stop_jobs, session)
        _carefully(type(session).close, session)
        if self._saved_folders is not None:
            self._saved_folders.end(folder)
        else:
            shutil.rmtree(folder, ignore_errors=True)


def stop_jobs(session: Session) -> None:
    """Stops the session's jobs with their best results so far, and its playback."""
    session.run.stop()
    session.study.stop()
    if session.playback.cursor.playing:
        session.playback.move(playing=False)


def _carefully(step: Callable[[Session], object], session: Session) -> None:
    """Logs an error of one session, so that the next one is handled too."""
    with contextlib.suppress(InputError):
        try:
            step(session)
        except Exception:
            log.exception("A session could not be stopped or closed")
