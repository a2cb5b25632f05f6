"""Joints whose motion is recorded but not their torque, and joints with a further known torque."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..arm.arm import Arm
from ..drives.drive import Drive, joints_there, stated_joints
from ..drives.law import DriveLaw
from ..drives.servo import FollowingServo
from ..errors import InputError
from ..parameters import Parameter
from ..recording.channels import joint_of

KNOWN_MOTION = "known_motion"
"""Of [drive], whatever its kind: the joints, from 1, that move as their columns theta say."""


class WithKnownMotion(Drive):
    """A drive whose listed joints follow their recorded positions instead.

    Their torque is not recorded, so it is not compared, and the drive's columns and constants of
    them are not read.
    """

    base: Drive
    joints: tuple[int, ...]
    """From 1."""

    @property
    def torque_unknown(self) -> tuple[int, ...]:
        return self.joints

    @property
    def servo(self) -> type[FollowingServo]:
        return self.base.servo

    def check(self, arm: Arm) -> None:
        self.base.check(arm)
        joints_there(KNOWN_MOTION, self.joints, arm)
        if not self.base.torque_known:
            raise InputError(
                f"[drive] {KNOWN_MOTION} cannot be used with kind = {self.base.kind!r}: all joints "
                f"follow their encoders already; leave it out."
            )
        if len(self.joints) == arm.joints:
            raise InputError(
                f"[drive] {KNOWN_MOTION} names every joint, so no torque is left to compare; use "
                f'kind = "held".'
            )

    def parameters(self, arm: Arm) -> tuple[Parameter, ...]:
        """Those of the joints that it drives; a drive's parameters bear their joint's number."""
        moved = tuple(str(k) for k in self.joints)
        return tuple(p for p in self.base.parameters(arm) if not p.name.endswith(moved))

    def reference_channels(self, arm: Arm) -> tuple[str, ...]:
        return tuple(self.base.reference_channels(arm)[i] for i in self._kept(arm))

    def needed_channels(self, arm: Arm) -> tuple[str, ...]:
        own = [n for n in self.base.needed_channels(arm) if not self._moved_else(n)]
        return (*own, *(f"theta{k}" for k in self.joints if f"theta{k}" not in own))

    def _moved_else(self, name: str) -> bool:
        """Whether a column belongs to one of the joints."""
        joint = joint_of(name)
        return joint is not None and joint + 1 in self.joints

    def _kept(self, arm: Arm) -> list[int]:
        names = self.base.reference_channels(arm)
        return [i for i, name in enumerate(names) if not self._moved_else(name)]

    def holds_joints(self, law: DriveLaw) -> bool:
        """Nothing in the model moves the other joints: a virtual servo has to lead them."""
        return False

    def latex(self) -> str:
        moved = r",\,".join(str(k) for k in self.joints)
        return self.base.latex() + (
            r" \;\; \theta_k(t) = \theta_{k,\mathrm{recorded}}(t),\; k = " + moved
        )

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw:
        own = self.base.law(arm, p, values)
        kept = self._kept(arm)
        driven = np.ones((arm.joints, 1))
        driven[[k - 1 for k in self.joints]] = 0.0
        return replace(
            own, R=driven * own.R[:, kept], P=driven * own.P, V=driven * own.V,
            S=driven * own.S, Fr=own.Fr[:, kept],
        )  # fmt: skip


def with_known_motion(drive: Drive, stated: object) -> Drive:
    """The drive beside the joints that `[drive] known_motion` states, a list of joints."""
    joints = stated_joints(KNOWN_MOTION, stated)
    return WithKnownMotion(base=drive, joints=joints) if joints else drive


KNOWN_TORQUE = "known_torque"
"""Of [drive], whatever its kind: the joints, from 1, with a column of that name."""


class WithKnownTorque(Drive):
    """A drive plus the recorded columns known_torque1, ...; a limit of the drive cuts the sum."""

    base: Drive
    joints: tuple[int, ...]
    """From 1."""

    @property
    def servo(self) -> type[FollowingServo]:
        return self.base.servo

    def check(self, arm: Arm) -> None:
        self.base.check(arm)
        joints_there(KNOWN_TORQUE, self.joints, arm)

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
        return tuple(f"{KNOWN_TORQUE}{k}" for k in self.joints)

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
    joints = stated_joints(KNOWN_TORQUE, stated)
    if joints and not drive.torque_known:
        raise InputError(
            f"[drive] {KNOWN_TORQUE} cannot be used with kind = {drive.kind!r}: the joints follow "
            f"the encoders whatever the torque is; leave it out."
        )
    return WithKnownTorque(base=drive, joints=joints) if joints else drive
