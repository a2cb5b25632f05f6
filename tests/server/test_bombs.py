"""Three files that unpack to much more than they are, at once, on the real server."""

from __future__ import annotations

import io
import struct
import time
import zipfile
import zlib
from functools import cache
from pathlib import Path

import pytest

from tests.recording.test_large_files import mat_of_zeros
from tests.server.helpers import Browser
from tests.server.served import served, stands, until, upload
from tests.session.helpers import largest

pytestmark = pytest.mark.long

GIGA = 2**30
MOST = 1500.0
"""MB of the server itself, at any moment."""
NEW_PAGE = 3.0
"""s until somebody who comes meanwhile has a page, on a machine that does nothing else."""
REFUSED = 240.0
"""s for all three to be refused."""


def gz_of_rows(size: int) -> bytes:
    """A table of zeros, a thousandth as large as a file."""
    packer = zlib.compressobj(6, zlib.DEFLATED, 31)
    rows = b"0,0\n" * 2**18
    pieces = [packer.compress(b"t,theta1\n")]
    pieces += [packer.compress(rows) for _ in range(size // len(rows))]
    return b"".join([*pieces, packer.flush()])


def zip_that_lies(size: int) -> bytes:
    """Its directory says that its one file has ten bytes."""
    room = io.BytesIO()
    with zipfile.ZipFile(room, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.toml", bytes(size))
    whole = bytearray(room.getvalue())
    for mark, place in ((b"PK\3\4", 22), (b"PK\1\2", 24)):
        at = whole.index(mark) + place
        whole[at : at + 4] = struct.pack("<I", 10)
    return bytes(whole)


@cache
def bombs() -> dict[str, bytes]:
    return {
        "one.mat": mat_of_zeros(GIGA),
        "rows.csv.gz": gz_of_rows(3 * GIGA),
        "work.zip": zip_that_lies(GIGA),
    }


def refused(browser: Browser, name: str) -> None:
    """Waits for the sentence."""

    def said() -> bool:
        browser.listen()
        found = [str(m.get("updates", m.get("props", {})).get("content")) for m in browser.heard]
        return any(name in text and "bad" in text for text in found)

    until(said, REFUSED, f"a sentence about {name}")


def test_the_server_neither_grows_nor_stands_still(tmp_path: Path) -> None:
    content = bombs()
    with served(tmp_path, "--workers", "1", nice=True) as server:
        browsers = {name: server.browser() for name in content}
        for browser in browsers.values():
            browser.__enter__()
            stands(browser)
        waits = []
        with largest(lambda: server.memory[0]) as most:
            for name, browser in browsers.items():
                upload(browser, name, content[name])
            for _ in range(3):
                begin = time.monotonic()
                with server.browser() as newcomer:
                    stands(newcomer)
                waits.append(time.monotonic() - begin)
            for name, browser in browsers.items():
                refused(browser, name)
                browser.__exit__(None, None, None)
        said = ", ".join(f"{s:.1f}" for s in waits)
        print(f"\nat most {most[0]:.0f} MB; new pages after {said} s")
        assert most[0] < MOST
        assert max(waits) < NEW_PAGE
        assert server.alive and "Traceback" not in server.log, server.log
