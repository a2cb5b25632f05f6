"""The measurement of `make load` itself, with a few browsers."""

from __future__ import annotations

import asyncio
from pathlib import Path

import numpy as np

from tests.server.helpers import apart
from tests.server.load import (
    Left,
    Looks,
    crowd_at_work,
    left,
    memory_over_time,
    of_crowd,
    of_visits,
)
from tests.server.served import served

FEW, SECONDS = 3, 12.0
"""Long enough for a look at the memory in each quarter of it."""


def test_a_few_are_answered_and_kept_apart(tmp_path: Path) -> None:
    with served(tmp_path, "--workers", "1") as server:
        members, looks = apart(asyncio.run, crowd_at_work(server, FEW, SECONDS, jobs=1))
        lines = {line.what: line for line in of_crowd(members, looks, server)}
        assert left(server, tmp_path).folders == FEW, "they were just there"
    assert lines["3: last moves shown"].good and lines["3: others' moves shown"].good
    assert lines["3: errors logged"].good
    assert sum(len(a) for m in members for a in m.answers.values()) > 0


def test_what_grows_is_said() -> None:
    same = [Left(50, 40, 0, 400.0)] * 3
    assert all(line.good for line in of_visits(same, 100))
    more = [*same, Left(51, 43, 2, 460.0)]
    assert not any(line.good for line in of_visits(more, 100))


def test_memory_that_climbs_is_not_flat() -> None:
    seconds = np.linspace(0.0, 120.0, 25)
    assert memory_over_time("it", Looks(seconds, 400.0 + 0.1 * seconds)).good
    assert not memory_over_time("it", Looks(seconds, 400.0 + seconds)).good
