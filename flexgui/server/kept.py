"""Folders of sessions that outlive the server, found again by the key that a browser keeps; and its
temporary folder. Only the server's own user may read them."""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import secrets
import shutil
import tempfile
import time
from pathlib import Path

from platformdirs import user_state_path

from flexgui.places import (
    FRESH,
    OWNER,
    earlier_folder,
    is_kept,
    kept_at,
    remove_half_written,
    set_aside,
)  # fmt: skip
from flexgui.server.limits import MEGA

MOST, MOST_BYTES, LONGEST = 200, 2000 * MEGA, 30 * 86400.0
"""Sessions, bytes of all of them, and s since one was changed: the oldest go first."""

log = logging.getLogger(__name__)


class KeptWork:
    """One folder per session, named so that lists of files tell no keys."""

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
        for folder in self.root.glob(f"*{FRESH}"):
            if not _used(folder):
                shutil.rmtree(folder, ignore_errors=True)
        unused = [p for p in self.root.iterdir() if p.is_dir() and not _used(p)]
        whole = sorted((p for p in unused if is_kept(p)), key=kept_at, reverse=True)
        free, now = MOST_BYTES, time.time()
        for number, folder in enumerate(whole):
            free -= sum(p.lstat().st_size for p in folder.rglob("*"))
            if free < 0 or number >= MOST or now - kept_at(folder) > LONGEST:
                log.info("Work of %s is too old or too much and goes", time.ctime(kept_at(folder)))
                shutil.rmtree(folder, ignore_errors=True)
        for folder in set(unused) - set(whole):
            shutil.rmtree(folder, ignore_errors=True)
        for folder in whole:
            remove_half_written(folder)


def _used(folder: Path) -> bool:
    """By a server that runs."""
    try:
        number, _, began = (folder / OWNER).read_text().partition(" ")
        process = int(number)
    except (OSError, ValueError):
        return False
    if os.name != "posix":  # elsewhere asking a process for life may end it
        return True
    return alive(process) and (not began or born(process) == began)


VARIABLE = "FLEXGUI_STATE"
KEY_FILE, KEY_BYTES = "server.key", 32


def state_folder() -> Path:
    """The user's own; the variable FLEXGUI_STATE moves it."""
    chosen = os.environ.get(VARIABLE)
    return Path(chosen) if chosen else user_state_path("flexgui", appauthor=False)


def private(folder: Path) -> Path:
    """The folder, made if need be, closed to others (0700); OSError where it cannot be."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    folder.chmod(0o700)
    return folder


def server_key() -> bytes:
    """Random, and the same at the next start: who was in with a code that still holds stays in.

    Where nothing can be kept, a fresh one.
    """
    fresh = secrets.token_bytes(KEY_BYTES)
    with contextlib.suppress(OSError):
        path = private(state_folder()) / KEY_FILE
        with contextlib.suppress(FileExistsError):
            handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with os.fdopen(handle, "wb") as file:
                file.write(fresh)
        kept = path.read_bytes()
        if len(kept) == KEY_BYTES:
            return kept
        path.unlink()  # cut short by a crash: the next start makes it anew
    return fresh


PREFIX = "flexgui-"


def new_root() -> Path:
    """A fresh folder (0700), after those of servers that were killed have been removed."""
    _remove_left_behind(Path(tempfile.gettempdir()))
    return Path(tempfile.mkdtemp(prefix=f"{PREFIX}{os.getpid()}-"))


def _remove_left_behind(parent: Path) -> None:
    if os.name != "posix":  # elsewhere asking a process for life may end it
        return
    for path in parent.glob(f"{PREFIX}*-*"):
        process = path.name[len(PREFIX) :].partition("-")[0]
        try:
            mine = path.lstat().st_uid == os.getuid() and path.is_dir() and not path.is_symlink()
        except OSError:
            continue
        if mine and process.isdigit() and not alive(int(process)):
            shutil.rmtree(path, ignore_errors=True)


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
    """Whether there is such a process (POSIX)."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
