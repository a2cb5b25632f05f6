"""Matrices along a recorded motion, interpolated between a few node postures.

The discretised matrices of the linear model are smooth functions of the joint positions. Over
the postures of one recording they are a polynomial to high accuracy, so a handful of matrix
exponentials at node postures and one weight per node and sample replace one exponential per
sample. Nodes and weights do not depend on the parameters.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import scipy
from numpy.polynomial import chebyshev

from ..model import Model, Numbers

SAME = 1e-12
"""Relative change of the model's matrices below which a joint's position does not matter."""

CANDIDATES = 2
"""Of the nodes per joint, in candidates for nodes where several joints matter."""


@dataclass(frozen=True)
class Nodes:
    """d node postures, and what each contributes to the matrices at given postures."""

    postures: np.ndarray
    """(d, n) coordinates, straight arm"""
    shares: np.ndarray
    """(T, d), each row sums to one"""


def midpoints(schedule: np.ndarray) -> np.ndarray:
    """(T, n): the posture that counts over each sample of a schedule (T, n)."""
    return np.asarray(0.5 * (schedule + np.vstack([schedule[1:], schedule[-1:]])))


def joints_that_matter(model: Model, numbers: Numbers, points: np.ndarray) -> list[int]:
    """Coordinates that vary along the points (T, n) and change the model's matrices."""
    center = 0.5 * (points.min(axis=0) + points.max(axis=0))

    def matrices(q: np.ndarray) -> list[np.ndarray]:
        return [
            model.compiled.mass_matrix(q, numbers.p),
            *model.compiled.linear_matrices(q, numbers.p),
        ]

    base = matrices(center)
    joints = []
    for i in range(model.arm.joints):
        for bound in (points[:, i].min(), points[:, i].max()):
            q = center.copy()
            q[i] = bound
            pairs = zip(matrices(q), base, strict=True)
            if any(np.abs(a - b).max() > SAME * np.abs(b).max() for a, b in pairs):
                joints.append(i)
                break
    return joints


def interpolation(points: np.ndarray, joints: list[int], degree: int) -> Nodes:
    """Polynomials of total `degree` in those joints over the box of the points (T, n)."""
    low, high = points.min(axis=0), points.max(axis=0)
    center = 0.5 * (low + high)
    if not joints or degree == 0:
        return Nodes(center[None], np.ones((len(points), 1)))
    half = 0.5 * (high - low)[joints]
    powers = [k for k in product(range(degree + 1), repeat=len(joints)) if sum(k) <= degree]
    at = _node_places(powers, degree, len(joints))
    unit = (points[:, joints] - center[joints]) / half
    shares = np.linalg.solve(_basis(at, powers).T, _basis(unit, powers).T).T
    postures = np.tile(center, (len(at), 1))
    postures[:, joints] = center[joints] + half * at
    return Nodes(postures, np.ascontiguousarray(shares))


def _node_places(powers: list[tuple[int, ...]], degree: int, joints: int) -> np.ndarray:
    """(d, joints) in [-1, 1]: Chebyshev points; for several joints as many of a grid of them as
    there are polynomials, chosen by pivoting (Sommariva and Vianello 2009)."""
    if joints == 1:
        return chebyshev.chebpts1(degree + 1)[:, None]
    points = chebyshev.chebpts1(CANDIDATES * (degree + 1))
    grid = np.array(list(product(points, repeat=joints)))
    _, _, order = scipy.linalg.qr(_basis(grid, powers).T, mode="economic", pivoting=True)
    return grid[order[: len(powers)]]


def _basis(unit: np.ndarray, powers: list[tuple[int, ...]]) -> np.ndarray:
    """(T, d) Chebyshev products at places (T, joints) in [-1, 1]."""
    degree = max(map(max, powers))
    polynomials = [chebyshev.chebvander(column, degree) for column in unit.T]
    columns = [
        np.prod([v[:, i] for v, i in zip(polynomials, k, strict=True)], axis=0) for k in powers
    ]
    return np.column_stack(columns)
