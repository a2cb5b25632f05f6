"""Recordings as a rig would hand them over: seven tables of numbers and a plain scenario."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from core.arm.build import ArmSpec, build_arm
from core.drives import build_drive
from core.model import Model
from core.recording.save import save_recording
from core.recording.spec import SimulateSpec
from core.simulate.experiment import NoiseLevels, simulate_recording

GAINS = [60.0, 30.0]
NOISE = NoiseLevels({"z": 3e-5, "encoder": 1e-5})
"""m of a good camera, rad of an encoder with 18 bit."""
CHANNELS = ("dtheta1_ref", "dtheta2_ref", "theta1", "theta2", "z1", "z2")
TRUTH = 1e9 * 0.05**4 / 12.0
"""N m^2, of both segments of the paper's arm."""
AWAY = (1.3, 0.7)
"""What the start is of the truth."""


def write(folder: Path, seconds: float, modes: int, outputs: str = "") -> Path:
    """The tables at theta2 = pi/8 .. 7 pi/8 and a scenario that states no working point, no
    level and no more of the fit than `parameters`; returns the scenario's file.

    `modes` are those of each segment, `outputs` further lines under [identify].
    """
    arm = build_arm(ArmSpec.model_validate({"preset": "paper", "modes": modes}))
    model = Model(arm, build_drive("velocity_loop", {"gains": GAINS}), level="nonlinear")
    for k in range(1, 8):
        spec = SimulateSpec(
            theta2=k * np.pi / 8.0, seconds=seconds, seed=k, excitation="prbs", level="nonlinear"
        )
        found = simulate_recording(model, spec, f"th{k}", noise=NOISE)
        table = replace(found, channels={name: found[name] for name in CHANNELS})
        save_recording(table, folder / f"th{k}.csv")
    file = folder / "plain.toml"
    file.write_text(_text(modes, outputs), encoding="utf-8")
    return file


def _text(modes: int, outputs: str) -> str:
    files = "".join(f'[[recordings]]\nfile = "th{k}.csv"\n' for k in range(1, 8))
    starts = ", ".join(f"EI{k + 1} = {TRUTH * a:.6g}" for k, a in enumerate(AWAY))
    return (
        'title = "Seven tables"\n'
        f'[arm]\npreset = "paper"\nmodes = {modes}\n'
        f'[drive]\nkind = "velocity_loop"\ngains = {GAINS}\n'
        f'[identify]\nparameters = ["EI1", "EI2"]\nstart = {{ {starts} }}\n{outputs}{files}'
    )
