"""Twenty recordings that begin in mid-motion: each is cut out of a longer one of the independent
engine, where arm and camera move already. Two arms in turn, four effects in sizes drawn at random.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from tests.programs.mujoco.excitation import SAMPLE
from tests.programs.mujoco.wide_arms import ARMS, SECONDS, STEP, Arm, references
from tests.programs.mujoco.wide_cases import SIZES
from tests.programs.mujoco.wide_effects import EFFECTS
from tests.programs.mujoco.wide_files import scenario_text, write_posture
from tests.programs.mujoco.wide_rig import Rig
from tests.programs.mujoco.wide_run import Motion, run
from tests.programs.sample.cases import Case

CUTS = 20
HIDDEN = ("viscous_friction", "coulomb_friction", "tip_payload", "camera_delay")
EARLIEST, LATEST = 0.3, 1.5
"""s, when a cut begins: the links swing, and a wrong first state is no rest."""


def drawn(seed: int) -> tuple[Arm, str, float, np.ndarray]:
    """An arm, an effect and its size, and when the cut of each of the arm's postures begins, s."""
    rng = np.random.default_rng([55, seed])
    arm, kind = ARMS[("paper", "unequal")[seed % 2]], HIDDEN[seed // 2 % len(HIDDEN)]
    small, _, large = SIZES[kind]
    size = float(np.exp(rng.uniform(np.log(small), np.log(large))))
    if kind == "camera_delay":  # ms, a whole number of samples
        size = 1e3 * SAMPLE * round(1e-3 * size / SAMPLE)
    return arm, kind, size, rng.uniform(EARLIEST, LATEST, len(arm.postures))


def _write(seed: int, folder: Path) -> Path:
    arm, kind, size, begins = drawn(seed)
    rig, _ = EFFECTS[kind](arm, Rig(arm.plant), size)
    for number, (posture, begin) in enumerate(zip(arm.postures, begins, strict=True)):
        whole = run(rig, posture, references(arm, 10 * seed + number, begin + SECONDS), STEP)
        cut = slice(round(begin / SAMPLE), None)
        motion = Motion(whole.reference[cut], whole.angles[cut], whole.tip[cut])
        write_posture(f"cut/{seed}", arm, number, motion, folder)
    path = folder / "scenario.toml"
    path.write_text(scenario_text(arm), encoding="utf-8")
    return path


def cases() -> dict[str, Case]:
    """All twenty by name."""
    found = []
    for seed in range(CUTS):
        arm, kind, size, _ = drawn(seed)
        truth = EFFECTS[kind](arm, Rig(arm.plant), size)[1]
        truth |= {f"EI{k + 1}": beam.EI for k, beam in enumerate(arm.beams)}
        found.append(Case(f"cut/{seed}_{arm.name}_{kind}", (kind,), truth, partial(_write, seed)))
    return {case.name: case for case in found}
