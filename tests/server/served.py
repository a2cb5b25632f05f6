"""`flexgui serve` as a process of its own, and a look at what it costs."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flexgui.server.work_folders import STATE_VARIABLE
from tests.server.helpers import Browser, action, announcement, part

ROOT = Path(__file__).resolve().parents[2]
PAGE = re.compile(r"http://127\.0\.0\.1:(\d+)/")
START = 60.0
"""s until the address stands in the terminal, on a machine where nothing is compiled yet."""
PATIENCE = 20.0
"""s for a page to be built on a busy machine."""
END = 15.0
"""s; a server gives itself five."""
MEGA = 2**20
UPLOAD = "Upload a recording or a scenario"
PIECE = 2**19
"""Bytes of one part of an upload."""


@dataclass(frozen=True)
class Served:
    """Has a `port`, as a server in this process has: `Browser` takes both."""

    process: subprocess.Popen[str]
    said: Path
    complained: Path

    @property
    def port(self) -> int:
        found = PAGE.search(self.said.read_text())
        assert found is not None
        return int(found[1])

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def terminal(self) -> str:
        return self.said.read_text()

    @property
    def log(self) -> str:
        """All that it complained of."""
        return self.complained.read_text()

    @property
    def alive(self) -> bool:
        return self.process.poll() is None

    @property
    def workers(self) -> tuple[int, ...]:
        """Process ids of its job workers."""
        return tuple(
            pid for pid in _children(self.process.pid) if "spawn_main" in _command_line(pid)
        )

    @property
    def memory(self) -> tuple[float, float]:
        """MB of the server itself, and of its workers together."""
        return _resident(self.process.pid), sum(_resident(pid) for pid in self.workers)

    @property
    def worked(self) -> dict[int, float]:
        """Process id -> s of a processor that each of its job workers has taken so far."""
        return {pid: _processor_time(pid) for pid in self.workers}

    def browser(self, **more: Any) -> Browser:
        return Browser(self, **more)  # type: ignore[arg-type]


@contextlib.contextmanager
def served(
    folder: Path, *options: str, nice: bool = False, cwd: Path = ROOT, **environment: str
) -> Iterator[Served]:
    """A server on a free port of this machine; ended as Ctrl-C ends it.

    `nice`: its workers step back behind other programs, as they do for everybody. It is started in
    the folder `cwd` with what `environment` adds to this process's.
    """
    said, complained = folder / "stdout.txt", folder / "stderr.txt"
    program = "flexgui" if nice else "tests.programs.load.even"
    command = [sys.executable, "-m", program, "serve", "--no-browser", "--port", "0", *options]
    with said.open("w") as out, complained.open("w") as err:
        process = subprocess.Popen(
            command, cwd=cwd, stdout=out, stderr=err, text=True, start_new_session=True,
            env={
                **os.environ, "PYTHONUNBUFFERED": "1", STATE_VARIABLE: str(folder / "state"),
                **environment,
            },
        )  # fmt: skip
    try:
        until(lambda: process.poll() is not None or PAGE.search(said.read_text()), START)
        assert process.poll() is None, complained.read_text()
        yield Served(process, said, complained)
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(END)
        finally:
            process.kill()


def widget(browser: Browser, label: str, kind: str = "") -> str:
    """The uuid of the first widget with that label, once it is there."""

    def find() -> str | None:
        for message in browser.heard:
            if message.get("props", {}).get("label") == label and kind in message["type"]:
                return str(message["uuid"])
        return None

    return str(until(lambda: browser.listen() and find(), PATIENCE, label))


def stands(browser: Browser) -> None:
    """Waits for a whole page: its last button."""
    widget(browser, "Plan and download (zip)", "GuiButton")


def show(browser: Browser, stage: str) -> None:
    """Another stage, as by its button."""
    browser.set(widget(browser, "Action"), action("stage", stage))


def press(browser: Browser, label: str) -> None:
    browser.set(widget(browser, label, "GuiButton"), True)


def upload(browser: Browser, name: str, content: bytes) -> None:
    """A file, in pieces as a browser sends it."""
    pieces = [content[k : k + PIECE] for k in range(0, len(content), PIECE)]
    start = announcement(widget(browser, UPLOAD), len(content), len(pieces), name)
    browser.send(start)
    for k, piece in enumerate(pieces):
        browser.send(part(start, k, piece))


def texts(browser: Browser) -> str:
    """All words that the page was told so far."""
    parts = [m.get("props", {}).get("content", "") for m in browser.heard]
    parts += [m["updates"].get("content", "") for m in browser.heard if "updates" in m]
    return "\n".join(part for part in parts if isinstance(part, str))


def sees(browser: Browser, text: str, patience: float) -> None:
    """Waits for words on the page."""
    until(lambda: browser.listen() and text in texts(browser), patience, text)


def until(found: Callable[[], Any], patience: float, what: str = "it") -> Any:
    """The first true answer."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        if value := found():
            return value
        time.sleep(0.01)
    raise AssertionError(f"{what} did not come within {patience:g} s")


def _children(pid: int) -> list[int]:
    folder = Path(f"/proc/{pid}/task")
    files = folder.glob("*/children")
    return [int(child) for file in files for child in _read(file).split()]


def _command_line(pid: int) -> str:
    return _read(Path(f"/proc/{pid}/cmdline")).replace("\0", " ")


def _resident(pid: int) -> float:
    found = re.search(r"VmRSS:\s+(\d+) kB", _read(Path(f"/proc/{pid}/status")))
    return int(found[1]) * 1024 / MEGA if found else 0.0


def _processor_time(pid: int) -> float:
    """s, from the fields utime and stime of proc(5), which come after the name in brackets."""
    fields = _read(Path(f"/proc/{pid}/stat")).rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") if fields else 0.0


def _read(path: Path) -> str:
    try:
        return path.read_text()
    except OSError:  # gone meanwhile
        return ""
