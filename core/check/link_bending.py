"""Bending of the links, computed from the measured joint motion.

Measured joints determine a link's motion, whatever drives them: with e = Phi theta + w the equation
M_ee e'' + K e = -M_er theta'' of the bending coordinates becomes, for Phi = -M_ee^-1 M_er, a
low-pass filter M_ee w'' + K w = -K Phi theta of the encoder positions. It needs no derivatives,
drives, gains or friction. Stiffness (one factor per segment) and damping are free. A lag is
distinguishable from both: the response of a lightly damped structure shifts amplitudes and no
phases.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from ..check.measured_recording import MeasuredRecording, lattice_step, noise_of
from ..model import Model
from ..sensors import sensor
from ..trajectory import Trajectory

SMALL = 0.6
"""rad (m) by which a joint may move around one working point: inertias change by some per cent (the
cosine of an angle by 0.3 at its steepest)."""
LIGHT = 0.01
"""First damping ratio, of bolted aluminium links."""
CLEAN = 0.1
"""Share of an acceleration's rms that may be encoder noise after low-pass filtering."""
IN_MOTION = 0.5
"""Share of its rms speed that a joint has at the first samples if it begins in motion."""
LONGEST, FIRST, MOVES = 6000, 50, 0.01
"""Samples that are used, from so many before a joint has left 1 % of its range: enough for a lag of
a tenth of a sample, and quick."""
CUTS = (0.4, 0.25, 0.16, 0.1, 0.06, 0.04, 0.025, 0.016, 0.01)
"""Shares of the sample rate; the highest with a clean acceleration is used."""
DRY = 0.05
"""Share of the rms speed over which dry friction changes its sign."""
EDGE, MOST = 20, 3000
"""Samples omitted at both ends, where a shifted channel has no values; rows of a regression."""


@dataclass(frozen=True)
class LinkShape:
    """Unknown stiffness and damping of the links."""

    stiffness: np.ndarray
    """(bending segments,) over the stated one"""
    damping: float
    """Ratio of every mode."""


