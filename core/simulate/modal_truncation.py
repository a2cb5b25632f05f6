"""What a motion lacks because each segment bends in few assumed modes.

The linear model of the arm, drive closed, is run twice along the same references: as it is, and
with one more mode per bending segment. The tips' difference is the error of the modes: the next
mode alone leaves a seventh of the error or less, so what the later ones add hardly counts. Joints
that move far take the linear model along, block by block. (A hierarchical error estimate: Bank
and Smith, SIAM J. Numer. Anal. 30, 1993.)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..arm.arm import Arm
from ..arm.joints import joint
from ..arm.shapes import exponent
from ..arm.signatures import kernel, matrix, vector
from ..arm.slots import (
    AXIS_ANGLE,
    DAMPING_TIME,
    HUB_INERTIA,
    LENGTH,
    MASS,
    ROTOR_INERTIA,
    STIFFNESS,
    TIP_INERTIA,
    TIP_MASS,
    gravity_slot,
    slot,
)
from ..model import Model, Numbers
from ..simulate.motion import Task, full_start
from ..simulate.response import exponential

EXTRA = 1
"""Modes added to each segment that bends; a second one moved the estimate by 1 to 6 %."""

FAR = 0.1
"""rad or m: how far a joint goes before the linear model is made again. On a sweep of the whole
range the estimate is then 2 to 11 % off; with 0.25 it was up to 42 %."""

GAUSS = np.polynomial.legendre.leggauss(8)
"""Exact to degree 15; the highest is 10, of the mode added to three squared."""

Mode = tuple[int, int]
"""Segment, and exponent of x."""


def bending(arm: Arm) -> bool:
    """Whether any segment has modes, so that some are left out."""
    return any(arm.modes)


def left_out(model: Model, numbers: Numbers, task: Task, joints: np.ndarray) -> np.ndarray:
    """The tip (N, 2) in m of a finer beam minus the model's, along the motion of joints (N, nj).

    Extra forces of effects are not in the linear model: they decide the motion, but hardly what the
    next mode adds to it. Neither are the drive's limits, so that the answer does not hold where
    they are met.
    """
    deflection = np.zeros((len(task.time), 2))
    if not bending(model.arm):
        return deflection
    blocks, n = list(_blocks(joints)), model.arm.coordinates
    start = full_start(task, numbers)[: 2 * n + numbers.law.states]
    for extra, sign in ((0, -1.0), (EXTRA, 1.0)):
        arms = [StraightArm(model, numbers, joints[b].mean(axis=0), extra) for b in blocks]
        r = _inputs(task, numbers, blocks, arms)
        x = arms[0].widened(start)
        for rows, straight in zip(blocks, arms, strict=True):
            over = straight.step(task.sample_time)
            deflection[rows] += sign * march(over, straight.tip, r[rows], x)
    return deflection


def _inputs(
    task: Task, numbers: Numbers, blocks: list[slice], arms: list[StraightArm]
) -> np.ndarray:
    """(N, nr + n): references as they act on average over a sample, and the arm's weight, which
    runs straight from the middle of one block to the next."""
    r = np.asarray(task.references, dtype=float)
    if numbers.law.interpolate:
        r = 0.5 * (r + np.vstack([r[1:], r[-1:]]))
    middles = [0.5 * (b.start + b.stop) for b in blocks]
    weights = np.array([arm.weight for arm in arms])
    rows = np.arange(len(r))
    return np.hstack([r, *[np.interp(rows, middles, w)[:, None] for w in weights.T]])


def _blocks(joints: np.ndarray) -> Iterator[slice]:
    """Stretches of the motion (N, nj) over which no joint goes FAR."""
    first, N = 0, len(joints)
    while first < N:
        far = np.abs(joints[first:] - joints[first]).max(axis=1) > FAR
        last = first + int(np.argmax(far)) if far.any() else N
        yield slice(first, last)
        first = last


@kernel(matrix(matrix, matrix, matrix, vector))
def march(over, C, r, x):  # type: ignore[no-untyped-def]
    """C x (N, ny) before each step x <- over' [x, r]; over (nx + nr, nx), C (nx, ny); x moves."""
    nx, ny, N = x.size, C.shape[1], r.shape[0]
    y, new = np.zeros((N, ny)), np.empty(nx)
    for t in range(N):
        for i in range(nx):
            new[i] = 0.0
        for j in range(nx):
            for i in range(ny):
                y[t, i] += C[j, i] * x[j]
            for i in range(nx):
                new[i] += over[j, i] * x[j]
        for j in range(r.shape[1]):
            for i in range(nx):
                new[i] += over[nx + j, i] * r[t, j]
        for i in range(nx):
            x[i] = new[i]
    return y


