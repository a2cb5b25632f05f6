"""The measurement of `make load` itself, with a few browsers."""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path

import numpy as np
import pytest

from tests.server import load
from tests.server.crowd import LateError, Member
from tests.server.helpers import action, apart
from tests.server.load import (
    AT_WORK,
    PATIENCE,
    Left,
    Line,
    Looks,
    at_work,
    crowd_at_work,
    left,
    memory_over_time,
    of_crowd,
    of_visits,
    on_a_server,
)
from tests.server.served import Served, served

pytestmark = pytest.mark.long

FEW, SECONDS, LOOK = 3, 5.0, 1.0
"""s: a look at the memory in each quarter of the time. The workers' processor time is counted in
hundredths of a second, and one that searches alone takes most of a core."""


async def searches_of_one(port: int) -> tuple[int, int]:
    """Started while the first still ran, and once it was over."""
    member = Member(0, 1, port)
    await member.arrive(PATIENCE)
    await member.identify()
    assert await member.working(PATIENCE)
    await member.identify_again()
    at_first = member.searches
    await member.set("Action", action("stage", "Identify"))
    await member.set("Stop", True)
    async with asyncio.timeout(PATIENCE):
        while member.searches == at_first:
            await member.identify_again()
    assert await member.working(PATIENCE)
    await member.leave()
    return at_first, member.searches


def test_a_few_are_answered_and_kept_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(load, "LOOK", LOOK)
    with served(tmp_path, "--workers", "1") as server:
        members, looks = apart(asyncio.run, crowd_at_work(server, FEW, SECONDS, jobs=1))
        lines = {line.what: line for line in of_crowd(members, looks, server)}
        assert left(server, tmp_path).folders == FEW, "they were just there"
        assert apart(asyncio.run, searches_of_one(server.port)) == (1, 2), "no second beside it"
    assert lines["3: last moves shown"].good and lines["3: others' moves shown"].good
    assert lines["3: errors logged"].good
    assert sum(len(a) for m in members for a in m.answers.values()) > 0
    assert looks.busy[1:].max() == 1


def test_a_wait_that_runs_out_is_a_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Dead:
        alive, log, workers = False, "ERROR lost", (1,)

    def late(server: Served, folder: Path) -> list[Line]:
        raise LateError("browser 7 saw no page in 240 s")

    monkeypatch.setattr(load, "served", lambda *options, **more: contextlib.nullcontext(Dead()))
    lines = on_a_server("30", late)
    assert not any(line.good for line in lines) and "browser 7" in lines[0].found
    assert "NO   30: ended early" in capsys.readouterr().out


def test_searches_that_pause_for_long_are_said() -> None:
    busy = np.array([2.0] * 21)
    looks = Looks(np.arange(21.0), np.full(21, 400.0), busy, 2)
    assert at_work("it", looks, 2).good
    busy[1 : 2 + int(20 * (1.0 - AT_WORK))] = 1.0
    assert not at_work("it", looks, 2).good


def test_what_grows_is_said() -> None:
    same = [Left(50, 40, 0, 400.0)] * 3
    assert all(line.good for line in of_visits(same, 100))
    more = [*same, Left(51, 43, 2, 460.0)]
    assert not any(line.good for line in of_visits(more, 100))


def test_memory_that_climbs_is_not_flat() -> None:
    seconds, none = np.linspace(0.0, 120.0, 25), np.zeros(25)
    assert memory_over_time("it", Looks(seconds, 400.0 + 0.1 * seconds, none)).good
    assert not memory_over_time("it", Looks(seconds, 400.0 + seconds, none)).good
