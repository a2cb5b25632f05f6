"""The contract of an effect: one physical phenomenon that a model may lack.

An effect states what it changes and never asks what else is in the model. At its neutral values
the model is exactly the bare one. Effects are plug-ins: one file each in this folder.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from ..arm.arm import Arm
from ..arm.slots import arm_vector
from ..drives.drive import Drive
from ..drives.law import DriveLaw
from ..effects.sizes import Sizes
from ..forces.element import Element
from ..parameters import Parameter
from ..sensors import sensors
from ..sentences import listed

Values = Mapping[str, float]


@dataclass(frozen=True)
class Rig:
    """What the recordings of a machine can show: its arm and drive, and what is measured."""

    arm: Arm
    drive: Drive
    level: str
    """Of the model without the effect: 'lpv' or 'nonlinear'."""
    outputs: tuple[str, ...]
    """Kinds of output that are compared (core.sensors)."""
    servo: bool = False
    """Whether a virtual servo holds the joints on the encoders (torque rigs)."""
    stated: Mapping[str, str] = field(default_factory=dict)
    """What is known of it a priori: key of a statement in `[rig]` -> the statement in words."""
    estimated_gains: frozenset[str] = frozenset()
    """Channels whose gain is estimated anyhow."""

    @property
    def camera(self) -> bool:
        """Whether an output of the camera is compared."""
        return any(sensors()[kind].from_camera for kind in self.outputs)

    @property
    def bends(self) -> bool:
        """Whether any segment bends."""
        return any(self.arm.modes)


@dataclass(frozen=True)
class EffectParameter:
    """A parameter of an effect. `parameter.value` is a plausible size to begin with."""

    parameter: Parameter
    """Its name, unit, bounds and a plausible size."""
    neutral: float = 0.0
    """The value at which the effect vanishes; it need not lie within the bounds of a fit."""
    grid: tuple[float, ...] = ()
    """Sizes to try where the response has no slope at neutral; empty: it has one."""
    secondary: bool = False
    """Freed in refits only: it changes the shape of the effect, not its size."""
    fine_grid: tuple[float, ...] = ()
    """Shapes for a second look, so close that a descent finds what lies between."""
    separate: bool = False
    """Whether it is about a thing of its own: neutral where only others are stated."""
    ruled_out_by: str = ""
    """Key of the statement in `[rig]` under which it stays neutral; empty: there is none."""


class Effect(ABC):
    """One effect. Hooks that an effect does not need stay as they are: they change nothing."""

    kind: str = ""
    """The id that scenarios and results use."""
    location: str = ""
    """Where it sits: joint, drive, segments, motion or sensors."""
    title: str = ""
    story: str = ""
    """For a student: what it is, where it acts, what it leaves in the residual."""
    formula: str = ""
    """LaTeX, for display."""
    includes: tuple[str, ...] = ()
    """Simpler effects that are part of this one; they are added with it and preferred to it."""
    special_cases: tuple[str, ...] = ()
    """Effects that it becomes at an end of its range, on some arms; they are preferred to it."""
    linear: bool = False
    """Whether it has a place in the LPV model; adding another makes the model non-linear."""
    repeats: bool = False
    """Whether it can be in a model more than once, each time on top of the last."""
    dissipative: bool = False
    """Whether it can only take energy away."""
    idealised: float = 0.0
    """Relative uncertainty of its change of the outputs, for a law that idealises the real one."""
    inputs: tuple[str, ...] = ()
    """Names of the signals of a recording that its forces depend on, of core.recording.inputs."""
    acts_at: str = ""
    """Where on the arm: joints, tip, segments, base, camera or drive."""
    ruled_out_by: str = ""
    """Key of the statement in `[rig]` under which it cannot be; empty: there is none."""

    def not_applicable(self, rig: Rig) -> str:
        """A sentence why this rig cannot show the effect; empty where it can."""
        return ""

    def shown(self, name: str, rig: Rig) -> bool:
        """Whether the rig can show its parameter of that name; where not, it stays neutral."""
        return True

    def is_searched(self, quantity: EffectParameter, rig: Rig) -> bool:
        """Whether a parameter is to be found on a rig: it shows there and may differ from
        neutral."""
        shown = self.shown(quantity.parameter.name, rig)
        return shown and quantity.ruled_out_by not in rig.stated

    def ruled_out(self, rig: Rig, sizes: Sizes) -> dict[str, str]:
        """What of it cannot be by what is stated of the rig: its own title, or those of some of
        its parameters -> the statement."""
        if self.ruled_out_by in rig.stated:
            return {self.title: rig.stated[self.ruled_out_by]}
        quantities = self.parameters(self.changed_arm(rig.arm, {}), rig.drive, sizes)
        shown = [k for k in quantities if self.shown(k.parameter.name, rig)]
        out = [k for k in shown if not self.is_searched(k, rig)]
        statements = {k.parameter.title: rig.stated[k.ruled_out_by] for k in out}
        if statements and len(out) == len(shown):
            return {self.title: listed(list(dict.fromkeys(statements.values())))}
        return statements

    @abstractmethod
    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        """Its parameters on the arm of `changed_arm`; none for an effect that is switched."""

    @cache  # noqa: B019 - effects are few and stay; one part is one object in all rounds
    def without(self, names: frozenset[str]) -> Effect:
        """The same effect with those parameters left to whoever estimates them already."""
        if not names:
            return self
        part = copy(self)
        kept = lambda *of: tuple(  # noqa: E731
            k for k in self.parameters(*of) if k.parameter.name not in names
        )
        part.parameters = kept  # type: ignore[method-assign]
        return part

    def changed_arm(self, arm: Arm, values: Values) -> Arm:
        """The arm with the effect in it; a change of structure happens here."""
        return arm

    def level(self, level: str) -> str:
        """The level of the model with the effect in it."""
        return level if self.linear else "nonlinear"

    def law(self, law: DriveLaw, arm: Arm, p: np.ndarray, values: Values) -> DriveLaw:
        """The drive's law on the arm with numbers p (13 N + 5,), with the effect in it."""
        return law

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        """Extra forces on the arm with numbers p (13 N + 5,), compiled from their symbolic laws."""
        return ()

    def started(self, joints: np.ndarray, values: Values) -> np.ndarray:
        """True joint positions (..., nj) from the encoders' `joints` (..., nj)."""
        return joints

    def followed(self, joints: np.ndarray, dt: float, values: Values) -> np.ndarray:
        """True joint positions (N, nj) from the encoders' `joints` (N, nj), `dt` s apart, that a
        servo follows."""
        return joints

    def sensed(self, sensor: str, y: np.ndarray, dt: float, values: Values) -> np.ndarray:
        """What one kind of sensor reads (N, k), from what an ideal one would, y (N, k), `dt` s
        apart."""
        return y


def torque_is_replayed(rig: Rig) -> bool:
    """Whether the model takes its torque from the recording: nothing is fed back, or a servo is."""
    law = rig.drive.law(rig.arm, arm_vector(rig.arm), {})
    return rig.servo or not (np.any(law.P) or np.any(law.V) or law.states)
