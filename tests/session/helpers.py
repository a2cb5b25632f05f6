"""Short work for tests."""

from __future__ import annotations

import io
import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from flexgui.cli import run
from flexgui.core.challenge.truth import Truth
from flexgui.jobs import JobPool
from flexgui.session.scenario_edits import Edit, ScenarioDict, set_value
from flexgui.session.session import Session
from flexgui.stages.data.waiting_file import WaitingFile
from tests.session.conftest import offered

SOON = 60.0
"""s: a worker that has to compile first needs most of it."""

HIDDEN_FRICTION = Truth({"coulomb_friction": 3.0}, {"fc1": 0.1823, "fc2": 0.1}, 520.0)
"""What a challenge may hide."""


def alone(key: str, folder: Path) -> Session:
    """A session that begins no job, in a folder that is made where there is none."""
    folder.mkdir(exist_ok=True)
    return Session(key, folder, offered(JobPool()))


def shortened(*kept: int, seconds: float = 1.0) -> Edit:
    """Leaves the simulated recordings of these numbers, each as long as that."""

    def edit(document: ScenarioDict) -> None:
        document["recordings"] = [document["recordings"][k] for k in kept]
        for entry in document["recordings"]:
            entry["simulate"]["seconds"] = seconds

    return edit


def small(session: Session) -> None:
    """Two short recordings and a small population: an identification takes a moment."""
    assert session.document.change(
        shortened(1, 2, seconds=0.5),
        set_value(("identify", "population"), 8),
        set_value(("identify", "generations"), 4),
    )


LONG = {"population": 60, "generations": 20_000}
"""An identification that nobody waits for: some minutes."""


@contextmanager
def largest(look: Callable[[], float]) -> Iterator[list[float]]:
    """The largest value of what is looked at all the time, so far."""
    found, over = [look()], threading.Event()

    def watch() -> None:
        while not over.wait(0.005):
            found[0] = max(found[0], look())

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield found
    finally:
        over.set()
        watcher.join()


def until(condition: Callable[[], bool], seconds: float = SOON) -> None:
    """Waits for it."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.02)


def bring(session: Session, name: str, content: bytes) -> bool:
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


LABORATORY = {
    "t [s]": "clock", "dtheta1_ref": "vel_cmd_1", "dtheta2_ref": "vel_cmd_2",
    "theta1": "enc_2", "theta2": "enc_1", "z1 [m]": "cam_x", "z2 [m]": "cam_y",
}  # fmt: skip
"""Names of a laboratory's own; the encoders are under each other's."""


def laboratory_csv(session: Session) -> bytes:
    """A good recording under such names: degrees without a unit, and six empty cells."""
    table = pd.read_csv(io.BytesIO(good_csv(session))).rename(columns=LABORATORY)
    table[["enc_1", "enc_2"]] = np.degrees(table[["enc_1", "enc_2"]])
    table.loc[400:405, "enc_1"] = np.nan
    text: str = table[list(LABORATORY.values())].to_csv(index=False)
    return text.encode()


def waiting_of(session: Session) -> WaitingFile:
    """The file that waits for its columns."""
    assert session.recordings.waiting is not None
    return session.recordings.waiting


def exported(scenario: Path, out: Path) -> dict[str, Any]:
    """What `flexgui export` finds, in this process: another would only begin with imports."""
    assert run(["export", str(scenario), "--out", str(out), "--quiet"]) == 0
    return dict(json.loads((out / "result.json").read_text()))
