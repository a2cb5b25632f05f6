"""What a method of the baseline table gives: predictions, poles, a number of parameters."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from core.model import Model
from core.montecarlo.interpolated import Interpolated
from core.montecarlo.rig import Rig
from core.recording.recording import Recording
from core.simulate.modes import integrators
from core.simulate.posture import posture

SLOWEST, FASTEST = 1e-6, 1000.0
"""rad/s: poles compared. Those above are a third of the sampling's Nyquist rate and more; no
method sees them in samples of 1 kHz."""


class Contender(ABC):
    """An identified model, whatever it is made of."""

    parameters: int

    @abstractmethod
    def predict(self, recording: Recording) -> np.ndarray:
        """ydot (N, 2) at the recording's working point, or along its theta2 where it moves."""

    @abstractmethod
    def poles(self, theta2: float) -> np.ndarray:
        """1/s, of the linear model from references to ydot."""


@dataclass
class Physical(Contender):
    """The arm's own equations with estimated parameters."""

    rig: Rig
    model: Model
    values: Mapping[str, float]

    @property
    def parameters(self) -> int:  # type: ignore[override]
        """Number of estimated parameters."""
        return len(self.values)

    def predict(self, recording: Recording) -> np.ndarray:
        return self.rig.predict(self.model, [recording], dict(self.values))[0]

    def poles(self, theta2: float) -> np.ndarray:
        joints = np.array([0.0, theta2])
        found = posture(self.model, joints, self.model.numbers(self.values)).poles
        return np.asarray(found[~integrators(found)])


@dataclass
class BlackBox(Contender):
    """Local models of the black-box kind, interpolated."""

    model: Interpolated
    sample_time: float

    @property
    def parameters(self) -> int:  # type: ignore[override]
        """Number of estimated parameters."""
        return self.model.numbers

    def predict(self, recording: Recording) -> np.ndarray:
        u = references(recording)
        if recording.theta2 is not None:
            return self.model.at(recording.theta2).respond(u)
        return self.model.respond(u, recording["theta2"])

    def poles(self, theta2: float) -> np.ndarray:
        values = np.linalg.eigvals(self.model.at(theta2).A).astype(complex)
        return np.asarray(np.log(np.where(values == 0.0, 1e-300, values)) / self.sample_time)


def references(recording: Recording) -> np.ndarray:
    """(N, 2) rad/s"""
    return np.column_stack([recording["dtheta1_ref"], recording["dtheta2_ref"]])


def pole_error(found: np.ndarray, true: np.ndarray) -> float:
    """Mean distance of each true pole that matters to the found one that is its own, relative.

    Each found pole is spent once; a true pole that nothing is left for counts as wholly wrong.
    """
    from scipy.optimize import linear_sum_assignment

    wanted = true[(np.abs(true) > SLOWEST) & (np.abs(true) < FASTEST)]
    apart = np.abs(found[:, None] - wanted[None]) / np.abs(wanted)[None]
    apart = np.minimum(np.where(np.isfinite(apart), apart, 1.0), 1.0)
    rows, columns = linear_sum_assignment(apart)
    return float((apart[rows, columns].sum() + len(wanted) - len(columns)) / len(wanted))
