"""Dry friction that turns round within milliseconds: no bristle, and no law of the catalogue.

In the engine it is a constraint: below its level a joint loses its rate with a time constant.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.programs.mujoco.wide_arms import ARMS, STEP, Arm, references
from tests.programs.mujoco.wide_files import scenario_text, write_posture
from tests.programs.mujoco.wide_rig import Rig
from tests.programs.mujoco.wide_run import run

TIMES = (3e-4, 3e-3)
"""s, shortest and longest."""

SHARES = (0.05, 0.2)
"""Of the loops' torque: least and most friction."""


def made(seed: int) -> tuple[Arm, Rig]:
    """An arm of one or two segments, and the rig with its friction."""
    rng = np.random.default_rng([43, seed])
    arm = ARMS[("one", "unequal", "paper")[seed % 3]]
    time = float(np.exp(rng.uniform(*np.log(TIMES))))
    levels = rng.uniform(*SHARES, arm.joints) * arm.torques
    motors = tuple(
        replace(m, coulomb=float(x)) for m, x in zip(arm.plant.motors, levels, strict=True)
    )
    return arm, Rig(replace(arm.plant, motors=motors), friction_time=time)


def written(seed: int, folder: Path) -> tuple[Path, dict[str, float]]:
    """Recordings and a plain scenario; its path, and the true levels by name."""
    arm, rig = made(seed)
    for number, posture in enumerate(arm.postures):
        motion = run(rig, posture, references(arm, number), STEP)
        write_posture(f"soft{seed}", arm, number, motion, folder)
    path = folder / "scenario.toml"
    path.write_text(scenario_text(arm), encoding="utf-8")
    return path, {f"fc{k + 1}": m.coulomb for k, m in enumerate(rig.plant.motors)}
