"""A model: an arm, its drive, and the level at which it is simulated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from core.arm.arm import Arm
from core.arm.catalogue import ArmCatalogue
from core.arm.compiled import CompiledArm, compile_arm
from core.arm.symbols import Structure
from core.drives.drive import Drive
from core.drives.law import DriveLaw
from core.errors import InputError
from core.parameters import Parameter
from core.recording.recording import Recording
from core.sentences import did_you_mean

LEVELS = ("lpv", "nonlinear")


class Steering(Protocol):
    """What closes the loop: a drive, or a servo around one."""

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw: ...

    def signals(self, recording: Recording, arm: Arm) -> np.ndarray: ...


class Numbers(NamedTuple):
    """A model's numbers at given parameter values."""

    p: np.ndarray
    law: DriveLaw


@dataclass(frozen=True)
class Model:
    """An arm with what drives it; `values` are parameter values that differ from the arm's."""

    arm: Arm
    drive: Drive
    level: str = "nonlinear"
    steering: Steering | None = None
    """The virtual servo where one is used; the drive itself otherwise."""

    def __post_init__(self) -> None:
        self.drive.check(self.arm)
        if self.level not in LEVELS:
            raise InputError(f"[model] level {self.level!r}: {did_you_mean(self.level, LEVELS)}")

    @cached_property
    def compiled(self) -> CompiledArm:
        return compile_arm(Structure.of(self.arm))

    @cached_property
    def arm_catalogue(self) -> ArmCatalogue:
        return ArmCatalogue(self.arm)

    @cached_property
    def parameters(self) -> dict[str, Parameter]:
        """All that can be estimated, by name."""
        own = {item.name: item for item in self.drive.parameters(self.arm)}
        return {**self.arm_catalogue.parameters, **own}

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name; InputError with the nearest known one otherwise."""
        if name not in self.parameters:
            hint = did_you_mean(name, self.parameters)
            raise InputError(f"[identify] parameters: {name!r} is not one of this arm's; {hint}")
        return self.parameters[name]

    @property
    def active_steering(self) -> Steering:
        return self.steering if self.steering is not None else self.drive

    def arm_vectors(self, names: Sequence[str], values: np.ndarray) -> np.ndarray:
        """p (S, np) for S value vectors (S, len(names)); names of the drive are passed over."""
        entries = self.arm_catalogue.entries
        mine = [i for i, name in enumerate(names) if name in entries]
        return self.arm_catalogue.vectors([names[i] for i in mine], values[:, mine])

    def numbers(self, values: Mapping[str, float] | None = None) -> Numbers:
        """p and the drive's law at the arm's own values, changed by `values`."""
        values = values or {}
        known = {name: value for name, value in values.items() if name in self.parameters}
        vector = np.array([list(known.values())], dtype=float)
        p = self.arm_vectors(list(known), vector)[0]
        return Numbers(p, self.active_steering.law(self.arm, p, known))

    def at_level(self, level: str) -> Model:
        return replace(self, level=level)

    def steered_by(self, steering: Steering | None) -> Model:
        return replace(self, steering=steering)
