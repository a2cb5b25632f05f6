"""Direct-current motors on recorded voltages, braked by their back-EMF."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ..arm.arm import Arm
from ..drives.drive import Drive, per_joint, stated_or
from ..drives.law import DriveLaw, static_law
from ..parameters import Parameter
from ..validation import Positive

WITHIN = 10.0
"""Factor above and below a stated constant within which it is estimated."""


class Voltage(Drive):
    """u = N kt (voltage - kt N theta') / Ra, from `voltage1`, `voltage2`, ... as recorded.

    kt is the motor's torque constant, Ra its armature's resistance, N the gear ratio. In SI units
    the back-EMF constant equals the torque constant. The motor therefore brakes its joint with
    N^2 kt^2 / Ra, which is not friction. The winding's inductance is left out: its time constant
    is a millisecond or less.
    """

    kind: ClassVar[str] = "voltage"

    torque_constants: tuple[Positive, ...]
    """N m/A at the motor's shaft, one per joint."""
    resistances: tuple[Positive, ...]
    """Ohm, of the armature with its amplifier and cable, one per joint."""
    gears: tuple[Positive, ...] | None = None
    """Turns of the motor per turn of the joint (rad/m on a slide), one per joint; None: 1."""

    def check(self, arm: Arm) -> None:
        per_joint(self.torque_constants, arm, "torque_constants")
        per_joint(self.resistances, arm, "resistances")
        if self.gears is not None:
            per_joint(self.gears, arm, "gears")

    def parameters(self, arm: Arm) -> tuple[Parameter, ...]:
        def make(name: str, value: float, unit: str, symbol: str, title: str) -> Parameter:
            low, high = value / WITHIN, value * WITHIN
            return Parameter(name, value, unit, low, high, symbol, title, scale=value)

        constants = [
            make(f"kt{k + 1}", x, "N m/A", rf"k_{{t{k + 1}}}", f"torque constant of motor {k + 1}")
            for k, x in enumerate(self.torque_constants)
        ]
        resistances = [
            make(f"Ra{k + 1}", x, "Ohm", rf"R_{{a{k + 1}}}", f"resistance of motor {k + 1}")
            for k, x in enumerate(self.resistances)
        ]
        return (*constants, *resistances)

    def reference_channels(self, arm: Arm) -> tuple[str, ...]:
        return tuple(f"voltage{k + 1}" for k in range(arm.joints))

    def latex(self) -> str:
        return r"u_k = \frac{N_k k_{t,k}}{R_{a,k}} (U_k - k_{t,k} N_k \dot{\theta}_k)"

    def holds_joints(self, law: DriveLaw) -> bool:
        """False: back-EMF brakes a joint but holds no position, so errors of the torque
        accumulate."""
        return False

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw:
        gears = np.array(self.gears or (1.0,) * arm.joints, dtype=float)
        constants = gears * stated_or("kt", self.torque_constants, values)
        per_volt = constants / stated_or("Ra", self.resistances, values)
        feedback = np.zeros((arm.joints, arm.coordinates))
        feedback[:, : arm.joints] = np.diag(per_volt * constants)
        return static_law(np.diag(per_volt), np.zeros_like(feedback), feedback)
