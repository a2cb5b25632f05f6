"""State feedback on joint angle, link deflection and their rates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from pydantic import BaseModel, ConfigDict

from ..arm.arm import Arm
from ..arm.chord import chord_matrix
from ..drives.drive import Drive, per_joint, stated_or, torque_constants
from ..drives.law import DriveLaw
from ..parameters import Parameter
from ..validation import Bounded, Positive


class GaugeFilter(BaseModel):
    """Second-order low-pass of the deflection that the controller reads."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    frequency: Positive
    """rad/s"""
    damping: Positive
    """Damping ratio, 1"""


class StateFeedback(Drive):
    """i = K (x* - x) per joint, x = [angle, deflection, their rates], u = torque constant times i.

    `gains` has one row of four per joint; only the angle has a reference. The controller can
    read the angle's rate through a first-order filter `rate_filter` (rad/s), and the deflection
    through a `gauge_filter`.
    """

    kind: ClassVar[str] = "state_feedback"

    gains: tuple[tuple[Bounded, Bounded, Bounded, Bounded], ...]
    """A row per joint: A/rad, A/rad, A s/rad, A s/rad."""
    torque_constants: tuple[Positive, ...]
    """N m/A, one per joint."""
    rate_filter: Positive | None = None
    """rad/s; None: the rate is not filtered."""
    gauge_filter: GaugeFilter | None = None
    """Table with frequency (rad/s) and damping; None: the deflection is not filtered."""
    current_limits: tuple[Positive, ...] | None = None
    """A, one per joint; None: no limit."""

    def check(self, arm: Arm) -> None:
        per_joint(self.torque_constants, arm, "torque_constants")
        per_joint(tuple(float(i) for i in range(len(self.gains))), arm, "gains")
        if self.current_limits is not None:
            per_joint(self.current_limits, arm, "current_limits")

    def parameters(self, arm: Arm) -> tuple[Parameter, ...]:
        """The torque constants; the gains are exact, because a program applies them."""
        return torque_constants(self.torque_constants, arm)

    def reference_channels(self, arm: Arm) -> tuple[str, ...]:
        return tuple(f"theta{k + 1}_ref" for k in range(arm.joints))

    def latex(self) -> str:
        state = r"x = [\theta, \; \delta(l)/l, \; \dot{\theta}, \; \dot{\delta}(l)/l]"
        return rf"u = k_t K (x^* - x), \qquad {state}"

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw:
        joints, n = arm.joints, arm.coordinates
        constants = stated_or("kt", self.torque_constants, values)
        K = np.array(self.gains, dtype=float) * constants[:, None]
        chord = chord_matrix(arm, p)
        angle = np.eye(joints, n)
        P, V = K[:, :1] * angle, np.zeros((joints, n))
        blocks = _Blocks(joints, n)
        if self.rate_filter is None:
            V += K[:, 2:3] * angle
        else:
            blocks.add_rate(self.rate_filter, angle, K[:, 2])
        if self.gauge_filter is None:
            P += K[:, 1:2] * chord
            V += K[:, 3:4] * chord
        else:
            g = self.gauge_filter
            blocks.add_low_pass(g.frequency, g.damping, chord, K[:, 1], K[:, 3])
        limit = np.full(joints, np.inf)
        if self.current_limits is not None:
            limit = np.array(self.current_limits) * constants
        S, Fs, Fq, Fv = blocks.matrices()
        return DriveLaw(
            R=np.diag(K[:, 0]), P=P, V=V, S=S, Fs=Fs, Fq=Fq, Fv=Fv,
            Fr=np.zeros((len(Fs), joints)), limit=limit,
        )  # fmt: skip


class _Blocks:
    """Collects the states of the controller's filters."""

    def __init__(self, joints: int, n: int) -> None:
        self.joints, self.n = joints, n
        self.S: list[np.ndarray] = []
        self.rows: list[tuple[dict[int, float], np.ndarray, np.ndarray]] = []

    def _state(
        self, output: np.ndarray, own: dict[int, float], place: np.ndarray, speed: np.ndarray
    ) -> None:
        """s' = own s + place q + speed q', and its part of the torque."""
        self.S.append(output)
        self.rows.append((own, place, speed))

    def add_rate(self, w: float, rows: np.ndarray, gain: np.ndarray) -> None:
        """rate' = w (x' - rate): zero at rest, wherever the joint stands."""
        zeros = np.zeros(self.n)
        for k in range(self.joints):
            unit = np.eye(self.joints)[k]
            self._state(gain[k] * unit, {len(self.S): -w}, zeros, w * rows[k])

    def add_low_pass(
        self, w: float, zeta: float, rows: np.ndarray, gain: np.ndarray, rate_gain: np.ndarray
    ) -> None:
        """a' = b, b' = w^2 (x - a) - 2 zeta w b; a and b are what the controller sees."""
        for k in range(self.joints):
            a, b = len(self.S), len(self.S) + 1
            unit, zeros = np.eye(self.joints)[k], np.zeros(self.n)
            own = {a: -w * w, b: -2.0 * zeta * w}
            self._state(gain[k] * unit, {b: 1.0}, zeros, zeros)
            self._state(rate_gain[k] * unit, own, w * w * rows[k], zeros)

    def matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """S, Fs, Fq and Fv of core.drives.law.DriveLaw."""
        ns = len(self.S)
        S = np.array(self.S).T.reshape(self.joints, ns)
        Fs, Fq, Fv = np.zeros((ns, ns)), np.zeros((ns, self.n)), np.zeros((ns, self.n))
        for i, (own, place, speed) in enumerate(self.rows):
            Fq[i], Fv[i] = place, speed
            for j, value in own.items():
                Fs[i, j] = value
        return np.ascontiguousarray(S), Fs, Fq, Fv
