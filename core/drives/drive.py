"""The contract of a drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar, NamedTuple

import numpy as np

from ..arm.arm import Arm
from ..arm.joints import joint
from ..drives.law import DriveLaw
from ..drives.servo import FollowingServo
from ..errors import InputError
from ..parameters import Parameter
from ..plugins import classes_of
from ..recording.recording import Recording
from ..validation import Stated


class DriveSlider(NamedTuple):
    """A setting with one number per joint, shown as a slider."""

    setting: str
    letter: str
    """Before the joint's number."""
    unit: str
    limits: tuple[float, float, float]
    """Least, greatest, step, in `unit`."""
    hint: str = ""


class Drive(Stated):
    """A drive as a scenario states it; frozen and checked."""

    kind: ClassVar[str] = ""
    sliders: ClassVar[tuple[DriveSlider, ...]] = ()
    """Settings that the page shows as sliders."""
    torque_known: ClassVar[bool] = True
    """Whether the torque follows from the recording; False: only sensors beyond the joints are
    compared."""

    @property
    def torque_unknown(self) -> tuple[int, ...]:
        """Joints, from 1, whose torque is not recorded although that of others is."""
        return ()

    @property
    def servo(self) -> type[FollowingServo]:
        """The virtual servo that moves the joints along a recording whose torque is replayed or
        compared."""
        return FollowingServo

    def check(self, arm: Arm) -> None:
        """InputError where the drive does not fit the arm."""

    def parameters(self, arm: Arm) -> tuple[Parameter, ...]:
        """The drive's parameters that can be estimated."""
        return ()

    def reference_channels(self, arm: Arm) -> tuple[str, ...]:
        """Columns of a recording that drive the arm, in the order of DriveLaw's references."""
        raise NotImplementedError

    def scales(self, arm: Arm) -> dict[str, str]:
        """Column that drives the arm -> the parameter that multiplies it, where one does."""
        return {}

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw:
        """The law for an arm with numbers p (13 N + 5,) and the drive's parameters in `values`."""
        raise NotImplementedError

    def needed_channels(self, arm: Arm) -> tuple[str, ...]:
        """Columns that a recording of a rig with this drive must have."""
        return self.reference_channels(arm)

    def holds_joints(self, law: DriveLaw) -> bool:
        """Whether feedback keeps a simulation close to its recording. A replayed torque alone lets
        it drift away, so a virtual servo has to hold the joints."""
        return bool(np.any(law.P) or np.any(law.V) or law.states)

    def latex(self) -> str:
        """The law as a formula, for display."""
        return ""

    def signals(self, recording: Recording, arm: Arm) -> np.ndarray:
        """References (N, nr) of a recording."""
        columns = [recording[name] for name in self.reference_channels(arm)]
        return np.column_stack(columns) if columns else np.zeros((len(recording.time), 0))


def per_joint(values: tuple[float, ...], arm: Arm, setting: str) -> tuple[float, ...]:
    """One value per joint, or InputError."""
    if len(values) != arm.joints:
        raise InputError(
            f"[drive] {setting} has {len(values)} values but the arm has {arm.joints} joints; "
            f"give one per joint."
        )
    return values


def stated_joints(setting: str, stated: object) -> tuple[int, ...]:
    """Joints, from 1, in a setting of [drive]; InputError where it is not a list of joints."""
    joints = list(stated) if isinstance(stated, list | tuple) else None
    valid = joints is not None and all(type(k) is int and k > 0 for k in joints)
    if joints is None or not valid or len(set(joints)) < len(joints):
        raise InputError(f"[drive] {setting} must be a list of joints such as [1], each once.")
    return tuple(joints)


def joints_there(setting: str, joints: Sequence[int], arm: Arm) -> None:
    """InputError where a setting of [drive] names a joint that the arm does not have."""
    for k in joints:
        if not 1 <= k <= arm.joints:
            raise InputError(
                f"[drive] {setting} names joint {k}; the arm has {arm.joints} joints, counted "
                f"from 1."
            )


def gain_parameter(name: str, gain: float, unit: str, symbol: str, title: str) -> Parameter:
    """A loop's `gain` in `unit`s, between zero and a hundred times its stated value."""
    scale = gain or 1.0
    return Parameter(name, gain, unit, 0.0, 100.0 * scale, symbol, title, scale=scale)


def torque_constants(stated: Sequence[float], arm: Arm) -> tuple[Parameter, ...]:
    """kt of every motor, within a factor of ten of its stated value."""
    return tuple(
        Parameter(
            f"kt{k + 1}", constant, f"{joint(arm.segments[k].joint).effort_unit}/A",
            constant / 10.0, constant * 10.0, rf"k_{{t{k + 1}}}",
            f"torque constant of motor {k + 1}", scale=constant,
        )
        for k, constant in enumerate(stated)
    )  # fmt: skip


def stated_or(name: str, stated: Sequence[float], values: Mapping[str, float]) -> np.ndarray:
    """(joints,) the values of `name` + joint number; the stated ones where there are none."""
    return np.array([values.get(f"{name}{k + 1}", x) for k, x in enumerate(stated)], dtype=float)


def drive_classes() -> Mapping[str, type[Drive]]:
    """All drives by their kind."""
    return classes_of(__package__, Drive)
