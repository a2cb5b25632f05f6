"""What would take the server down is read elsewhere, and refused there in words."""

from __future__ import annotations

import gzip
import os
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

import pytest

from flexgui.jobs import JobPool, file_jobs
from flexgui.server.services import Services
from flexgui.server.viser_patches import CALLBACK_THREADS
from flexgui.session.scenario_edits import set_value
from flexgui.session.session import Session
from flexgui.session.state import Topic
from tests.recording.test_large_files import long_csv, mat_of_zeros
from tests.session.conftest import SOON
from tests.session.helpers import good_csv, largest, until

LARGE = 600_000_000
"""Bytes that the bombs unpack to: more than a file may have."""

ROOM = 100_000_000
"""Bytes that the process of the session may grow by meanwhile; read there they would need more
than LARGE."""

STATM = Path("/proc/self/statm")


def resident() -> int:
    """Bytes of memory of this process."""
    return int(STATM.read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")


def bomb(file: str) -> bytes:
    if file.endswith(".mat"):
        return mat_of_zeros(LARGE)
    return gzip.compress(b"t,theta1\n" + b"0,0\n" * (LARGE // 4), 6)


@pytest.mark.long
@pytest.mark.skipif(not STATM.exists(), reason="Linux tells the memory of a process")
@pytest.mark.parametrize("file", ["one.mat", "rows.csv.gz"])
def test_a_bomb_is_refused_and_this_process_does_not_grow(
    file: str, session: Session, services: Services
) -> None:
    content = bomb(file)
    assert len(content) < services.upload_limit_bytes
    before = resident()
    with largest(resident) as most:
        assert not session.recordings.upload(file, content).result()
    assert session.message.bad and file in session.message.text
    assert "more than" in session.message.text
    assert most[0] - before < ROOM
    assert not list(session.folder.iterdir())


def test_sliders_answer_while_more_files_than_threads_wait_for_a_worker(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    content, names = good_csv(session), [f"{k}.csv" for k in range(CALLBACK_THREADS)]
    with ThreadPoolExecutor(CALLBACK_THREADS) as threads, JobPool(0, file_jobs.SETTINGS) as nobody:
        monkeypatch.setattr(file_jobs, "_pool", cache(lambda: nobody))
        brought = [threads.submit(session.recordings.upload, name, content) for name in names]
        threads.submit(session.document.set_live, snr_db=30.0).result(SOON)
        assert session.document.live.snr_db == 30.0
        read = [one.result(SOON) for one in brought]
        assert {path.name for path in session.folder.iterdir()} == set(names)
    assert not any(one.result(SOON) for one in read)
    assert session.message.bad and not list(session.folder.iterdir())


def test_how_far_a_long_file_is_read_is_said_meanwhile(session: Session, tmp_path: Path) -> None:
    said: list[str] = []
    session.subscribe(lambda topic: said.append(session.message.text))
    content = long_csv(tmp_path / "th1.csv", 60_000).read_bytes()
    session.recordings.upload("th1.csv", content).result()
    assert any(text.startswith("th1.csv, ") and "read …" in text for text in said)
    assert "read …" not in session.message.text


def test_a_long_simulation_is_made_elsewhere_and_shown(session: Session) -> None:
    told: list[Topic] = []
    assert session.document.change(set_value(("recordings", 0, "simulate", "seconds"), 31.0))
    session.subscribe(told.append)
    session.playback.refresh()
    until(
        lambda: (
            session.playback.recording is not None
            and len(session.playback.recording.time) == 31_000
        )
    )
    assert session.playback.motion is not None and session.playback.motion.ghost is not None
    assert not session.message.bad
