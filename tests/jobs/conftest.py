"""One light pool for all tests that leave it whole, one warm pool for real tasks."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from flexgui.jobs import JobPool
from flexgui.jobs.messages import PoolSettings
from tests.jobs.helpers import EVEN, eventually

LIGHT = PoolSettings(queued_per_session=60, grace=1.0, kept=9, warm_up=None, niceness=0)
"""Workers that load nothing, and that are not waited for long."""


@pytest.fixture(scope="module")
def pool() -> Iterator[JobPool]:
    with JobPool(1, LIGHT) as pool:
        yield pool


@pytest.fixture(scope="module")
def warm_pool() -> Iterator[JobPool]:
    with JobPool(1, EVEN) as pool:
        assert eventually(lambda: pool.workers_ready == 1, EVEN.start_limit)
        yield pool
