"""Three files that unpack to much more than they are, at once, on the real server."""

from __future__ import annotations

import io
import struct
import threading
import time
import zipfile
import zlib
from functools import cache
from pathlib import Path

import pytest

from tests.recording.test_large_files import mat_of_zeros
from tests.server.helpers import Browser, announcement, part
from tests.server.served import Served, served, until, widget

pytestmark = pytest.mark.long

GIGA = 2**30
MOST = 1500.0
"""MB of the server itself, at any moment."""
NEW_PAGE = 3.0
"""s until somebody who comes meanwhile has a page, on a machine that does nothing else."""
REFUSED = 240.0
"""s for all three to be refused."""
PIECE = 2**19
"""Bytes of one part of an upload."""


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


def upload(browser: Browser, name: str, content: bytes) -> None:
    pieces = [content[k : k + PIECE] for k in range(0, len(content), PIECE)]
    uuid = widget(browser, "Upload a recording or a scenario")
    start = announcement(uuid, len(content), len(pieces), name)
    browser.send(start)
    for k, piece in enumerate(pieces):
        browser.send(part(start, k, piece))


def refused(browser: Browser, name: str) -> None:
    """Waits for the sentence."""

    def said() -> bool:
        browser.listen()
        found = [str(m.get("updates", m.get("props", {})).get("content")) for m in browser.heard]
        return any(name in text and "bad" in text for text in found)

    until(said, REFUSED, f"a sentence about {name}")


class Watch:
    """The server's memory, all the time."""

    def __init__(self, server: Served) -> None:
        self.most, self._server, self._over = 0.0, server, threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._over.wait(0.02):
            self.most = max(self.most, self._server.memory[0])

    def end(self) -> float:
        """MB at most."""
        self._over.set()
        self._thread.join()
        return self.most


def test_the_server_neither_grows_nor_stands_still(tmp_path: Path) -> None:
    content = bombs()
    with served(tmp_path, "--workers", "1", nice=True) as server:
        browsers = {name: server.browser() for name in content}
        for browser in browsers.values():
            browser.__enter__()
            widget(browser, "3-D playback (HTML)", "GuiButton")
        watch, waits = Watch(server), []
        for name, browser in browsers.items():
            upload(browser, name, content[name])
        for _ in range(3):
            begin = time.monotonic()
            with server.browser() as newcomer:
                widget(newcomer, "3-D playback (HTML)", "GuiButton")
            waits.append(time.monotonic() - begin)
        for name, browser in browsers.items():
            refused(browser, name)
            browser.__exit__(None, None, None)
        most = watch.end()
        print(f"\nat most {most:.0f} MB; new pages after {', '.join(f'{s:.1f}' for s in waits)} s")
        assert most < MOST
        assert max(waits) < NEW_PAGE
        assert server.alive and "Traceback" not in server.log, server.log
