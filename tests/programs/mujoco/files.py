"""Recordings, the truth and the scenarios as files; the same data give the same bytes."""

from __future__ import annotations

import gzip
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from tests.programs.mujoco.cases import EXPERIMENTS, Case
from tests.programs.mujoco.excitation import RATE_DECIMALS, SAMPLE
from tests.programs.mujoco.simulate import Motion

CAMERA_NOISE = 3e-5
"""m, standard deviation per axis."""
ENCODER_NOISE = 1e-5
"""rad, standard deviation per joint."""

COLUMNS = ("t", "dtheta1_ref", "dtheta2_ref", "theta1", "theta2", "z1", "z2")
DECIMALS = (6, RATE_DECIMALS, RATE_DECIMALS, 7, 7, 6, 6)
"""A hundredth of the encoder's noise, a thirtieth of the camera's: below both, and small files."""

SCENARIO = """\
# Recorded by an independent engine; what is hidden in it stands in truth.toml.
title = "Recordings of a chain of rigid bodies: {title}"

[arm]
preset = "paper"
modes = [3, 3]
{rotors}
[drive]
kind = "velocity_loop"
gains = [60.0, 30.0]        # N m s/rad

[model]
level = "nonlinear"

[sensors]
camera_noise = {camera!r}        # m
encoder_noise = {encoder!r}       # rad

[identify]
parameters = ["EI1", "EI2"]
output = ["z", "encoder"]
generations = 0

[diagnose]
max_effects = 3
fidelity = 0.005            # what three modes leave of a chain of rigid bodies
"""

PLAIN = """\
# As a newcomer would state it: the arm as drawn, its loop, the files. The stiffness is 30 % off.
title = "{title}, plainly stated"

[arm]
preset = "paper"
modes = {modes}
young_modulus = [7e8, 1.3e9]  # Pa, as in a data sheet; truly 1e9
{rotors}
[drive]
kind = "velocity_loop"
gains = [60.0, 30.0]        # N m s/rad

[identify]
parameters = ["EI1", "EI2"]

[diagnose]
max_effects = 4
"""

FEW_MODES = ("nothing", "viscous_friction", "tip_payload", "camera_delay", "coulomb_friction")
"""Cases that are also stated with one mode per segment."""


def table(case: str, experiment: str, motion: Motion) -> np.ndarray:
    """(samples, 7) by COLUMNS: the motion as the instruments report it, rounded.

    The noise belongs to the case and the experiment, not to the order in which they are made,
    and that of the first rows does not depend on how many follow.
    """
    rng = np.random.default_rng([*f"{case}/{experiment}".encode()])
    noise = rng.standard_normal((len(motion.tip), 4))
    measured = np.hstack([
        SAMPLE * np.arange(len(motion.tip))[:, None],
        motion.reference,
        motion.angles + ENCODER_NOISE * noise[:, :2],
        motion.tip + CAMERA_NOISE * noise[:, 2:],
    ])  # fmt: skip
    return np.column_stack([np.round(c, d) for c, d in zip(measured.T, DECIMALS, strict=True)])


def write_table(
    rows: np.ndarray,
    path: Path,
    columns: tuple[str, ...] = COLUMNS,
    decimals: tuple[int, ...] = DECIMALS,
) -> None:
    """As .csv.gz."""
    lines = [",".join(columns)]
    lines += [",".join(map(_number, row, decimals)) for row in rows.tolist()]
    text = "\n".join(lines) + "\n"
    # No date inside: a recording made again is the same file.
    _replace(path, gzip.compress(text.encode(), compresslevel=9, mtime=0))


def _number(value: float, decimals: int) -> str:
    """1.25 and 0, not 1.250000 and -0.000000."""
    return f"{value + 0.0:.{decimals}f}".rstrip("0").rstrip(".")  # + 0.0: no minus zero


def write_scenario(case: Case, folder: Path) -> None:
    """`<case>.toml` beside the case's folder; a file that is there stays as it is."""
    path = folder / f"{case.name}.toml"
    if path.exists():
        return
    title = case.name.replace("-", " and ").replace("_", " ")
    rotors = f"hub_inertia = {list(case.rotors)}  # kg m^2, known\n" if any(case.rotors) else ""
    text = SCENARIO.format(title=title, rotors=rotors, camera=CAMERA_NOISE, encoder=ENCODER_NOISE)
    for e in EXPERIMENTS:
        text += f'\n[[recordings]]\nname = "{e.name}"\nfile = "{case.name}/{e.name}.csv.gz"\n'
        text += f'role = "{e.role}"\n'
    _replace(path, text.encode())


def write_plain(case: Case, folder: Path) -> None:
    """`plain/<case>.toml`, for some also with one mode; a file that is there stays as it is."""
    kinds = [("", [3, 3])] + ([("-one_mode", [1, 1])] if case.name in FEW_MODES else [])
    for suffix, modes in kinds:
        path = folder / "plain" / f"{case.name}{suffix}.toml"
        if path.exists():
            continue
        title = case.name.replace("-", " and ").replace("_", " ").capitalize()
        rotors = f"hub_inertia = {list(case.rotors)}  # kg m^2, known\n" if any(case.rotors) else ""
        text = PLAIN.format(title=title, modes=modes, rotors=rotors)
        for e in EXPERIMENTS:
            text += f'\n[[recordings]]\nfile = "../{case.name}/{e.name}.csv.gz"\n'
            text += 'role = "validate"\n' if e.role == "validate" else ""
        _replace(path, text.encode())


def write_truth(cases: Iterable[Case], path: Path) -> None:
    """`[case.effect]` tables of parameters in SI units; an empty `[case]` hides nothing."""
    text = "# What is hidden in the recordings of each folder. SI units.\n"
    for case in cases:
        text += f"\n[{case.name}]\n"
        for effect, parameters in case.effects.items():
            text += f"[{case.name}.{effect}]\n"
            text += "".join(f"{name} = {value!r}\n" for name, value in parameters.items())
    _replace(path, text.encode())


def _replace(path: Path, content: bytes) -> None:
    """So that a run that is stopped leaves no half of a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.part")
    temporary.write_bytes(content)
    temporary.replace(path)
