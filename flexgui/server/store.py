"""Sessions by the key that a browser keeps."""

from __future__ import annotations

import contextlib
import secrets
import shutil
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from core.errors import InputError
from flexgui.server.limits import Limits


class Closable(Protocol):
    """What the store needs of a session."""

    key: str
    folder: Path

    def close(self) -> None: ...


S = TypeVar("S", bound=Closable)


@dataclass
class _Entry(Generic[S]):
    session: S
    clients: int = 0
    left_at: float = 0.0
    stopped: bool = False
    pinned: bool = False


class SessionStore(Generic[S]):
    """Makes sessions, keeps them for a while after their last browser left, then closes them.

    A key is never the browser's choice: one that is unknown here is answered by a new session.
    """

    def __init__(
        self,
        make: Callable[[str, Path], S],
        root: Path,
        limits: Limits,
        *,
        stop_jobs: Callable[[S], None] = lambda session: None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._make, self._root, self._limits = make, root, limits
        self._stop_jobs, self._clock = stop_jobs, clock
        self._lock = threading.RLock()
        self._entries: dict[str, _Entry[S]] = {}

    def __len__(self) -> int:
        return len(self._entries)

    def find(self, key: str | None) -> S | None:
        """The session of a key."""
        entry = self._entries.get(key or "")
        return None if entry is None else entry.session

    def join(self, key: str | None, *, pinned: bool = False) -> S:
        """The key's session, or a new one, with one more browser; InputError where all is full."""
        over: S | None = None
        with self._lock:
            entry = self._entries.get(key or "")
            if entry is None:
                over = self._make_room()
                entry = self._new()
            entry.clients += 1
            entry.stopped, entry.pinned = False, entry.pinned or pinned
        if over is not None:
            self._close(over)
        return entry.session

    def leave(self, session: S) -> None:
        """One browser less."""
        with self._lock:
            entry = self._entries.get(session.key)
            if entry is not None:
                entry.clients -= 1
                entry.left_at = self._clock()

    def sweep(self) -> None:
        """Stops the jobs of those who left, and closes those who left long ago."""
        idle: list[S] = []
        with self._lock:
            for entry in self._unused():
                away = self._clock() - entry.left_at
                if away >= self._limits.grace and not entry.stopped:
                    entry.stopped = True
                    idle.append(entry.session)
            over = [
                self._entries.pop(entry.session.key).session
                for entry in self._unused()
                if self._clock() - entry.left_at >= self._limits.keep
            ]
        for session in idle:
            self._stop_jobs(session)
        for session in over:
            self._close(session)

    def close(self) -> None:
        """Closes them all and removes their folders."""
        with self._lock:
            entries, self._entries = list(self._entries.values()), {}
        for entry in entries:
            self._close(entry.session)

    def _unused(self) -> list[_Entry[S]]:
        return [e for e in self._entries.values() if e.clients <= 0 and not e.pinned]

    def _make_room(self) -> S | None:
        """The session that goes for a newcomer where all is full."""
        if len(self._entries) < self._limits.sessions:
            return None
        now, patience = self._clock(), self._limits.make_room_after
        free = [entry for entry in self._unused() if now - entry.left_at >= patience]
        if not free:
            raise InputError(
                f"FlexGUI already serves {self._limits.sessions} sessions, as many as it can; "
                "come back in a few minutes."
            )
        oldest = min(free, key=lambda entry: entry.left_at)
        return self._entries.pop(oldest.session.key).session

    def _new(self) -> _Entry[S]:
        key = secrets.token_urlsafe(24)
        folder = self._root / secrets.token_hex(8)  # lists of files tell no keys
        folder.mkdir(mode=0o700)
        try:
            entry = _Entry(self._make(key, folder))
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        self._entries[key] = entry
        return entry

    def _close(self, session: S) -> None:
        folder = session.folder
        with contextlib.ExitStack() as always:
            always.callback(shutil.rmtree, folder, ignore_errors=True)
            self._stop_jobs(session)
            session.close()
