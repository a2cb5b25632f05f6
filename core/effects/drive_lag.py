"""A drive that needs time to build up its torque."""

from dataclasses import replace

import numpy as np

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..drives.law import DriveLaw
from ..effects.effect import Effect, EffectParameter, Rig, Values, torque_is_replayed
from ..effects.per_joint import sized
from ..effects.sizes import Sizes

GRID = (1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 3e-2)
"""s: from a current loop to a slow hydraulic valve."""


def lagged(law: DriveLaw, time: float) -> DriveLaw:
    """The law with its torque behind a first-order lag of `time` s; the new states stand last.

    u = s, T s' = u* - s with the old law's u*; the old states are kept, their limit is that of
    the torque that arrives.
    """
    joints, ns = law.S.shape
    old, rate = np.eye(ns, ns + joints), 1.0 / time
    behind = np.hstack([-rate * law.S, -rate * np.eye(joints)])
    return replace(
        law,
        R=np.zeros_like(law.R),
        P=np.zeros_like(law.P),
        V=np.zeros_like(law.V),
        S=-np.eye(joints, ns + joints, k=ns),
        Fs=np.vstack([law.Fs @ old, behind]),
        Fq=np.vstack([law.Fq, -rate * law.P]),
        Fv=np.vstack([law.Fv, -rate * law.V]),
        Fr=np.vstack([law.Fr, rate * law.R]),
    )


class DriveLag(Effect):
    """One time constant for all drives: they are of one make."""

    kind = "drive_lag"
    location = "drive"
    title = "Lag of the drive"
    story = (
        "The inductance of a motor's winding keeps the current from jumping. The torque follows "
        "the loop's command some milliseconds late. Slow motion is unchanged. Fast motion comes "
        "later and vibrates more, because a late loop damps less. The error grows with frequency."
    )
    formula = r"T_l \, \dot u = u^* - u"
    linear = True
    acts_at = "drive"

    def not_applicable(self, rig: Rig) -> str:
        if torque_is_replayed(rig):
            return "The torque of this rig is recorded as applied, so it already contains the lag."
        return ""

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        title, symbol = "time constant of the drives", "T_{l}"
        return (sized("tl", GRID[2], "s", title, symbol=symbol, lower=1e-5, upper=0.3, grid=GRID),)

    def law(self, law: DriveLaw, arm: Arm, p: np.ndarray, values: Values) -> DriveLaw:
        time = values["tl"]
        return lagged(law, time) if time > 0.0 else law
