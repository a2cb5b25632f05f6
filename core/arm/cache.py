"""The cache of compiled code, in the user's cache folder.

Each file ends with a digest, so that a damaged file is compiled again and never run. Python reads
the digest as a comment, and Numba's reader stops before it.
"""

from __future__ import annotations

import atexit
import hashlib
import importlib.util
import logging
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from platformdirs import user_cache_path

VARIABLE = "FLEXGUI_CACHE"
PACKAGE = Path(__file__).parent.parent
"""The folder of `core`."""
_COMPILED_PACKAGES = ("arm", "forces", "lanes", "simulate")
PROBE = bytes(2**16)
"""What is written to see whether there is room: more than the largest generated module."""
WITHOUT = (
    "The cache folder %s cannot be used (%s). Compiled code goes to a temporary folder and is "
    "compiled again at each start. Free some space there, or name another folder in "
    + VARIABLE
    + "."
)

log = logging.getLogger(__name__)


def cache_folder() -> Path:
    """The user's cache folder, or FLEXGUI_CACHE; a temporary folder where it cannot be written."""
    chosen = os.environ.get(VARIABLE)
    return _usable(Path(chosen) if chosen else user_cache_path("flexgui", appauthor=False))


@cache
def _usable(folder: Path) -> Path:
    probe = folder / f".probe-{os.getpid()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe.write_bytes(PROBE)
        probe.unlink()
    except OSError as error:
        return without_folder(folder, error)
    return folder


def without_folder(folder: Path, error: OSError) -> Path:
    """A temporary folder instead of one that cannot be written any more, said in one sentence."""
    log.warning(WITHOUT, folder, (error.strerror or type(error).__name__).lower())
    temporary = tempfile.mkdtemp(prefix="flexgui-")
    atexit.register(shutil.rmtree, temporary, ignore_errors=True)
    os.environ[VARIABLE] = temporary  # processes that this one starts share it
    return Path(temporary)


@cache
def sources_key() -> str:
    """Changes with any source that is compiled or that writes what is compiled.

    Numba itself watches only the file of the function that it keeps, not of those it calls: an
    edit to one of them would go unnoticed.
    """
    digest = hashlib.sha256()
    files: list[Path] = []
    for package in _COMPILED_PACKAGES:
        files += sorted((PACKAGE / package).rglob("*.py"))
    for file in files:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def use_cache_folder() -> None:
    """Point Numba's cache to a folder of this version, unless the user has chosen one."""
    from numba import config

    verify_kernels()
    if not os.environ.get("NUMBA_CACHE_DIR"):
        config.CACHE_DIR = str(cache_folder() / f"kernels_{sources_key()}")
        share_kernels(config.CACHE_DIR)


MARK = b"\n# sha256 "
TRAILER = len(MARK) + 64 + 1
DAMAGED = "A cache file is damaged; its content is compiled again."
NOT_KEPT = "Compiled code cannot be saved (%s); the next start compiles it again."


def trailer(digest: Any) -> bytes:
    """What stands at the end of a file whose other bytes have this digest."""
    return MARK + digest.hexdigest().encode() + b"\n"


def is_whole(path: Path) -> bool:
    """Whether a file is there with all that was once written; says so once where it is damaged."""
    try:
        content = path.read_bytes()
    except OSError:
        return False
    whole = content[-TRAILER:] == trailer(hashlib.sha256(content[:-TRAILER]))
    if not whole:
        _warn_once(DAMAGED)
    return whole


@cache
def _warn_once(sentence: str, *values: str) -> None:
    log.warning(sentence, *values)


def module_file(name: str) -> Path:
    """Where a generated module is kept."""
    return cache_folder() / f"{name}.py"


def cached_module(name: str, make: Callable[[], str]) -> ModuleType:
    """The generated module of that name, executed once; `make` writes its text where it is not
    in the cache, or not as it was written."""
    module_name = f"flexgui_{name}"
    if module_name in sys.modules:
        return sys.modules[module_name]
    file = module_file(name)
    if not is_whole(file):
        content = make().encode()
        try:
            _write(file, content)
        except OSError as error:
            without_folder(file.parent, error)
            file = module_file(name)
            _write(file, content)
    return _executed(module_name, file)


def _write(file: Path, content: bytes) -> None:
    draft = file.with_suffix(f".{os.getpid()}.tmp")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        draft.write_bytes(content + trailer(hashlib.sha256(content)))
        draft.replace(file)
    finally:
        with suppress(OSError):
            draft.unlink()


def _executed(name: str, file: Path) -> ModuleType:
    use_cache_folder()
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


@cache
def verify_kernels() -> None:
    """From now on Numba's compiled files carry a digest too, and are read only if it is right: any
    other raises FileNotFoundError, as if it were missing, and Numba compiles again."""
    from numba.core import caching

    class Checksummed(caching.IndexDataCacheFile):
        """Numba's own file of one function, checked."""

        def save(self, key: Any, data: Any) -> None:
            try:
                super().save(key, data)
            except OSError as error:  # a full disk takes nobody's result
                _warn_once(NOT_KEPT, (error.strerror or type(error).__name__).lower())

        def _load_index(self) -> Any:
            return super()._load_index() if is_whole(Path(self._index_path)) else {}

        def _load_data(self, name: str) -> Any:
            path = Path(self._data_path(name))
            if not is_whole(path):
                raise FileNotFoundError(f"{path} is not as it was written")
            return super()._load_data(name)

        @contextmanager
        def _open_for_write(self, filepath: str) -> Iterator[Any]:
            with super()._open_for_write(filepath) as file:
                counted = _Counted(file)
                yield counted
                file.write(trailer(counted.digest))

    caching.IndexDataCacheFile = Checksummed


@cache
def share_kernels(folder: str) -> None:
    """Kernels of this package lie in `folder` by their place in the package, not on the disk: a
    second checkout with the same sources finds them. Numba's stamp is the file's own content."""
    from numba import config
    from numba.core import caching

    class ByPackage(caching.UserProvidedCacheLocator):
        """Of the files of this package, while `folder` is where Numba keeps its files."""

        @classmethod
        def from_function(cls, py_func: Any, py_file: str) -> Any:
            own = PACKAGE in Path(py_file).parents and folder == config.CACHE_DIR
            return super().from_function(py_func, py_file) if own else None

        @classmethod
        def get_suitable_cache_subpath(cls, py_file: str) -> str:
            return "_".join(Path(py_file).relative_to(PACKAGE.parent).parent.parts)

    caching.CacheImpl._locator_classes.insert(0, ByPackage)


class _Counted:
    """A file that keeps the digest of what is written."""

    def __init__(self, file: Any) -> None:
        self._file = file
        self.digest = hashlib.sha256()

    def write(self, data: Any) -> int:
        self.digest.update(data)
        return int(self._file.write(data))
