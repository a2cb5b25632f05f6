from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flexgui.core.recording.recording import Recording

ROWS = 200
SAMPLE_TIME = 1e-3


@pytest.fixture
def data_folder() -> Path:
    """The folder of real recordings, which is kept beside the project and not in it."""
    named = os.environ.get("FLEXGUI_DATA")
    if not named or not (Path(named) / "emps.csv").is_file():
        pytest.skip("the real recordings are not here: FLEXGUI_DATA names no folder with emps.csv")
    return Path(named)


@pytest.fixture
def recording() -> Recording:
    """A velocity-loop rig with a camera at a tenth of the logger's rate."""
    rng = np.random.default_rng(7)
    time = SAMPLE_TIME * np.arange(ROWS)
    z = np.where(np.arange(ROWS) % 10 == 0, rng.normal(size=(2, ROWS)), np.nan)
    names = ("dtheta1_ref", "dtheta2_ref", "theta1", "theta2", "u1", "deflection1")
    channels = {name: rng.normal(size=ROWS) for name in names}
    return Recording("th1", time, {**channels, "z1": z[0], "z2": z[1]})


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str], Path]:
    """Writes a text as th1.csv."""

    def _write(text: str) -> Path:
        path = tmp_path / "th1.csv"
        path.write_text(text, encoding="utf-8")
        return path

    return _write
