"""Thirty browsers at once, each moving its sliders, while identifications run.

`FLEXGUI_LOAD_SECONDS` (180) says for how long. Times and memory are printed (`pytest -s`), not
asserted: they are the machine's as much as the program's.
"""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import Iterator

import numpy as np
import pytest

from tests.server.crowd import Member
from tests.server.served import Served, served

pytestmark = pytest.mark.long

SESSIONS, JOBS = 30, 4
SECONDS = float(os.environ.get("FLEXGUI_LOAD_SECONDS", "180"))
PER_SECOND = 5.0
LOOK = 10.0
"""s between two looks at the memory."""
WARM = 30.0
"""s for all pages to be built and all jobs to run before the measurement begins."""
LAST_ANSWERS = 5.0
"""s after the last move."""


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(tmp_path_factory.mktemp("load"), "--workers", str(JOBS)) as found:
        yield found


async def crowd_at_work(server: Served) -> tuple[list[Member], list[tuple[float, float, float]]]:
    """The members after their work, and the memory: (s, MB of the server, MB of the workers)."""
    empty = server.memory
    print(f"\nwithout a page: server {empty[0]:.0f} MB, workers {empty[1]:.0f} MB")
    members = [Member(k, SESSIONS, server.port) for k in range(SESSIONS)]
    await asyncio.gather(*(member.arrive(WARM) for member in members))
    for member in members[:JOBS]:
        await member.identify()
    await asyncio.gather(*(member.working(WARM) for member in members[:JOBS]))
    begin = time.monotonic()
    memory = [(0.0, *server.memory)]
    moving = [
        asyncio.create_task(
            member.move(SECONDS, 1.0 / PER_SECOND, member.number / SESSIONS / PER_SECOND)
        )
        for member in members
    ]
    while time.monotonic() - begin < SECONDS:
        await asyncio.sleep(min(LOOK, SECONDS))
        memory.append((time.monotonic() - begin, *server.memory))
    await asyncio.gather(*moving)
    await asyncio.sleep(LAST_ANSWERS)
    for member in members[:JOBS]:
        await member.working(WARM)  # still
    for member in members:
        await member.leave()
    return members, memory


def told(name: str, seconds: list[float]) -> str:
    found = np.percentile(np.array(seconds) * 1e3, [50, 95, 99, 100])
    return f"{name}: {len(seconds)}, p50 {found[0]:.0f}, p95 {found[1]:.0f}, " + (
        f"p99 {found[2]:.0f}, most {found[3]:.0f} ms"
    )


def test_a_class_of_thirty_is_answered_and_kept_apart(server: Served) -> None:
    members, memory = asyncio.run(crowd_at_work(server))
    print(f"\n{SESSIONS} sessions, {JOBS} identifications, {SECONDS:g} s, load {os.getloadavg()}")
    print(told("moves of θ2", [s for m in members for s in m.answers["θ2 [deg]"]]))
    print(told("moves of ε", [s for m in members for s in m.answers["ε [GPa]"]]))
    print("superseded by a newer move:", sum(m.superseded for m in members))
    for seconds, own, workers in memory:
        print(f"{seconds:5.0f} s: server {own:.0f} MB, workers {workers:.0f} MB")
    assert [m.foreign for m in members] == [[] for _ in members]
    assert [m.last_shown for m in members] == [m.last_moved for m in members]
    assert server.alive
    assert "Traceback" not in server.log and "ERROR" not in server.log, server.log
