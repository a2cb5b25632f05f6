"""The same experiment in every format, by one line of TOML: the same estimates."""

from __future__ import annotations

from pathlib import Path

import pytest

from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.scenario.read import parse_scenario
from flexgui.core.simulate.experiment import simulate_recording
from flexgui.core.workbench import run_scenario
from tests.helpers import PAPER, looped
from tests.recording.lab_formats import FORMATS
from tests.recording.test_lab_formats import NAMES

SAME = 1e-6
"""Relative, as estimates are promised to agree whatever the format."""

SCENARIO = """
title = "One experiment"
[arm]
preset = "paper"
[drive]
kind = "velocity_loop"
gains = [60.0, 30.0]
[model]
level = "lpv"
[identify]
parameters = ["EI1", "EI2"]
generations = 0
[[recordings]]
file = "{file}"
"""


def estimates(folder: Path, file: str) -> dict[str, float]:
    found = run_scenario(parse_scenario(SCENARIO.format(file=file), "a.toml"), folder=folder)
    return {e.name: e.value for fit in found.fits for e in fit.estimates}


@pytest.mark.long
def test_every_format_gives_the_same_estimates(tmp_path: Path) -> None:
    spec = SimulateSpec(theta2=1.2, seconds=0.3, level="lpv", snr_db=20.0)
    made = simulate_recording(looped(PAPER, level="lpv"), spec, "th1")
    columns = {"t": made.time, **{name: made[name] for name in NAMES}}
    found = {}
    for kind, write in FORMATS.items():
        folder = tmp_path / kind
        folder.mkdir()
        found[kind] = estimates(folder, write(folder, columns))
    assert len(found) >= 12
    reference = found["csv_us"]
    off = {k: max(abs(v[n] / reference[n] - 1.0) for n in reference) for k, v in found.items()}
    print({kind: f"{each:.1e}" for kind, each in off.items()})
    assert max(off.values()) < SAME