@dataclass(frozen=True)
class LinkBending:
    """The links of one recording at its middle posture."""

    found: MeasuredRecording
    model: Model
    q: np.ndarray
    """(M, joints) encoders on the even clock, from where they begin to move"""
    _stretch: slice
    """The same stretch of the even clock."""

    @classmethod
    def of(cls, recording: MeasuredRecording, most: float = SMALL) -> LinkBending | None:
        """None if nothing bends, an encoder is missing, or a joint that changes the posture moves
        by more than `most`."""
        model = recording.model
        if model is None or model.arm.coordinates == model.arm.joints:
            return None
        names = [f"theta{k + 1}" for k in range(model.arm.joints)]
        if not recording.has(*names):
            return None
        q = np.column_stack([recording.even(n) for n in names])
        stretch = _first_moves(q)
        q = q[stretch]
        inner = np.percentile(q[:, 1:], [2.0, 98.0], axis=0)  # an outlier is another fault
        return None if np.any(np.ptp(inner, axis=0) > most) else cls(recording, model, q, stretch)

    def channel(self, name: str) -> np.ndarray:
        """(M,) values of a channel over the same stretch."""
        return self.found.even(name)[self._stretch]

    @property
    def grid(self) -> np.ndarray:
        """(M,) s"""
        return self.found.grid[self._stretch]

    @property
    def inner(self) -> slice:
        """The samples of a regression."""
        count = len(self.q)
        edge = min(EDGE, count // 5)
        return slice(edge, count - edge, max(count // MOST, 1))

    @cached_property
    def segments(self) -> np.ndarray:
        """(bending coordinates,) bending segment of each, from 0; before twists."""
        counts = [m for m in self.model.arm.modes if m]
        return np.repeat(np.arange(len(counts)), counts)

    @cached_property
    def _matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(p, M, K) at the middle posture."""
        p, n = self.model.numbers().p, self.model.arm.coordinates
        middle = np.zeros(n)
        middle[: self.model.arm.joints] = np.median(self.q, axis=0)
        K, _ = self.model.compiled.linear_matrices(middle, p)
        return p, self.model.compiled.mass_matrix(middle, p), K

    def _modes(self, shape: LinkShape) -> tuple[np.ndarray, np.ndarray]:
        """(rad/s (modes,), shapes (bending coordinates, modes)) with fixed joints."""
        _, M, K = self._matrices
        j = self.model.arm.joints
        root = np.ones(len(K) - j)  # twists of joints and a soft base are as stated
        root[: len(self.segments)] = np.sqrt(shape.stiffness[self.segments])
        squares, modes = scipy.linalg.eigh(root[:, None] * K[j:, j:] * root, M[j:, j:])
        return np.sqrt(np.maximum(squares, 1e-12)), modes

    def bending(self, shape: LinkShape, q: np.ndarray) -> np.ndarray:
        """(M, bending coordinates) while the joints move as q (M, joints), from rest."""
        _, M, _ = self._matrices
        j = self.model.arm.joints
        omega, modes = self._modes(shape)
        followed = -np.linalg.solve(M[j:, j:], M[j:, :j])
        moved = (q - q[0]) @ followed.T
        inputs = -moved @ (M[j:, j:] @ modes)
        answers = [
            _second_order(w, shape.damping, self.found.step, x)
            for w, x in zip(omega, inputs.T, strict=True)
        ]
        return np.asarray(moved + np.column_stack(answers) @ modes.T)

    def free_vibrations(self, shape: LinkShape) -> list[np.ndarray]:
        """Free vibrations (M,) of every mode, two each, of a recording that starts in motion. None
        if the joints begin at rest: they would explain too much of a short recording."""
        if not self._moves_first:
            return []
        omega, _ = self._modes(shape)
        poles = omega * (-shape.damping + 1j * np.sqrt(1.0 - shape.damping**2))
        count = int(np.ceil(np.sqrt(len(self.q))))  # powers of powers: few exponentials
        k = poles[:, None] * self.found.step * np.arange(count)
        waves = (np.exp(count * k)[:, :, None] * np.exp(k)[:, None, :]).reshape(len(poles), -1)
        parts = np.stack([waves.real, waves.imag], axis=1).reshape(2 * len(poles), -1)
        return list(parts[:, : len(self.q)])

    @cached_property
    def _moves_first(self) -> bool:
        dt = self.found.step
        first = np.abs(self.q[2] - self.q[0]) / (2.0 * dt)
        speed = np.gradient(self.smooth(self.q), dt, axis=0)
        return bool(np.any(first > IN_MOTION * np.sqrt(np.mean(speed**2, axis=0))))

    def coordinates(self, shape: LinkShape, q: np.ndarray) -> np.ndarray:
        """(M, coordinates) of the arm while its joints move as q (M, joints), from rest."""
        return np.hstack([q, self.bending(shape, q)])

    def sensed(self, whole: np.ndarray) -> dict[str, np.ndarray]:
        """Channels (M,) of the camera and the gauges while the arm moves so (M, coordinates)."""
        p, _, _ = self._matrices
        nothing = np.zeros_like(whole)
        motion = Trajectory(
            self.model.arm, self.model.compiled, p, self.grid, whole, nothing, nothing
        )
        channels: dict[str, np.ndarray] = {}
        for kind in ("z", "deflection"):
            camera_or_gauge = sensor(kind)
            names = [c.name for c in camera_or_gauge.channels(self.model.arm)]
            if any(self.found.has(n) for n in names):
                values = np.array(camera_or_gauge.measure(motion))
                channels |= {
                    n: v for n, v in zip(names, values.T, strict=True) if self.found.has(n)
                }
        return channels

    @cached_property
    def _cut(self) -> float:
        """Share of the sample rate below which the encoders' accelerations are clean."""
        clean = (c for c in CUTS if all(_is_clean(x, c) for x in self.q.T))
        return next(clean, CUTS[-1])

    def smooth(self, x: np.ndarray) -> np.ndarray:
        """Signals (M,) or columns (M, k) without the frequencies at which accelerations are
        noise."""
        return _low_passed(x, self._cut)

    def as_applied(self, x: np.ndarray) -> np.ndarray:
        """A drive's signal (M,), smoothed, with the half sample of delay by which a held signal
        acts."""
        return self.smooth((x + np.r_[x[0], x[:-1]]) / 2.0)

    def torques(self, whole: np.ndarray) -> np.ndarray:
        """(M, joints) smoothed torques of a motion (M, coordinates), without friction."""
        _, M, _ = self._matrices
        dt = self.found.step
        momentum = self.smooth(whole @ M[: self.model.arm.joints].T)
        return np.asarray(np.gradient(np.gradient(momentum, dt, axis=0), dt, axis=0))

    def torques_of_each(self, shape: LinkShape | None) -> np.ndarray:
        """(M, joints, joints) smoothed torques of each joint (rows) for the motion of each joint
        (columns); without a shape, of rigid links at every posture."""
        if shape is not None:
            columns = []
            for k in range(self.q.shape[1]):
                single = np.tile(self.q[0], (len(self.q), 1))
                single[:, k] = self.q[:, k]
                columns.append(self.torques(self.coordinates(shape, single)))
            return np.stack(columns, axis=2)
        p, n, j = self.model.numbers().p, self.model.arm.coordinates, self.q.shape[1]
        smooth, dt = self.smooth(self.q), self.found.step
        twice = np.gradient(np.gradient(smooth, dt, axis=0), dt, axis=0)
        whole = np.hstack([smooth, np.zeros((len(smooth), n - j))])
        masses = self.model.compiled.mass_path(whole, p)[:, :j, :j]
        return np.asarray(masses * twice[:, None, :])

    def friction_inputs(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(M, joints) smoothed speeds, and their directions for dry friction."""
        speed = np.gradient(self.smooth(q), self.found.step, axis=0)
        usual = np.sqrt(np.mean(speed**2, axis=0)) + 1e-300
        return speed, np.tanh(speed / (DRY * usual))


def _first_moves(q: np.ndarray) -> slice:
    """The first LONGEST samples of q (N, joints) that are more than waiting."""
    away = np.max(np.abs(q - q[0]) / (np.ptp(q, axis=0) + 1e-300), axis=1)
    first = max(int(np.argmax(away > MOVES)) - FIRST, 0) if len(q) > LONGEST else 0
    return slice(first, first + LONGEST)


def _second_order(omega: float, damping: float, dt: float, x: np.ndarray) -> np.ndarray:
    """omega^2 / (s^2 + 2 damping omega s + omega^2) of x (M,), exact for linear interpolation, from
    rest."""
    pole = omega * (-damping + 1j * np.sqrt(1.0 - damping**2))
    grown = np.exp(pole * dt)
    # x' = pole x + u with u linear over a step: weights of its two ends.
    first = (grown - 1.0) / pole
    slope = (first - dt) / (pole * dt)
    at_start, at_end = first - slope, slope
    # The imaginary part of that complex filter of first order, as a real one of second order.
    b = np.array([at_end, at_start - at_end * grown.conjugate(), -at_start * grown.conjugate()])
    a = [1.0, -2.0 * grown.real, abs(grown) ** 2]
    return np.asarray((omega**2 / pole.imag) * scipy.signal.lfilter(b.imag, a, x))


def _low_passed(x: np.ndarray, cut: float) -> np.ndarray:
    """A third-order Butterworth filter run forwards and backwards, with ends reflected; `cut` of
    the sample rate."""
    more = min(int(3.0 / cut), len(x) - 1)
    rows = np.ascontiguousarray(x.T)  # transforms of columns take twice as long
    first, last = rows[..., :1], rows[..., -1:]
    before, after = 2 * first - rows[..., more:0:-1], 2 * last - rows[..., -2 : -more - 2 : -1]
    long = np.concatenate([before, rows, after], axis=-1)
    size = scipy.fft.next_fast_len(long.shape[-1], real=True)
    powers = 1.0 / (1.0 + (np.fft.rfftfreq(size) / cut) ** 6)
    base = long[..., :1]
    smooth = (
        scipy.fft.irfft(powers * scipy.fft.rfft(long - base, size), size)[..., more : more + len(x)]
        + base
    )
    return np.asarray(smooth.T)


def _is_clean(x: np.ndarray, cut: float) -> bool:
    """Whether a position's smoothed acceleration is motion and not encoder noise."""
    noise = max(lattice_step(x) / np.sqrt(12.0), min(noise_of(x), float(np.std(x))))
    white = noise * np.random.default_rng(0).standard_normal(len(x))
    own, others = (np.std(np.diff(_low_passed(y, cut), 2)[5:-5]) for y in (x, white))
    return bool(others <= CLEAN * own)
