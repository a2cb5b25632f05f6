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

from flexgui.core.errors import InputError
from flexgui.server.limits import Limits


class Closable(Protocol):
    """What the store needs of a session."""

    key: str
    folder: Path

    def close(self) -> None:
        """End the session's threads and jobs."""


class Kept(Protocol):
    """Where work is kept beyond the end of a session."""

    def knows(self, key: str | None) -> bool:
        """Whether there is earlier work of that key."""

    def begin(self, key: str) -> Path:
        """A fresh folder for the key."""

    def end(self, folder: Path) -> None:
        """The session of a folder is over."""


S = TypeVar("S", bound=Closable)


@dataclass
class _Entry(Generic[S]):
    session: S
    address: str = ""
    clients: int = 0
    left_at: float = 0.0
    stopped: bool = False
    pinned: bool = False
    touched: bool = False
    """Whether anything was done in it."""


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
        kept: Kept | None = None,
    ) -> None:
        """`kept` holds the folders instead of `root`, and some of them beyond their end."""
        self._make, self._root, self._limits = make, root, limits
        self._stop_jobs, self._clock = stop_jobs, clock
        self._kept_work = kept
        self._lock = threading.RLock()
        self._entries: dict[str, _Entry[S]] = {}

    def __len__(self) -> int:
        return len(self._entries)

    def find(self, key: str | None) -> S | None:
        """The session of a key."""
        entry = self._entries.get(key or "")
        return None if entry is None else entry.session

    def knows(self, key: str | None) -> bool:
        """Whether the key opens something: a session, or work that was kept of one."""
        return self.find(key) is not None or (
            self._kept_work is not None and self._kept_work.knows(key)
        )

    def join(self, key: str | None, *, pinned: bool = False, address: str = "") -> S:
        """The key's session, or a new one, with one more browser; InputError where all is full.

        A new one counts for the network address that asks.
        """
        over: S | None = None
        with self._lock:
            entry = self._entries.get(key or "")
            if entry is None:
                over = self._free_places(address)
                entry = self._new(address, key if key is not None and self.knows(key) else None)
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

    def touch(self, session: S) -> None:
        """Something was done in it."""
        entry = self._entries.get(session.key)
        if entry is not None:
            entry.touched = True

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
                if self._clock() - entry.left_at >= self._kept(entry)
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

    def _kept(self, entry: _Entry[S]) -> float:
        return self._limits.keep if entry.touched else self._limits.keep_untouched

    def _free_places(self, address: str) -> S | None:
        """The session that goes for a newcomer where all is full, or all of its address."""
        same = [e for e in self._entries.values() if address and e.address == address]
        if len(same) >= self._limits.sessions_per_address:
            return self._give_up(same, "have come from your network address; use one of them, or")
        if len(self._entries) >= self._limits.sessions:
            return self._give_up(list(self._entries.values()), "are served, as many as can be;")
        return None

    def _give_up(self, among: list[_Entry[S]], why: str) -> S:
        """One that nobody uses: untouched, or left long ago; InputError where there is none."""
        now, patience = self._clock(), self._limits.give_up_after
        unused = [e for e in self._unused() if any(e is one for one in among)]
        free = [e for e in unused if not e.touched or now - e.left_at >= patience]
        if not free:
            raise InputError(f"{len(among)} sessions {why} come back in a few minutes.")
        oldest = min(free, key=lambda entry: (entry.touched, entry.left_at))
        return self._entries.pop(oldest.session.key).session

    def _new(self, address: str, key: str | None) -> _Entry[S]:
        key = key or secrets.token_urlsafe(24)
        if self._kept_work is not None:
            folder = self._kept_work.begin(key)
        else:
            folder = self._root / secrets.token_hex(8)  # lists of files tell no keys
            folder.mkdir(mode=0o700)
        try:
            entry = _Entry(self._make(key, folder), address)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        self._entries[key] = entry
        return entry

    def _close(self, session: S) -> None:
        folder = session.folder
        with contextlib.ExitStack() as always:
            if self._kept_work is not None:
                always.callback(self._kept_work.end, folder)
            else:
                always.callback(shutil.rmtree, folder, ignore_errors=True)
            self._stop_jobs(session)
            session.close()
