"""A known torque beside a drive's own: pulses on a second motor, a weight on a string."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from core.arm.arm import Arm
from core.drives.drive import Drive, joints_there, stated_joints
from core.drives.law import DriveLaw
from core.errors import InputError
from core.parameters import Parameter

SETTING = "known_torque"
"""Of [drive], whatever its kind: the joints, from 1, with a column of that name."""


class WithKnownTorque(Drive):
    """A drive with the columns known_torque1, ... added to its torque, as they were recorded.

    Where the drive has a limit, the sum is cut at it.
    """

    base: Drive
    joints: tuple[int, ...]
    """From 1."""

    def check(self, arm: Arm) -> None:
        self.base.check(arm)
        joints_there(SETTING, self.joints, arm)

    def parameters(self, arm: Arm) -> tuple[Parameter, ...]:
        scales = tuple(
            Parameter(
                f"kx{k}", 1.0, "", 0.1, 10.0, rf"k_{{x{k}}}", f"scale of the known torque {k}"
            )
            for k in self.joints
        )
        return (*self.base.parameters(arm), *scales)

    def reference_channels(self, arm: Arm) -> tuple[str, ...]:
        return (*self.base.reference_channels(arm), *self._columns)

    def needed_channels(self, arm: Arm) -> tuple[str, ...]:
        return (*self.base.needed_channels(arm), *self._columns)

    @property
    def _columns(self) -> tuple[str, ...]:
        return tuple(f"{SETTING}{k}" for k in self.joints)

    def holds_joints(self, law: DriveLaw) -> bool:
        return self.base.holds_joints(law)

    def latex(self) -> str:
        return self.base.latex() + r" \;\; + u_{\mathrm{known}}"

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw:
        own = self.base.law(arm, p, values)
        added = np.zeros((arm.joints, len(self.joints)))
        for i, k in enumerate(self.joints):
            added[k - 1, i] = values.get(f"kx{k}", 1.0)
        unseen = np.zeros((own.states, len(self.joints)))
        return replace(own, R=np.hstack([own.R, added]), Fr=np.hstack([own.Fr, unseen]))


def with_known_torque(drive: Drive, stated: object) -> Drive:
    """The drive beside the known torques that `[drive] known_torque` states; InputError where it is
    no list of joints, or where the drive knows no torque to add them to."""
    joints = stated_joints(SETTING, stated)
    if joints and not drive.torque_known:
        raise InputError(
            f"[drive] {SETTING} has no place where kind is {drive.kind!r}: the joints follow the "
            f"encoders whatever the torque is; leave it out."
        )
    return WithKnownTorque(base=drive, joints=joints) if joints else drive
