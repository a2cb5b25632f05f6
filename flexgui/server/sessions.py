"""Sessions by the key that a browser stores, and their folders, which may outlive the server."""

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
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

from platformdirs import user_state_path

from flexgui import places
from flexgui.core.errors import InputError
from flexgui.server.services import MEGA, Limits

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


MOST_FOLDERS, MOST_BYTES, LONGEST_AGE = 200, 2000 * MEGA, 30 * 86400.0
"""Limits of kept folders: number, bytes in all, age in s; the oldest are removed first."""


class SavedWorkFolders:
    """One folder per session, named by a hash of its key; only the server's user may read them."""

    def __init__(self, root: Path) -> None:
        """Makes the root (0700) and removes folders above the limits; OSError if it cannot."""
        self.root = private_folder(root)
        self._prune()

    def knows(self, key: str | None) -> bool:
        """Whether there is saved work of that key that no other server uses."""
        folder = self._folder(key or "")
        return any(
            places.has_saved_work(each) and not _is_in_use(each)
            for each in (folder, places.earlier_folder(folder))
        )

    def begin(self, key: str) -> Path:
        """Makes a new folder for the key. Its saved work becomes the earlier work; an earlier work
        that was not restored is set aside."""
        folder = self._folder(key)
        earlier = places.earlier_folder(folder)
        if places.has_saved_work(folder):
            if places.has_saved_work(earlier):
                name = places.set_aside(earlier, places.saved_at(earlier), "declined")
                log.warning("Work that was not restored is set aside as %s", name)
            shutil.rmtree(earlier, ignore_errors=True)
            folder.rename(earlier)
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(mode=0o700)
        (folder / places.OWNER).write_text(f"{os.getpid()} {start_time_of(os.getpid())}")
        return folder

    def end(self, folder: Path) -> None:
        """Releases the folder of a closed session, or removes it if it holds no work."""
        if places.has_saved_work(folder):
            (folder / places.OWNER).unlink(missing_ok=True)
        else:
            shutil.rmtree(folder, ignore_errors=True)

    def _folder(self, key: str) -> Path:
        return self.root / hashlib.sha256(key.encode()).hexdigest()[:32]

    def _prune(self) -> None:
        unused = [p for p in self.root.iterdir() if p.is_dir() and not _is_in_use(p)]
        suffix = places.REPLACED_SUFFIX
        whole = [p for p in unused if places.has_saved_work(p) and not p.name.endswith(suffix)]
        free, now, stay = MOST_BYTES, time.time(), set[Path]()
        for number, folder in enumerate(sorted(whole, key=places.saved_at, reverse=True)):
            free -= folder_bytes(folder)
            if free < 0 or number >= MOST_FOLDERS or now - places.saved_at(folder) > LONGEST_AGE:
                log.info("Work of %s is removed", time.ctime(places.saved_at(folder)))
            else:
                stay.add(folder)
        for folder in unused:
            if folder in stay:
                places.remove_partial_files(folder)
            else:
                shutil.rmtree(folder, ignore_errors=True)


def folder_bytes(folder: Path) -> int:
    """Bytes of all files in the folder."""
    total = 0
    for path in folder.rglob("*"):
        with contextlib.suppress(OSError):  # gone meanwhile
            total += path.lstat().st_size
    return total


def _is_in_use(folder: Path) -> bool:
    """Whether a running server uses the folder."""
    try:
        number, _, began = (folder / places.OWNER).read_text().partition(" ")
        process = int(number)
    except (OSError, ValueError):
        return False
    return is_running(process) and (not began or start_time_of(process) == began)


STATE_VARIABLE = "FLEXGUI_STATE"
"""Environment variable that sets another state folder."""


def state_folder() -> Path:
    """The folder of data that outlives the server."""
    chosen = os.environ.get(STATE_VARIABLE)
    return Path(chosen) if chosen else user_state_path("flexgui", appauthor=False)


def private_folder(folder: Path) -> Path:
    """Makes the folder if needed and closes it to other users (0700); OSError if it cannot."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    folder.chmod(0o700)
    return folder


PREFIX = "flexgui-"


def new_root() -> Path:
    """A new temporary folder (0700); removes those of killed servers."""
    for path in Path(tempfile.gettempdir()).glob(f"{PREFIX}*-*"):
        process = path.name[len(PREFIX) :].partition("-")[0]
        if process.isdigit() and not is_running(int(process)) and _is_own(path):
            shutil.rmtree(path, ignore_errors=True)
    return Path(tempfile.mkdtemp(prefix=f"{PREFIX}{os.getpid()}-"))


def _is_own(folder: Path) -> bool:
    try:
        owned = folder.lstat().st_uid == os.getuid()
    except OSError:
        return False
    return owned and folder.is_dir() and not folder.is_symlink()


def start_time_of(process: int) -> str:
    """When a process started, in ticks of the system; "" if it does not exist or is not known.

    Process numbers are reused after a restart: the start time shows whether it is the same process.
    """
    try:
        after_name = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return ""
    return "" if after_name[0] in "ZX" else after_name[19]


def is_running(process: int) -> bool:
    """Whether the process runs; True elsewhere than on POSIX, where asking could end it."""
    if os.name != "posix":
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
