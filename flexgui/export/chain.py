"""A segment as rigid pieces on hinges, and how such a chain of segments vibrates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from core.results import Link, Mechanism

HINGES = 20
"""Per segment that bends: the first three frequencies of an arm are within 0.3 % of the beam's."""


@dataclass(frozen=True)
class Piece:
    """A rigid slender body, and the hinge at its root (the joint's where it is the first)."""

    length: float
    mass: float
    stiffness: float
    """N m/rad of the hinge; 0 for the first piece."""


def pieces(link: Link) -> tuple[Piece, ...]:
    """From the root; one where the segment does not bend."""
    if not link.modes:
        return (Piece(link.length, link.mass, 0.0),)
    length = link.length / HINGES
    lengths = (length / 2.0, *([length] * (HINGES - 1)), length / 2.0)
    stiffness = link.EI * HINGES / link.length
    return tuple(
        Piece(x, link.mass * x / link.length, stiffness if i else 0.0)
        for i, x in enumerate(lengths)
    )


def chain_frequencies(arm: Mechanism, posture: Sequence[float]) -> np.ndarray:
    """Hz, ascending, of the undamped chain with the motors held and without gravity.

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
        base = self._base(arm.base_stiffness)
        hanging, root, angle = base, 0j, 0.0
        for link, position in zip(arm.links, posture, strict=True):
            if link.on_ground:
                root, angle, hanging = 0j, 0.0, base
            turns = link.joint == "revolute"
            slide = np.exp(1j * (angle + link.axis_angle))
            angle, root = (angle + position, root) if turns else (angle, root + position * slide)
            if link.joint_stiffness is not None:
                hanging = (*hanging, self._spring(link.joint_stiffness, root, slide, turns))
            root, hanging = self._link(link, root, np.exp(1j * angle), hanging)

    def _base(self, stiffness: float | None) -> tuple[int, ...]:
        if stiffness is None:
            return ()
        return tuple(self._spring(stiffness, 0j, direction, False) for direction in (1.0, 1j))

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
            inertia = piece.mass * piece.length**2 / 12.0
            self._bodies.append((root + along * piece.length / 2.0, piece.mass, inertia, hanging))
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
