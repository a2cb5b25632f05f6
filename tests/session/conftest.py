"""A session in a folder of its own, and what a server offers it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from flexgui.jobs import JobPool
from flexgui.server.services import Services
from flexgui.session.session import Session

UPLOAD_LIMIT = 1_000_000
"""bytes; small, so that a file that is too large is quick to make."""

SOON = 30.0
"""s: generous on a busy machine, only waited for where something is wrong."""


def offered(pool: JobPool) -> Services:
    """What a server offers a session."""
    return Services(pool, upload_limit_bytes=UPLOAD_LIMIT)


@pytest.fixture(scope="session")
def services(job_pool: JobPool) -> Services:
    return offered(job_pool)


@pytest.fixture
def session(tmp_path: Path, services: Services) -> Iterator[Session]:
    folder = tmp_path / "own"
    folder.mkdir()
    made = Session("a-person", folder, services)
    yield made
    made.close()
