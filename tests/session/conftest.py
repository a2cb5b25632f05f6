"""A session in a folder of its own, and what a server offers it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from flexgui.jobs import JobPool
from flexgui.session.session import Session
from flexgui.stages.challenge.board import Board

UPLOAD_LIMIT = 1_000_000
"""bytes; small, so that a file that is too large is quick to make."""

SOON = 30.0
"""s: generous on a busy machine, only waited for where something is wrong."""


@dataclass(frozen=True)
class Offered:
    """What a server offers a session."""

    pool: JobPool
    data_folder: Path | None = None
    upload_limit_bytes: int = UPLOAD_LIMIT
    board: Board = field(default_factory=Board)


@pytest.fixture(scope="session")
def services(job_pool: JobPool) -> Offered:
    return Offered(job_pool)


@pytest.fixture
def session(tmp_path: Path, services: Offered) -> Iterator[Session]:
    folder = tmp_path / "own"
    folder.mkdir()
    made = Session("a-person", folder, services)
    yield made
    made.close()
