"""However the server ends, its workers end too."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from flexgui.jobs import JobPool, Stopped
from flexgui.jobs.job import STOPPED
from tests.jobs.conftest import LIGHT
from tests.jobs.helpers import PATIENCE, Listener, count, eventually, sleep_deaf, task

ROOT = Path(__file__).resolve().parents[2]

CLOSED_WITHIN = 5.0
"""s, what a person waits after Ctrl-C."""

SERVER = """
import os, signal, sys, time
from flexgui.jobs import JobPool
from tests.jobs.conftest import LIGHT
from tests.jobs.helpers import Listener, eventually, sleep_deaf, task

if __name__ == "__main__":
    # A shell that starts the tests in the background lets its children ignore Ctrl-C.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    pool = JobPool(2, LIGHT)
    job = pool.submit("s", task(sleep_deaf, seconds=60.0), Listener())
    assert eventually(lambda: pool.workers_ready == 2 and job.state.stage)
    print(*pool.worker_pids, flush=True)
    {end}
"""


def alive(pid: int) -> bool:
    """Whether a process runs; one that nobody has buried yet does not."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return False
    return status.rpartition(")")[2].split()[0] not in "ZX"


def start_server(folder: Path, end: str) -> tuple[subprocess.Popen[str], list[int]]:
    script = folder / "server.py"
    script.write_text(SERVER.replace("{end}", end))
    server = subprocess.Popen(
        [sys.executable, script],
        stdout=subprocess.PIPE,
        text=True,
        cwd=folder,
        env={"PYTHONPATH": str(ROOT), "PATH": ""},
    )
    assert server.stdout is not None
    return server, [int(pid) for pid in server.stdout.readline().split()]


@pytest.mark.long
def test_close_leaves_no_worker_and_no_thread_even_in_mid_work():
    import threading

    before = set(threading.enumerate())
    pool = JobPool(2, LIGHT)
    heard = Listener()
    deaf = pool.submit("a", task(sleep_deaf, seconds=60.0), Listener())
    pool.submit("b", task(count, steps=4000), heard)
    waits = pool.submit("b", task(count, steps=1), Listener())
    assert eventually(lambda: pool.workers_ready == 2 and deaf.state.stage != "")
    pids = pool.worker_pids
    start = time.monotonic()
    pool.close()
    assert time.monotonic() - start < CLOSED_WITHIN
    assert not any(alive(pid) for pid in pids)
    assert (deaf.state.phase, waits.state.phase) == (STOPPED, STOPPED)
    heard.wait_for(Stopped)
    assert eventually(lambda: set(threading.enumerate()) <= before)  # idle threads linger


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_workers_end_with_a_server_that_is_killed(tmp_path, number):
    server, pids = start_server(tmp_path, "time.sleep(60)")
    assert len(pids) == 2 and all(map(alive, pids))
    server.send_signal(number)
    assert eventually(lambda: not any(map(alive, pids)), CLOSED_WITHIN)
    server.wait(CLOSED_WITHIN)
    assert server.stdout is not None
    server.stdout.close()


@pytest.mark.long
def test_a_server_that_returns_without_closing_ends_and_leaves_no_worker(tmp_path):
    server, pids = start_server(tmp_path, "pass")
    server.wait(CLOSED_WITHIN)
    assert server.returncode == 0
    assert server.stdout is not None
    server.stdout.close()
    assert eventually(lambda: not any(map(alive, pids)), CLOSED_WITHIN)


@pytest.mark.parametrize("kept", [0, 1])
def test_workers_without_a_job_end_except_those_that_are_kept(kept: int) -> None:
    with JobPool(2, replace(LIGHT, kept=kept, idle_limit=0.5)) as pool:
        jobs = [pool.submit("s", task(count, steps=100), Listener()) for _ in range(2)]
        assert eventually(lambda: pool.workers_ready == 2)
        assert all(job.wait(PATIENCE) for job in jobs)
        assert eventually(lambda: pool.workers_ready == kept)
        again = pool.submit("s", task(count, steps=1), Listener())
        assert again.wait(PATIENCE) and again.result == 1
