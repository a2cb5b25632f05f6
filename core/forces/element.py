"""Force laws put on an arm: directions, numbers, and the arrays that the integrator takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..forces.law import ForceLaw


@dataclass(frozen=True)
class Element:
    """A law with its ports on an arm and its numbers.

    `directions` holds one array (n,) per port, constant in q; where `at_tip` the first two
    ports are the components of the tip's place instead, and `directions` holds the rest.
    """

    law: ForceLaw
    directions: tuple[np.ndarray, ...]
    values: tuple[float, ...]
    at_tip: bool = False
    loads: tuple[int, ...] = ()
    """Numbers of the drives (from 0) whose torques the law takes as its last parameters; they are
    written while simulating."""
    inputs: tuple[str, ...] = ()
    """The same for signals of a recording by name, which come after the drives' torques."""

    @property
    def written(self) -> int:
        """How many of the last parameters are written while simulating."""
        return len(self.loads) + len(self.inputs)

    def rows(self, n: int) -> np.ndarray:
        """(k, n); those of the tip are filled in while simulating."""
        first = [np.zeros(n), np.zeros(n)] if self.at_tip else []
        return np.array([*first, *self.directions]).reshape(len(self.law.x), n)


@dataclass(frozen=True)
class ElementArrays:
    """The elements of a model as compiled code takes them.

    Laws (E), first port, first state and first parameter (E + 1,) each, directions (K n,),
    parameters, the first of each pair of ports at the tip, the numbers of the elements that are
    bristles, which come last, and (L, 2) of what is written while simulating: the place in
    [drives' torques, inputs] and that in the parameters.
    """

    laws: tuple[ForceLaw, ...]
    ports: np.ndarray
    states: np.ndarray
    parameters: np.ndarray
    directions: np.ndarray
    values: np.ndarray
    tips: np.ndarray
    bristles: np.ndarray
    loads: np.ndarray

    def packed(self) -> tuple[np.ndarray, ...]:
        """The arrays in the order in which compiled code for one arm takes them."""
        from ..forces.compiled import compile_law

        addresses = np.array([compile_law(law).address for law in self.laws], dtype=np.int64)
        return (
            addresses, self.ports, self.states, self.parameters, self.directions,
            self.values, self.tips, self.bristles, self.loads,
        )  # fmt: skip


def _starts(counts: Sequence[int]) -> np.ndarray:
    return np.array([0, *accumulate(counts)], dtype=np.int64)


def pack(
    elements: Sequence[Element], n: int, names: Sequence[str] = (), joints: int = 0
) -> ElementArrays:
    """The arrays of some elements on an arm with n coordinates; `names` of all inputs, which come
    after the torques of so many `joints`."""
    elements = sorted(elements, key=lambda element: element.law.bristle)
    laws = [e.law for e in elements]
    ports = _starts([len(law.x) for law in laws])
    rows = [e.rows(n) for e in elements]
    parameters = _starts([len(law.parameters) for law in laws])
    loads = [
        (source, parameters[i + 1] - e.written + k)
        for i, e in enumerate(elements)
        for k, source in enumerate((*e.loads, *(joints + names.index(x) for x in e.inputs)))
    ]
    return ElementArrays(
        laws=tuple(laws),
        ports=ports,
        states=_starts([len(law.states) for law in laws]),
        parameters=parameters,
        directions=np.ascontiguousarray(np.concatenate(rows, axis=None) if rows else np.zeros(0)),
        values=np.array([value for e in elements for value in e.values], dtype=float),
        tips=np.array([ports[i] for i, e in enumerate(elements) if e.at_tip], dtype=np.int64),
        bristles=np.array([i for i, law in enumerate(laws) if law.bristle], dtype=np.int64),
        loads=np.array(loads, dtype=np.int64).reshape(-1, 2),
    )


def linear_matrices(elements: Sequence[Element], q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """K and D (n, n) that the elements add at rest in q: minus the slopes of their forces.

    By central differences of the compiled laws, which are smooth where a linear model is asked
    for. Ports at the tip add nothing: their forces are of second order there.
    """
    from ..forces.compiled import compile_law

    n = len(q)
    K, D = np.zeros((n, n)), np.zeros((n, n))
    for e in elements:
        if e.at_tip:
            continue
        rows = e.rows(n)
        compiled, k = compile_law(e.law), len(e.law.x)
        x, v, w = rows @ q, np.zeros(k), np.zeros(len(e.law.states))
        values = np.array(e.values, dtype=float)
        for j in range(k):
            step = FORCE_STEP * np.eye(k)[j]
            slope_x = _slope(lambda s: compiled(x + s, v, w, values)[:k], step)  # noqa: B023
            slope_v = _slope(lambda s: compiled(x, v + s, w, values)[:k], step)  # noqa: B023
            K -= rows.T @ np.outer(slope_x, rows[j])
            D -= rows.T @ np.outer(slope_v, rows[j])
    return K, D


FORCE_STEP = 1e-6
"""rad, m or their rates: forces of a linear model are linear far beyond it."""


def _slope(force, step: np.ndarray) -> np.ndarray:  # type: ignore[no-untyped-def]
    return np.asarray((force(step) - force(-step)) / (2.0 * FORCE_STEP))
