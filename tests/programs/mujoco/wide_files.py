"""A wide case as files: recordings, and the scenario that a newcomer would write for them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.programs.mujoco.excitation import RATE_DECIMALS, SAMPLE
from tests.programs.mujoco.files import CAMERA_NOISE, ENCODER_NOISE, write_table
from tests.programs.mujoco.wide_arms import STEP, Arm, references
from tests.programs.mujoco.wide_cases import Case
from tests.programs.mujoco.wide_run import Motion, run

WRONG = (0.7, 1.3, 0.7)
"""Times the true bending stiffness: what the data sheets say."""

ROLES = ("estimate", "estimate", "estimate", "validate")
"""Of the arm's postures."""

SEGMENT = """\
[[arm.segments]]
length = {length!r}       # m
mass = {mass!r}          # kg
EI = {EI!r}             # N m^2, off by 30 %
hub_inertia = {rotor!r}  # kg m^2
modes = {modes}

"""

REST = """\
[drive]
kind = "velocity_loop"
gains = {gains}        # N m s/rad

[identify]
parameters = {parameters}

[diagnose]
max_effects = 4
"""


def scenario_text(arm: Arm, roles: Sequence[str] = ROLES) -> str:
    """The arm as stated, its loop, and the files; nothing of what is hidden."""
    text = f'title = "{arm.name.capitalize()}"\n\n'
    for beam, rotor, wrong in zip(arm.beams, arm.rotors, WRONG, strict=False):
        text += SEGMENT.format(
            length=beam.length,
            mass=beam.mass,
            EI=round(beam.EI * wrong, 4),
            rotor=rotor,
            modes=arm.modes,
        )
    names = [f"EI{k + 1}" for k in range(arm.joints)]
    text += REST.format(gains=list(arm.gains), parameters=names)
    for n, role in enumerate(roles):
        text += f'\n[[recordings]]\nfile = "posture{n}.csv.gz"\nrole = "{role}"\n'
    return text


def written(case: Case, folder: Path) -> Path:
    """Makes the recordings in the engine; the scenario's path."""
    arm, rig, _ = case.made()
    for number, posture in enumerate(arm.postures):
        motion = run(rig, posture, references(arm, number), STEP)
        write_posture(case.name, arm, number, motion, folder)
    path = folder / "scenario.toml"
    path.write_text(scenario_text(arm), encoding="utf-8")
    return path


def write_posture(
    case: str, arm: Arm, number: int, motion: Motion, folder: Path, sample_time: float = SAMPLE
) -> None:
    """One recording with noise, as a file."""
    rows = _noisy(case, number, motion, sample_time)
    write_table(rows, folder / f"posture{number}.csv.gz", _columns(arm), _decimals(arm))


def _columns(arm: Arm) -> tuple[str, ...]:
    numbers = range(1, arm.joints + 1)
    return ("t", *[f"dtheta{k}_ref" for k in numbers], *[f"theta{k}" for k in numbers], "z1", "z2")


def _decimals(arm: Arm) -> tuple[int, ...]:
    return (6, *[RATE_DECIMALS] * arm.joints, *[7] * arm.joints, 6, 6)


def _noisy(case: str, number: int, motion: Motion, sample_time: float) -> np.ndarray:
    """(samples, columns); the noise belongs to the case and the recording."""
    rng = np.random.default_rng([number, *case.encode()])
    samples, joints = motion.angles.shape
    return np.column_stack([
        sample_time * np.arange(samples),
        motion.reference,
        motion.angles + ENCODER_NOISE * rng.standard_normal((samples, joints)),
        motion.tip + CAMERA_NOISE * rng.standard_normal((samples, 2)),
    ])  # fmt: skip
