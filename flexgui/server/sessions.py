"""Sessions by the key that a browser keeps, and their folders: some outlive the server."""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import secrets
import shutil
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

from platformdirs import user_state_path

from flexgui.core.errors import InputError
from flexgui.places import (
    FRESH,
    OWNER,
    earlier_folder,
    is_kept,
    kept_at,
    remove_half_written,
    set_aside,
)
from flexgui.server.services import MEGA, Limits

if TYPE_CHECKING:
    from flexgui.session.session import Session

log = logging.getLogger(__name__)


@dataclass
class _Entry:
    session: Session
    address: str = ""
    clients: int = 0
    left_at: float = 0.0
    stopped: bool = False
    pinned: bool = False
    touched: bool = False
    """Whether anything was done in it."""


class SessionStore:
    """Makes sessions, keeps them for a while after their last browser left, then closes them.

    A key is never the browser's choice: one that is unknown here is answered by a new session.
    """

    def __init__(
        self, make: Callable[[str, Path], Session], limits: Limits, kept: KeptWork | None = None
    ) -> None:
        """`kept` holds the folders, and some of them beyond their end; without it they are
        temporary."""
        self._make, self._limits, self._kept_work = make, limits, kept
        self.root = new_root()
        """Of temporary folders."""
        self._lock = threading.RLock()
        self._entries: dict[str, _Entry] = {}

    def __len__(self) -> int:
        return len(self._entries)

    def knows(self, key: str | None) -> bool:
        """Whether the key opens something: a session, or work that was kept of one."""
        kept = self._kept_work is not None and self._kept_work.knows(key)
        return kept or key in self._entries

    def join(self, key: str | None, *, pinned: bool = False, address: str = "") -> Session:
        """The key's session, or a new one, with one more browser; InputError where all is full.

        A new one counts for the network address that asks.
        """
        over: Session | None = None
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

    def leave(self, session: Session) -> None:
        """One browser less."""
        with self._lock:
            entry = self._entries.get(session.key)
            if entry is not None:
                entry.clients -= 1
                entry.left_at = monotonic()

    def touch(self, session: Session) -> None:
        """Something was done in it."""
        entry = self._entries.get(session.key)
        if entry is not None:
            entry.touched = True

    def sweep(self) -> None:
        """Stops the jobs of those who left, and closes those who left long ago."""
        now = monotonic()
        idle: list[Session] = []
        over: list[Session] = []
        with self._lock:
            for entry in self._unused():
                away = now - entry.left_at
                if away >= (self._limits.keep if entry.touched else self._limits.keep_untouched):
                    over.append(self._entries.pop(entry.session.key).session)
                elif away >= self._limits.grace and not entry.stopped:
                    entry.stopped = True
                    idle.append(entry.session)
        for session in idle:
            _carefully(leave_alone, session)
        for session in over:
            self._close(session)

    def close(self) -> None:
        """Closes them all and removes their folders."""
        with self._lock:
            entries, self._entries = list(self._entries.values()), {}
        for entry in entries:
            self._close(entry.session)
        shutil.rmtree(self.root, ignore_errors=True)

    def _unused(self) -> list[_Entry]:
        return [e for e in self._entries.values() if e.clients <= 0 and not e.pinned]

    def _free_places(self, address: str) -> Session | None:
        """The session that goes for a newcomer where all is full, or all of its address."""
        same = [e for e in self._entries.values() if address and e.address == address]
        if len(same) >= self._limits.sessions_per_address:
            return self._give_up(same, "have come from your network address; use one of them, or")
        if len(self._entries) >= self._limits.sessions:
            return self._give_up(list(self._entries.values()), "are served, as many as can be;")
        return None

    def _give_up(self, among: list[_Entry], why: str) -> Session:
        """One that nobody uses: untouched, or left long ago; InputError where there is none."""
        late = monotonic() - self._limits.give_up_after
        unused = [e for e in self._unused() if any(e is one for one in among)]
        free = [e for e in unused if not e.touched or e.left_at <= late]
        if not free:
            raise InputError(f"{len(among)} sessions {why} come back in a few minutes.")
        oldest = min(free, key=lambda entry: (entry.touched, entry.left_at))
        return self._entries.pop(oldest.session.key).session

    def _new(self, address: str, key: str | None) -> _Entry:
        key = key or secrets.token_urlsafe(24)
        if self._kept_work is not None:
            folder = self._kept_work.begin(key)
        else:
            folder = self.root / secrets.token_hex(8)  # lists of files tell no keys
            folder.mkdir(mode=0o700)
        try:
            entry = _Entry(self._make(key, folder), address)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        self._entries[key] = entry
        return entry

    def _close(self, session: Session) -> None:
        folder = session.folder
        _carefully(leave_alone, session)
        _carefully(type(session).close, session)
        if self._kept_work is not None:
            self._kept_work.end(folder)
        else:
            shutil.rmtree(folder, ignore_errors=True)


