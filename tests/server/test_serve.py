"""The command itself, in a process of its own."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from flexgui.core.errors import InputError
from flexgui.plain_words import INTERNAL
from flexgui.server.options import ServeOptions, bind, origin_of
from flexgui.server.serve import tickets_of
from flexgui.server.tickets import qr_text
from tests.server.served import served

ENDING = 5.0
"""s after Ctrl-C that a person waits."""

posix = pytest.mark.skipif(os.name != "posix", reason="signals")


def members(group: int) -> list[int]:
    """Processes of a group that are alive."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[2]) == group and fields[0] != "Z":
            found.append(int(path.parent.name))
    return found


@posix
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="counts processes by /proc")
def test_ctrl_c_ends_it_soon_with_no_process_and_no_folder_left(tmp_path: Path) -> None:
    with served(tmp_path, "--workers", "1", nice=True, TMPDIR=str(tmp_path)) as server:
        process = server.process
        assert list(tmp_path.glob("flexgui-*"))
        start = time.monotonic()
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to the workers too
        code = process.wait(ENDING)
        assert code == 0 and time.monotonic() - start < ENDING
        end = time.monotonic() + ENDING
        while members(process.pid) and time.monotonic() < end:
            time.sleep(0.05)
        assert not members(process.pid)
        assert not list(tmp_path.glob("flexgui-*"))


SIGNALLED = """
import faulthandler, os, random, signal, time
from flexgui.server.serve import stop_on_signal
faulthandler.dump_traceback_later(60.0, exit=True)
for trial in range(200):
    with stop_on_signal() as stopped:
        if not (child := os.fork()):
            end = time.perf_counter() + random.Random(trial).uniform(1e-3, 3e-3)
            while time.perf_counter() < end:
                pass
            os.kill(os.getppid(), signal.SIGINT)
            os._exit(0)
        while not stopped(1e-6):
            pass
        os.waitpid(child, 0)
"""
"""Signals from another process while the main thread is almost always within `stopped`."""


@posix
def test_a_signal_is_heard_at_any_step_of_waiting_for_it() -> None:
    ended = subprocess.run([sys.executable, "-c", SIGNALLED], capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr


@posix
def test_a_busy_port_gives_the_next_one_and_says_so(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with served(tmp_path, "--workers", "1", "--port", str(port)) as server:
            said = re.search(
                r"Port (\d+) is busy; FlexGUI uses (\d+)", server.terminal + server.log
            )
            assert said is not None
            assert int(said[1]) == port < int(said[2]) == server.port


def test_a_server_that_had_to_be_cut_off_says_so_and_fails() -> None:
    code = "import flexgui.server.serve as s; s.force_exit_after(0.1); s.threading.Event().wait()"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert ended.returncode == INTERNAL
    assert "did not end within 0.1 s" in ended.stderr and len(ended.stderr.splitlines()) == 1


def test_only_busy_ports_are_one_sentence() -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as taken,
        pytest.raises(InputError, match="busy; choose another with --port"),
    ):
        bind("127.0.0.1", taken.getsockname()[1], 1)


def test_an_address_of_another_machine_is_one_sentence() -> None:
    with pytest.raises(InputError, match="check --host"):
        bind("192.0.2.1", 0, 1)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (ServeOptions(host="0.0.0.0"), "--lan"),
        (ServeOptions(host="192.168.1.5"), "--lan"),
        (ServeOptions(join_code="ABCDEFGH"), "--lan"),
        (ServeOptions(port=70_000), "--port 70000"),
        (ServeOptions(workers=0), "--workers 0"),
        (ServeOptions(data=Path("no/such/folder")), "--data"),
    ],
)
def test_options_that_do_not_fit_are_one_sentence(options: ServeOptions, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        options.check()


def test_without_a_word_about_the_network_only_this_machine_is_served() -> None:
    assert ServeOptions().address == "127.0.0.1"
    assert tickets_of(ServeOptions()) is None
    assert tickets_of(ServeOptions(lan=True)) is not None
    lines = qr_text("http://192.0.2.1:8080/?code=K7QM-2XWP").splitlines()
    assert len({len(line) for line in lines}) == 1 and len(lines) > 10


@pytest.mark.parametrize(
    "url", ["", "lab", "ftp://a", "http://", "http://a/b", "http://a:x", "null"]
)
def test_an_origin_that_is_none_is_one_sentence(url: str) -> None:
    with pytest.raises(InputError, match="--origin"):
        origin_of(url)
