"""Good recordings of several rigs, as the checks see them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from flexgui.core.check.case import Case
from flexgui.core.check.finding import Finding
from flexgui.core.check.measured_recording import MeasuredRecording
from flexgui.core.check.run_checks import check_case, measured_recordings, with_true_clock
from flexgui.core.scenario.read import read_scenario

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"


class Rig(NamedTuple):
    """The recordings of one scenario."""

    name: str
    cases: list[Case]

    def findings(self, spoilt: MeasuredRecording, instead: int) -> list[Finding]:
        """Of a recording that stands instead of the rig's own."""
        others = [case for k, case in enumerate(self.cases) if k != instead]
        recording, said = with_true_clock(spoilt)
        return [*said, *check_case(Case(recording, others))]

    def untouched(self, k: int) -> list[Finding]:
        """Of the rig's own recording."""
        return self.findings(self.cases[k].recording, k)


def rig(path: Path, most: int | None = None, data: Path | None = None) -> Rig:
    scenario = read_scenario(path)
    few = scenario.model_copy(update={"recordings": scenario.recordings[:most]})
    found: Sequence[MeasuredRecording] = measured_recordings(few, path.parent, data)
    return Rig(path.stem, [Case(one) for one in found])


def simulated(most: int | None = None) -> Rig:
    return rig(SCENARIOS / "hidden_friction.toml", most)


def independent(name: str, most: int | None = None) -> Rig:
    return rig(SCENARIOS / "mujoco" / f"{name}.toml", most)


def real() -> list[Rig]:
    """Of real rigs; none where their folder is not here."""
    named = os.environ.get("FLEXGUI_DATA", "")
    if not (Path(named) / "emps.csv").is_file():
        return []
    data = Path(named)
    return [rig(SCENARIOS / f"{name}.toml", None, data) for name in ("bench_2dsfl", "emps")]