@dataclass(frozen=True)
class _Link:
    """One segment of the straight arm: its root and end (2,) in m, unit vectors along and across,
    which way its joint moves it (turning or along `slide`), and what it stands on."""

    root: np.ndarray
    end: np.ndarray
    across: np.ndarray
    turns: bool
    slide: np.ndarray
    chain: tuple[int, ...]


class StraightArm:
    """The linear model at one posture with `extra` modes more per bending segment.

    Coordinates: those of the arm, then the added modes; states [q, q', s].
    """

    def __init__(self, model: Model, numbers: Numbers, joints: np.ndarray, extra: int) -> None:
        self.model, self.numbers, self.arm = model, numbers, model.arm
        modes = self.arm.modes
        self.known: list[Mode] = [(k, exponent(i)) for k, m in enumerate(modes) for i in range(m)]
        self.added: list[Mode] = [
            (k, exponent(i)) for k, m in enumerate(modes) if m for i in range(m, m + extra)
        ]
        self.n = self.arm.coordinates + len(self.added)
        self.q = np.zeros(self.arm.coordinates)
        self.q[: self.arm.joints] = joints
        self.links = self._links()
        self.M, self.weight = self._inertia_and_weight()

    def widened(self, start: np.ndarray) -> np.ndarray:
        """A state [q, q', s] of the model with the added modes at rest."""
        n, more = self.arm.coordinates, np.zeros(len(self.added))
        return np.concatenate([start[:n], more, start[n : 2 * n], more, start[2 * n :]])

    def _value(self, segment: int, which: int) -> float:
        return float(self.numbers.p[slot(segment, which)])

    def _links(self) -> list[_Link]:
        links: list[_Link] = []
        place, angle = np.zeros(2), 0.0
        chain: tuple[int, ...] = ()
        for k, segment in enumerate(self.arm.segments):
            if segment.mount == "ground":
                place, angle, chain = np.zeros(2), 0.0, ()
            kind, axis = joint(segment.joint), self._value(k, AXIS_ANGLE)
            shift = kind.place(float(self.q[k]), axis)
            turns = bool(kind.place(1.0, 0.0).turn)
            slide = _unit(angle + float(shift.direction))
            place = place + float(shift.slide) * slide
            angle, chain = angle + float(shift.turn), (*chain, k)
            end = place + self._value(k, LENGTH) * _unit(angle)
            links.append(_Link(place, end, _turned(_unit(angle)), turns, slide, chain))
            place = end
        return links

    def slopes(self, segment: int, x: float) -> np.ndarray:
        """dp/dq (2, n) of the point at x on a segment."""
        J, link = np.zeros((2, self.n)), self.links[segment]
        at = link.root + x * (link.end - link.root) / self._value(segment, LENGTH)
        for j in link.chain:
            below = self.links[j]
            J[:, j] = _turned(at - below.root) if below.turns else below.slide
            twist = self.arm.twist_place(j)
            if twist is not None:
                J[:, twist] = J[:, j]
        for c, (j, e) in self._columns():
            if j == segment:
                J[:, c] = link.across * x**e
            elif j in link.chain:
                below, end = self.links[j], self._value(j, LENGTH)
                turn = e * end ** (e - 1)
                J[:, c] = below.across * end**e + turn * _turned(at - below.end)
        if self.arm.base_compliance is not None:
            J[:, self.arm.coordinates - 2 : self.arm.coordinates] = np.eye(2)
        return J

    def _columns(self) -> list[tuple[int, Mode]]:
        """(place in q, mode) of all modes."""
        first, n = self.arm.joints, self.arm.coordinates
        return [*enumerate(self.known, first), *enumerate(self.added, n)]

    def _end_slope(self, segment: int) -> np.ndarray:
        """dphi/dq (n,) of the direction of a segment's end."""
        slope, chain = np.zeros(self.n), self.links[segment].chain
        for j in chain:
            twist = self.arm.twist_place(j)
            for place in (j, twist):
                if place is not None:
                    slope[place] = float(self.links[j].turns)
        for c, (j, e) in self._columns():
            if j in chain:
                slope[c] = e * self._value(j, LENGTH) ** (e - 1)
        return slope

    def _rotor_slope(self, segment: int) -> np.ndarray:
        """dphi/dq (n,) of a rotor without a gear, on the end of the segment before."""
        chain = [j for j in self.links[segment].chain if j != segment]
        slope = self._end_slope(chain[-1]) if chain else np.zeros(self.n)
        slope[segment] += float(self.links[segment].turns)
        return slope

    def _inertia_and_weight(self) -> tuple[np.ndarray, np.ndarray]:
        """M (n, n), and the force (n,) of gravity."""
        M, weight = np.zeros((self.n, self.n)), np.zeros(self.n)
        g = np.array([self.numbers.p[gravity_slot(self.arm.joints, i)] for i in range(2)])
        for k in range(self.arm.joints):
            length, mass = self._value(k, LENGTH), self._value(k, MASS)
            points = [
                (length * (x + 1.0) / 2.0, mass * w / 2.0) for x, w in zip(*GAUSS, strict=True)
            ]
            for x, m in (*points, (length, self._value(k, TIP_MASS))):
                J = self.slopes(k, x)
                M += m * J.T @ J
                weight += m * g @ J
            turn = self._end_slope(k)
            M += self._value(k, TIP_INERTIA) * np.outer(turn, turn)
            M[k, k] += self._value(k, HUB_INERTIA)
            rotor = self._rotor_slope(k)
            M += self._value(k, ROTOR_INERTIA) * np.outer(rotor, rotor)
        return M, weight

    def _stiffness_and_damping(self) -> tuple[np.ndarray, np.ndarray]:
        """K and D (n, n) without the drive: the arm's own, and the bending of the added modes."""
        n = self.arm.coordinates
        K, D = np.zeros((self.n, self.n)), np.zeros((self.n, self.n))
        weightless = self.numbers.p.copy()
        first = gravity_slot(self.arm.joints, 0)
        weightless[first : first + 2] = 0.0  # the weight is an input, of the posture as it is
        K[:n, :n], D[:n, :n] = self.model.compiled.linear_matrices(self.q, weightless)
        for c, (k, a) in enumerate(self.added, n):
            for d, (j, b) in self._columns():
                if j == k:
                    power = a + b - 3
                    bend = a * (a - 1) * b * (b - 1) / power * self._value(k, LENGTH) ** power
                    K[c, d] = K[d, c] = bend * self._value(k, STIFFNESS)
                    D[c, d] = D[d, c] = K[c, d] * self._value(k, DAMPING_TIME)
        return K, D

    @property
    def tip(self) -> np.ndarray:
        """(nx, 2): the tip's place over the state, about the posture."""
        last = self.arm.joints - 1
        C = np.zeros((2 * self.n + self.numbers.law.states, 2))
        C[: self.n] = self.slopes(last, self._value(last, LENGTH)).T
        return C

    def step(self, dt: float) -> np.ndarray:
        """(nx + nr + n, nx): the exact step over dt with held inputs, transposed."""
        law, n, coordinates = self.numbers.law, self.n, self.arm.coordinates
        joints, nx, nr = self.arm.joints, 2 * n + law.states, law.references
        K, D = self._stiffness_and_damping()
        K[:joints, :coordinates] += law.P
        D[:joints, :coordinates] += law.V
        drive = np.zeros((n, law.states + nr))
        drive[:joints] = np.hstack([-law.S, law.R])
        rate = np.zeros((nx + nr + n,) * 2)
        rate[:n, n : 2 * n] = np.eye(n)
        rate[n : 2 * n] = np.linalg.solve(self.M, np.hstack([-K, -D, drive, np.eye(n)]))
        rate[2 * n : nx, :coordinates] = law.Fq
        rate[2 * n : nx, n : n + coordinates] = law.Fv
        rate[2 * n : nx, 2 * n : nx] = law.Fs
        rate[2 * n : nx, nx : nx + nr] = law.Fr
        return np.ascontiguousarray(exponential(rate * dt)[:nx].T)


def _unit(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), np.sin(angle)])


def _turned(a: np.ndarray) -> np.ndarray:
    """By a right angle: how a point at `a` moves when the origin turns."""
    return np.array([-a[1], a[0]])
