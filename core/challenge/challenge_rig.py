"""The rig of the challenges: the paper's arm in its velocity loop, with encoders and camera."""

from __future__ import annotations

from functools import cache

from ..arm.presets import presets
from ..drives.velocity_loop import VelocityLoop
from ..effects.effect import Rig
from ..model import Model

GAINS = (60.0, 30.0)
"""N m s/rad, design section 2."""

STDS = {"z1": 3e-5, "z2": 3e-5, "theta1": 1e-5, "theta2": 1e-5}
"""channel -> standard deviation of its noise, m and rad."""

KINDS = ("z", "encoder")
"""The sensors of these channels."""


@cache
def bare_model() -> Model:
    """The paper's arm with nothing hidden."""
    return Model(presets()["paper"], VelocityLoop(gains=GAINS), "nonlinear")


def challenge_rig(model: Model) -> Rig:
    """What the recordings of a challenge can show of a model."""
    return Rig(model.arm, model.drive, model.level, KINDS)
