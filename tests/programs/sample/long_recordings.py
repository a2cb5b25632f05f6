"""Every effect hidden once in long recordings: what a diagnosis costs where the data are many.

The paper's arm with three shapes per segment in the independent engine: seven recordings of 3,000
samples and a sweep over the postures, which validates. A recording takes the engine up to half a
minute, so they are kept beside the reports.
"""

from __future__ import annotations

import shutil
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from tests.programs.mujoco.cases import RANGE
from tests.programs.mujoco.excitation import sweep
from tests.programs.mujoco.wide_arms import ARMS, STEP, references
from tests.programs.mujoco.wide_cases import SIZES
from tests.programs.mujoco.wide_effects import EFFECTS
from tests.programs.mujoco.wide_files import scenario_text, write_posture
from tests.programs.mujoco.wide_rig import Rig
from tests.programs.mujoco.wide_run import run
from tests.programs.sample.cases import Case

SAMPLE_TIME = 1e-3
"""s"""
SECONDS, SWEEP_SECONDS = 3.0, 4.0
ESTIMATE = 7
"""Recordings, at the working points of the paper."""
ARM = replace(
    ARMS["paper"],
    postures=(*((0.0, float(k * np.pi / 8)) for k in range(1, ESTIMATE + 1)), (0.0, RANGE[0])),
)
ROLES = ("estimate",) * ESTIMATE + ("validate",)
KEPT = Path("reports") / "long_recordings"


def _reference(number: int) -> np.ndarray:
    """(samples, 2) rad/s of one recording."""
    if number < ESTIMATE:
        return references(ARM, number, SECONDS, SAMPLE_TIME)
    found = references(ARM, number, SWEEP_SECONDS, SAMPLE_TIME)
    return np.round(found + sweep(*RANGE, SWEEP_SECONDS, SAMPLE_TIME), 6)


def _write(effect: str, folder: Path) -> Path:
    kept = KEPT / (effect or "nothing")
    if not (kept / "scenario.toml").exists():
        kept.mkdir(parents=True, exist_ok=True)
        rig = Rig(ARM.plant)
        if effect:
            rig, _ = EFFECTS[effect](ARM, rig, SIZES[effect][1])
        for number, posture in enumerate(ARM.postures):
            motion = run(rig, posture, _reference(number), STEP, SAMPLE_TIME)
            write_posture(f"long/{effect}", ARM, number, motion, kept, SAMPLE_TIME)
        (kept / "scenario.toml").write_text(scenario_text(ARM, ROLES), encoding="utf-8")
    shutil.copytree(kept, folder, dirs_exist_ok=True)
    return folder / "scenario.toml"


def cases() -> dict[str, Case]:
    """Nothing, and each effect in its middle size."""
    found = []
    for effect in ("", *SIZES):
        truth = {f"EI{k + 1}": beam.EI for k, beam in enumerate(ARM.beams)}
        if effect:
            truth |= EFFECTS[effect](ARM, Rig(ARM.plant), SIZES[effect][1])[1]
        name = f"long/{effect or 'nothing'}"
        found.append(Case(name, (effect,) if effect else (), truth, partial(_write, effect)))
    return {case.name: case for case in found}