def leave_alone(session: Session) -> None:
    """Its jobs stop with the best they have so far: who comes back finds it. Nothing plays to
    nobody."""
    session.run.stop()
    session.study.stop()
    if session.playback.cursor.playing:
        session.playback.move(playing=False)


def _carefully(step: Callable[[Session], object], session: Session) -> None:
    """The next one's turn comes whatever happens to this one."""
    with contextlib.suppress(InputError):
        try:
            step(session)
        except Exception:
            log.exception("A session could not be stopped or closed")


MOST, MOST_BYTES, LONGEST = 200, 2000 * MEGA, 30 * 86400.0
"""Kept sessions, bytes of all of them, and s since one was changed: the oldest go first."""


class KeptWork:
    """One folder per session, named so that lists of files tell no keys; only the server's own user
    may read them."""

    def __init__(self, root: Path) -> None:
        """Makes the root (0700), and removes what is too old or too much; OSError else."""
        self.root = private(root)
        self._prune()

    def knows(self, key: str | None) -> bool:
        """Whether there is work of that key which no other server uses."""
        folder = self._folder(key or "")
        return any(is_kept(each) and not _used(each) for each in (folder, earlier_folder(folder)))

    def begin(self, key: str) -> Path:
        """A fresh folder for the key; what was kept of it waits beside, and what waited there and
        was not wanted is set aside."""
        folder = self._folder(key)
        earlier = earlier_folder(folder)
        if is_kept(folder):
            if is_kept(earlier):
                name = set_aside(earlier, kept_at(earlier), "declined")
                log.warning("Work that was not restored is set aside as %s", name)
            shutil.rmtree(earlier, ignore_errors=True)
            folder.rename(earlier)
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(mode=0o700)
        (folder / OWNER).write_text(f"{os.getpid()} {born(os.getpid())}")
        return folder

    def end(self, folder: Path) -> None:
        """The session is over: its folder stays where there is work in it."""
        if is_kept(folder):
            (folder / OWNER).unlink(missing_ok=True)
        else:
            shutil.rmtree(folder, ignore_errors=True)

    def _folder(self, key: str) -> Path:
        return self.root / hashlib.sha256(key.encode()).hexdigest()[:32]

    def _prune(self) -> None:
        unused = [p for p in self.root.iterdir() if p.is_dir() and not _used(p)]
        whole = [p for p in unused if is_kept(p) and not p.name.endswith(FRESH)]
        free, now, stay = MOST_BYTES, time.time(), set[Path]()
        for number, folder in enumerate(sorted(whole, key=kept_at, reverse=True)):
            free -= folder_bytes(folder)
            if free < 0 or number >= MOST or now - kept_at(folder) > LONGEST:
                log.info("Work of %s is too old or too much and goes", time.ctime(kept_at(folder)))
            else:
                stay.add(folder)
        for folder in unused:
            if folder in stay:
                remove_half_written(folder)
            else:
                shutil.rmtree(folder, ignore_errors=True)


def folder_bytes(folder: Path) -> int:
    """Of all files in it."""
    total = 0
    for path in folder.rglob("*"):
        with contextlib.suppress(OSError):  # gone meanwhile
            total += path.lstat().st_size
    return total


def _used(folder: Path) -> bool:
    """By a server that runs."""
    try:
        number, _, began = (folder / OWNER).read_text().partition(" ")
        process = int(number)
    except (OSError, ValueError):
        return False
    return alive(process) and (not began or born(process) == began)


VARIABLE = "FLEXGUI_STATE"
"""Moves the user's own folder."""
KEY_FILE, KEY_BYTES = "server.key", 32


def state_folder() -> Path:
    """What outlives the server lies there."""
    chosen = os.environ.get(VARIABLE)
    return Path(chosen) if chosen else user_state_path("flexgui", appauthor=False)


def private(folder: Path) -> Path:
    """The folder, made if need be, closed to others (0700); OSError where it cannot be."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    folder.chmod(0o700)
    return folder


PREFIX = "flexgui-"


def new_root() -> Path:
    """A fresh temporary folder (0700), after those of servers that were killed are removed."""
    for path in Path(tempfile.gettempdir()).glob(f"{PREFIX}*-*"):
        process = path.name[len(PREFIX) :].partition("-")[0]
        if process.isdigit() and not alive(int(process)) and _is_own(path):
            shutil.rmtree(path, ignore_errors=True)
    return Path(tempfile.mkdtemp(prefix=f"{PREFIX}{os.getpid()}-"))


def _is_own(folder: Path) -> bool:
    try:
        mine = folder.lstat().st_uid == os.getuid()
    except OSError:
        return False
    return mine and folder.is_dir() and not folder.is_symlink()


def born(process: int) -> str:
    """When a process began, in the system's own ticks; "" where there is none, or none is told.

    A number is given again after a restart: another program with it is not the server that had it.
    """
    try:
        after_name = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return ""
    return "" if after_name[0] in "ZX" else after_name[19]


def alive(process: int) -> bool:
    """Whether there is such a process; elsewhere than on POSIX asking it may end it, so it is."""
    if os.name != "posix":
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
