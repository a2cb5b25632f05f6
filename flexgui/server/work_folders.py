"""Folders of sessions that may outlive the server, and whether a running server uses them."""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import shutil
import tempfile
import time
from pathlib import Path

from platformdirs import user_state_path

from flexgui import places
from flexgui.server.services import MEGA

log = logging.getLogger(__name__)

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
