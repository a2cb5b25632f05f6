"""Compiled code that is kept: damaged it is made anew, and where nothing can be kept all runs."""

from __future__ import annotations

import errno
import itertools
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from flexgui.core.arm import cache
from flexgui.core.arm.arm import Structure
from flexgui.core.arm.compiled import _name as name_of
from flexgui.core.arm.compiled import compile_wide_arm
from tests.helpers import PAPER

WORK = """
import numpy as np
from flexgui.core.arm.arm import Arm
from flexgui.core.arm.compiled import compile_arm
from flexgui.core.arm.segment import Segment
from flexgui.core.arm.arm import Structure
link = Segment(length=0.5, mass=2.0, modes=0)
arm = compile_arm(Structure.of(Arm(segments=(link,), name="link")))
p = np.linspace(1.0, 2.0, 60)
print(arm.mass_matrix(np.array([0.3]), p)[0, 0])
"""

STARTS = f"""
import os, sys
import numba.core.registry, numpy, pydantic, sympy
for line in sys.stdin:
    folder, said, trouble = line.rstrip("\\n").split("\\t")
    child = os.fork()
    if not child:
        os.environ[{cache.VARIABLE!r}] = folder
        for path, stream in ((said, 1), (trouble, 2)):
            os.dup2(os.open(path, os.O_CREAT | os.O_WRONLY | os.O_TRUNC), stream)
        exec({WORK!r}, {{}})
        break
    print(os.waitpid(child, 0)[1], flush=True)
"""
"""Each folder's process is one of its own, but the libraries are imported once for all of them."""

Work = Callable[[Path], tuple[str, str]]


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Work]:
    """What a process that compiles an arm of one rigid link computes with it, and what it says."""
    given = {name: text for name, text in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    told = [tmp_path_factory.mktemp("told") / name for name in ("said", "trouble")]
    with subprocess.Popen(
        [sys.executable, "-c", STARTS], env=given, text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    ) as starts:  # fmt: skip

        def once(folder: Path) -> tuple[str, str]:
            assert starts.stdin is not None and starts.stdout is not None
            print(folder, *told, sep="\t", file=starts.stdin, flush=True)
            assert starts.stdout.readline() == "0\n", told[1].read_text()
            said, trouble = (path.read_text() for path in told)
            return said, trouble

        yield once


@pytest.fixture(scope="module")
def kept(work: Work, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A folder in which all was compiled once, and the number that came out."""
    folder = tmp_path_factory.mktemp("kept")
    said, trouble = work(folder)
    assert float(said) > 0.0 and trouble == ""
    assert work(folder) == (said, "")
    return folder, said


def changed_sign(content: bytes) -> bytes:
    """Valid code that computes something else."""
    assert b" + " in content
    return content.replace(b" + ", b" - ", 1)


def garbled(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes(255 - b for b in content[middle : middle + 64]) + content[
        middle + 64 :
    ]  # fmt: skip


def half_or_nothing() -> Callable[[bytes], bytes]:
    """In turn, so that one run meets both."""
    turns = itertools.cycle((True, False))
    return lambda content: content[: len(content) // 2] if next(turns) else b""


DAMAGE: dict[str, tuple[str, Callable[[bytes], bytes]]] = {
    "an emptied module": ("arm_*.py", lambda content: b""),
    "half a module": ("arm_*.py", lambda content: content[: len(content) // 2]),
    "another sign in a module": ("arm_*.py", changed_sign),
    "garbled machine code": ("**/*.nbc", garbled),
    "indices, halved and emptied": ("**/*.nbi", half_or_nothing()),
}


@pytest.mark.long
@pytest.mark.parametrize("damage", DAMAGE)
def test_what_is_damaged_is_made_anew_and_said_once(
    damage: str, work: Work, kept: tuple[Path, str], tmp_path: Path
) -> None:
    pattern, spoil = DAMAGE[damage]
    folder = tmp_path / "cache"
    # With the times of the files, by which Numba knows whether they belong together.
    shutil.copytree(kept[0], folder)
    files = list(folder.glob(pattern))
    assert len(files) > ("nbi" in pattern), "an index of each kind"
    for file in files:
        file.write_bytes(spoil(file.read_bytes()))
    said, trouble = work(folder)
    assert said == kept[1]
    assert trouble.count("\n") == 1 and "damaged" in trouble
    assert work(folder) == (kept[1], "")


@pytest.mark.long
def test_without_a_folder_it_works_in_a_temporary_one(
    work: Work, kept: tuple[Path, str], tmp_path: Path
) -> None:
    place = tmp_path / "file"
    place.touch()
    said, trouble = work(place / "cache")
    assert said == kept[1]
    assert trouble.count("\n") == 1 and "cannot be used" in trouble and str(place) in trouble
    assert "Traceback" not in trouble


@pytest.mark.long
def test_a_second_checkout_compiles_nothing_again(tmp_path: Path) -> None:
    """Continuous integration and a second clone start from what the first one left."""
    cached = tmp_path / "cache"
    environment = {**os.environ, cache.VARIABLE: str(cached)}
    compiling = (
        "import numpy as np; from physics.simulate.discrete import exponential; "
        "exponential(np.zeros((1, 8)), 1, np.empty((5, 1, 8)))"
    )
    kept = []
    for place in ("first", "second"):
        copy, without = tmp_path / place / "physics", shutil.ignore_patterns("__pycache__")
        shutil.copytree(cache.PACKAGE, copy, ignore=without)
        subprocess.run(
            [sys.executable, "-c", compiling],
            cwd=tmp_path / place, env=environment | {"PYTHONPATH": "."}, check=True,
        )  # fmt: skip
        kept.append({p: p.stat().st_mtime_ns for p in cached.rglob("*.nb?")})
    assert kept[0] and kept[1] == kept[0]


def test_a_disk_that_becomes_full_is_said_and_another_folder_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    full = tmp_path / "full"
    monkeypatch.setenv(cache.VARIABLE, str(full))
    assert cache.cache_folder() == full
    write = Path.write_bytes

    def no_room(path: Path, content: bytes) -> int:
        if full in path.parents:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(path, content)

    monkeypatch.setattr(Path, "write_bytes", no_room)
    module = cache.cached_module("force_of_a_test", lambda: "answer = 42\n")
    monkeypatch.delitem(sys.modules, module.__name__)
    assert module.answer == 42 and full not in Path(str(module.__file__)).parents
    assert caplog.text.count("no space left on device") == 1


def test_a_cache_that_cannot_grow_keeps_the_result(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Numba wrote its files after compiling; that they do not fit must not cost the function."""
    cache.verify_kernels()
    import numba

    def no_room(*given: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    from numba.core import caching

    monkeypatch.setattr(caching.IndexDataCacheFile.__mro__[1], "save", no_room)

    @numba.njit(cache=True)
    def twice(x):  # type: ignore[no-untyped-def]
        return 2 * x

    assert twice(21) == 42
    assert "cannot be saved" in caplog.text


def test_the_module_for_many_arms_at_once_is_kept_with_a_digest_too() -> None:
    structure = Structure.of(PAPER)
    compile_wide_arm(structure)
    assert cache.is_whole(cache.module_file(f"wide_{name_of(structure)}"))
