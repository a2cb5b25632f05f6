"""Short work for tests."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from flexgui.cli import run
from flexgui.jobs import JobPool
from flexgui.session.scenario_edits import ScenarioDict, set_value
from flexgui.session.session import Session
from flexgui.session.state import Services
from tests.session.conftest import Offered

SOON = 60.0
"""s: a worker that has to compile first needs most of it."""


def alone(key: str, folder: Path) -> Session:
    """A session that begins no job."""
    return Session(key, folder, Offered(JobPool()))


def small(session: Session, generations: int = 4) -> None:
    """Two short recordings and a small population: an identification takes a moment."""

    def edit(document: ScenarioDict) -> None:
        document["recordings"] = document["recordings"][1:3]
        for entry in document["recordings"]:
            entry["simulate"]["seconds"] = 0.5

    assert session.document.change(
        edit,
        set_value(("identify", "population"), 8),
        set_value(("identify", "generations"), generations),
    )


LONG = {"population": 60, "generations": 20_000}
"""An identification that nobody waits for: some minutes."""


def until(condition: Callable[[], bool], seconds: float = SOON) -> None:
    """Waits for it."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.02)


def bring(session: Session, name: str, content: bytes, services: Services) -> bool:
    """Uploads a recording and uses it beside those that stand."""
    return session.recordings.upload(name, content).result() and settle(session)


def worked(session: Session) -> None:
    """Something was done with the recordings that the page began with."""
    assert session.document.set_noise(30.0)


def settle(session: Session) -> bool:
    """Beside those that stand, where that is asked."""
    return not session.recordings.imports.pending or session.recordings.imports.use(alone=False)


def good_csv(session: Session) -> bytes:
    """A recording that suits the scenario, as a file."""
    from flexgui.core.recording.save import save_recording
    from flexgui.scene.recorded_motion import read_recording

    name = session.document.scenario.recordings[0].name
    path = session.folder / "good.csv"
    save_recording(read_recording(session.document.scenario, name, session.folder), path)
    content = path.read_bytes()
    path.unlink()
    return content


def exported(scenario: Path, out: Path) -> dict[str, Any]:
    """What `flexgui export` finds, in this process: another would only begin with imports."""
    assert run(["export", str(scenario), "--out", str(out), "--quiet"]) == 0
    return dict(json.loads((out / "result.json").read_text()))
