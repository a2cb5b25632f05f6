"""MJCF of the arm: each segment a chain of rigid bodies on elastic hinges.

A uniform beam is cut into N equal pieces. Each bends in a hinge at its middle, of stiffness
EI N / l; rigid slender bodies lie between, the first and the last of half the length. Inside, the
errors of stiffness and mass cancel to 1 / N^4; weights at both ends (`WEIGHTS`) do so for the ends.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from flexgui.core.results import Link, Mechanism, Outcome
from flexgui.export.model_format import ModelFormat, header
from flexgui.export.template import xml

CARRIED = frozenset({"arm", "damping", "dry"})
"""What an effect may act on to be in the file; of the drive, see `_drive_is_carried`."""

STABLE = 0.5
"""Share of the longest step, 2 / omega of the fastest vibration, at which MuJoCo's semi-implicit
integrator is stable with springs: none of the chain's fast vibrations is of interest."""
LONGEST_STEP = 1e-3
"""s."""

THICKNESS = 1e-3
"""Share of a slender body's transverse inertia about its axis: nothing turns there, but MuJoCo
refuses a zero."""
SLENDER = 0.02
"""Radius by length of a segment, as it is drawn."""
POINT = 1e-9
"""kg and kg m^2: MuJoCo refuses bodies that move without mass or inertia."""

LIMITS = (
    "Joints motor1, motor2, ...; site tip; sensors theta1, dtheta1, u1, deflection1, ... and z of "
    "the tip. Not in this file: noise and delays of sensors, references, controllers other than a "
    "velocity loop, and foreshortening beyond a chain's.",
    "Dry friction has one level at any speed (frictionloss). MuJoCo makes it a soft constraint: a "
    "joint that should stick creeps a little.",
)


class Mjcf(ModelFormat):
    """For MuJoCo, and for tools that read its files."""

    kind = "mjcf"
    label = "Arm for MuJoCo (.xml)"
    hint = "MJCF: the arm as chains of rigid bodies on elastic hinges."

    def unable(self, outcome: Outcome) -> str:
        if outcome.mechanism is None:
            return "This result has no arm; identify again."
        return ""

    def files(self, outcome: Outcome) -> dict[str, bytes]:
        return {} if outcome.mechanism is None else {"model.xml": mjcf(outcome, outcome.mechanism)}


def mjcf(outcome: Outcome, arm: Mechanism) -> bytes:
    """The MJCF text; its header compares the chain's first frequencies with the model's."""
    chord = [1.0 - (i - 0.5) / HINGES for i in range(1, HINGES + 1)]
    return xml(
        "model.xml", declared=False, arm=arm, header=_header(outcome, arm), step=_step(arm),
        pieces=pieces, motion=_motion, chord=chord,
        thickness=THICKNESS, slender=SLENDER, point=POINT,
    )  # fmt: skip


def _motion(link: Link) -> dict[str, str]:
    """How a motor moves it."""
    if link.joint == "revolute":
        return {"type": "hinge", "axis": "0 0 1"}
    axis = f"{math.cos(link.axis_angle)!r} {math.sin(link.axis_angle)!r} 0"
    return {"type": "slide", "axis": axis}


def _drive_is_carried(arm: Mechanism) -> bool:
    """Whether a velocity actuator with a limit can represent the drives."""
    return all(link.gain is not None for link in arm.links)


def _step(arm: Mechanism) -> float:
    """s: a whole part of LONGEST_STEP at which the chain is stable."""
    fastest = max(chain_frequencies(arm, arm.posture), default=0.0)
    return LONGEST_STEP / max(math.ceil(LONGEST_STEP * math.pi * fastest / STABLE), 1)


def _header(outcome: Outcome, arm: Mechanism) -> Sequence[str]:
    acts = CARRIED | ({"drive"} if _drive_is_carried(arm) else set())
    carried = [e for e in arm.effects if e.acts_on in acts]
    what = f"MJCF of the arm, {HINGES} hinges per bending segment"
    return header(outcome, what, carried, (*LIMITS, *_compared(arm)))


def _compared(arm: Mechanism) -> list[str]:
    """A line with the first frequencies of both, with clamped joints."""
    if not arm.frequencies:
        return []
    chain = chain_frequencies(arm, arm.posture)[: len(arm.frequencies)]
    pairs = [f"{c:.4g} ({m:.4g})" for c, m in zip(chain, arm.frequencies, strict=False)]
    posture = ", ".join(f"{x:.4g}" for x in arm.posture)
    line = f"First frequencies of the chain (of the model) in Hz, joints held at ({posture}): "
    return [
        line + ", ".join(pairs) + ".",
        "They differ where the model bends in fewer shapes than a beam: add bending modes to it.",
    ]


HINGES = 8
"""Per segment that bends: the first three frequencies of an arm are within 0.6 % of the beam's, and
its fastest vibration, which the step must follow, grows with the square of this number."""
WEIGHTS = np.ones(HINGES)
"""Of the hinges' compliances, as Euler and Maclaurin correct the ends of a midpoint sum."""
WEIGHTS[[0, -1]] += 1.0 / 24.0
WEIGHTS[[1, -2]] -= 1.0 / 24.0


