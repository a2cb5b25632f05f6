"""The contract of a sensor."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np

from ..arm.arm import Arm
from ..drives.law import DriveLaw
from ..recording.channels import ChannelKind, add_channels
from ..recording.recording import Recording

if TYPE_CHECKING:
    from ..arm.compiled import CompiledArm
    from ..simulate.posture import Posture
    from ..trajectory import Trajectory


class Channel(NamedTuple):
    """One output: its column in a recording and its SI unit."""

    name: str
    unit: str


class OutputRows(NamedTuple):
    """A linear output y = Q q + V q' + S s + R r; shapes (k, n), (k, n), (k, ns), (k, nr)."""

    Q: np.ndarray
    V: np.ndarray
    S: np.ndarray
    R: np.ndarray


class Sensor(ABC):
    """One kind of measurement, with one or more channels."""

    kind = ""
    """The id: an output of [identify], and what its noise is drawn with."""
    title = ""
    noise = ""
    """Its setting in [sensors]: the standard deviation of the noise of all its channels, SI; empty:
    what follows from other sensors has none of its own."""
    primary: bool = False
    """Whether it measures something of its own: with the full equations it is compared unless the
    scenario says otherwise. What follows from other sensors, or drives the arm, does not."""
    drifts: bool = False
    """Whether it is a place, whose mean drifts by whatever a model lacks where only speeds are
    controlled."""
    from_camera: bool = False
    """Whether the camera gives it: the stated signal-to-noise ratio of a simulation is about it."""
    at_camera_rate: bool = False
    """Whether a simulated recording has samples of it at [sensors] camera_rate only."""
    slow: bool = False
    """Whether its signal passes an analogue or averaging stage; encoders count."""
    letter: str = ""
    """Before its channels' numbers in the names of their own delays and scales (te1: the delay of
    encoder 1); its kind where empty."""
    called: str = ""
    """What stands before a channel's number in words; its title where empty."""
    optional: bool = False
    """Whether few rigs have it: it is simulated only where `[sensors]` states its noise or its
    place."""
    columns: ClassVar[tuple[ChannelKind, ...]] = ()
    """Columns of a recording that it brings, beside those in core.recording.channels."""

    def __init_subclass__(cls) -> None:
        add_channels(cls.columns)

    each_alone: bool = False
    """Whether a recording may have some of its channels only."""

    def is_stated(self, arm: Arm) -> bool:
        """Whether the arm is known to have it, so that what lists a linear model's outputs names
        it."""
        return not self.optional

    def gain_unit(self, arm: Arm, channel: str) -> str | None:
        """The unit of a channel's gain where it is not known; None where it is."""
        return None

    def defined_on(self, arm: Arm) -> bool:
        """Whether the arm can have this sensor."""
        return True

    @abstractmethod
    def channels(self, arm: Arm) -> tuple[Channel, ...]:
        """The channels on this arm."""

    @abstractmethod
    def measure(self, trajectory: Trajectory) -> np.ndarray:
        """(N, k): what an ideal sensor reads along a motion."""

    def rows(self, arm: Arm, p: np.ndarray, law: DriveLaw) -> OutputRows | None:
        """The output of the linear model at the arm's numbers p (np,); None where it is not linear
        in the state."""
        return None

    def linearised(self, at: Posture) -> tuple[np.ndarray, np.ndarray] | None:
        """C (k, nx) and D (k, nr) of the linear model at a posture: y = C x + D r, from what the
        sensor reads there; None where it has no such slopes."""
        rows = self.rows(at.model.arm, at.numbers.p, at.numbers.law)
        return None if rows is None else (np.hstack([rows.Q, rows.V, rows.S]), rows.R)

    def check(self, arm: Arm, recording: Recording) -> None:  # noqa: B027 (most need no check)
        """InputError where this output is not defined for the arm or the recording."""

    def measured(self, recording: Recording, arm: Arm) -> np.ndarray:
        """(N, k) of a recording; NaN is 'no sample'."""
        lacking = np.full(len(recording.time), np.nan)
        return np.column_stack(
            [
                lacking if self.each_alone and not recording.has(name) else recording[name]
                for name, _ in self.channels(arm)
            ]
        )

    def measure_like(self, recording: Recording, trajectory: Trajectory) -> np.ndarray:
        """(N, k) of a model's motion, by the same route as `measured` takes for the recording."""
        return self.measure(trajectory)

    def linear_rows(
        self, recording: Recording, arm: Arm, p: np.ndarray, law: DriveLaw
    ) -> OutputRows | None:
        """What of the linear model's state, at the arm's numbers p (np,), `from_linear` takes; None
        where only whole motions can be measured."""
        return self.rows(arm, p, law)

    def from_linear(
        self, y: np.ndarray, recording: Recording, arm: Arm, compiled: CompiledArm, p: np.ndarray
    ) -> np.ndarray:
        """The results of `measure_like` for S motions with the arm's numbers p (S, np), from their
        `linear_rows` y (N, k, S)."""
        return y

    def is_linear(self, recording: Recording, arm: Arm) -> bool:
        """Whether `linear_rows` are the output itself, so that `from_linear` changes nothing."""
        return True

    def direct(self, recording: Recording, arm: Arm) -> bool:
        """Whether the recording holds the channels themselves, not something they come from."""
        have = [recording.has(c.name) for c in self.channels(arm)]
        return any(have) if self.each_alone else bool(have) and all(have)

    def available(self, recording: Recording, arm: Arm) -> bool:
        """Whether the recording holds this output or what it comes from."""
        return self.direct(recording, arm)


def rows_of(arm: Arm, law: DriveLaw, k: int) -> OutputRows:
    """Zero rows of the right shapes, to be filled."""
    n = arm.coordinates
    return OutputRows(
        np.zeros((k, n)), np.zeros((k, n)), np.zeros((k, law.states)), np.zeros((k, law.references))
    )