@dataclass(frozen=True)
class Piece:
    """A rigid body, and the hinge at its root (the joint's where it is the first)."""

    length: float
    mass: float
    stiffness: float
    """N m/rad of the hinge; 0 for the first piece."""
    centre: tuple[float, float]
    """m from its root, along and across."""
    inertia: float
    """kg m², across it about its centre."""

    @classmethod
    def slender(cls, length: float, mass: float, stiffness: float) -> Piece:
        """Of a uniform beam of that `length` in m and `mass` in kg, with `stiffness` in N m/rad."""
        return cls(length, mass, stiffness, (length / 2.0, 0.0), mass * length**2 / 12.0)


def pieces(link: Link) -> tuple[Piece, ...]:
    """From the root; one where the segment does not bend."""
    if link.centre is not None:
        return (Piece(link.length, link.mass, 0.0, link.centre, link.inertia),)
    if not link.modes:
        return (Piece.slender(link.length, link.mass, 0.0),)
    length = link.length / HINGES
    lengths = (length / 2.0, *([length] * (HINGES - 1)), length / 2.0)
    stiffness = (0.0, *(float(k) for k in link.EI / (length * WEIGHTS)))
    return tuple(
        Piece.slender(x, link.mass * x / link.length, k)
        for x, k in zip(lengths, stiffness, strict=True)
    )


def chain_frequencies(arm: Mechanism, posture: Sequence[float]) -> np.ndarray:
    """(n,) Hz, ascending, of the undamped chain with the motors held and without gravity.

    Args:
        arm: What is cut into pieces.
        posture: (nj,) joint positions in rad (m).
    """
    chain = _Chain(arm, posture)
    if not chain.stiffness:
        return np.zeros(0)
    K = np.diag(chain.stiffness)
    squares = scipy.linalg.eigh(K, chain.mass_matrix(), eigvals_only=True)
    return np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)


class _Chain:
    """Every place is a complex number in the plane; a spring moves all that hangs on it."""

    def __init__(self, arm: Mechanism, posture: Sequence[float]) -> None:
        self.stiffness: list[float] = []
        self._springs: list[tuple[complex, complex]] = []
        """Pivot, and direction of a slide: the spring turns about the one or gives along the
        other."""
        self._turns: list[bool] = []
        self._bodies: list[tuple[complex, float, float, tuple[int, ...]]] = []
        """Centre, mass, inertia, and the springs that move it."""
        base = self._base(arm)
        hanging, root, angle = base, 0j, 0.0
        for link, position in zip(arm.links, posture, strict=True):
            if link.on_ground:
                root, angle, hanging = 0j, 0.0, base
            turns = link.joint == "revolute"
            slide = np.exp(1j * (angle + link.axis_angle))
            angle, root = (angle + position, root) if turns else (angle, root + position * slide)
            self._bodies.append((root, 0.0, link.rotor_inertia, hanging))
            if link.joint_stiffness is not None:
                hanging = (*hanging, self._spring(link.joint_stiffness, root, slide, turns))
            root, hanging = self._link(link, root, np.exp(1j * angle), hanging)

    def _base(self, arm: Mechanism) -> tuple[int, ...]:
        stiffness, found = arm.base_stiffness, tuple[int, ...]()
        if stiffness is not None:
            found = tuple(self._spring(stiffness, 0j, way, False) for way in (1.0, 1j))
        if arm.pedestal is not None:
            spring, inertia = arm.pedestal
            found = (*found, self._spring(spring, 0j, 0j, True))
            self._bodies.append((0j, 0.0, inertia, found))
        return found

    def _spring(self, stiffness: float, pivot: complex, slide: complex, turns: bool) -> int:
        self.stiffness.append(stiffness)
        self._springs.append((pivot, slide))
        self._turns.append(turns)
        return len(self.stiffness) - 1

    def _link(
        self, link: Link, root: complex, along: complex, hanging: tuple[int, ...]
    ) -> tuple[complex, tuple[int, ...]]:
        for piece in pieces(link):
            if piece.stiffness:
                hanging = (*hanging, self._spring(piece.stiffness, root, 0j, True))
            centre = root + along * complex(*piece.centre)
            self._bodies.append((centre, piece.mass, piece.inertia, hanging))
            root = root + along * piece.length
        self._bodies.append((root, link.tip_mass, link.tip_inertia, hanging))
        return root, hanging

    def mass_matrix(self) -> np.ndarray:
        """(springs, springs)"""
        M = np.zeros((len(self.stiffness),) * 2)
        for place, mass, inertia, hanging in self._bodies:
            which = list(hanging)
            velocity = np.array([self._velocity(i, place) for i in which])
            turning = np.array([float(self._turns[i]) for i in which])
            part = mass * np.real(np.outer(velocity.conj(), velocity))
            M[np.ix_(which, which)] += part + inertia * np.outer(turning, turning)
        return M

    def _velocity(self, spring: int, place: complex) -> complex:
        pivot, slide = self._springs[spring]
        return 1j * (place - pivot) if self._turns[spring] else slide
