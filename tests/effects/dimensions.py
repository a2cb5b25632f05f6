"""Whether a force law is homogeneous in the base units, by Euler's theorem.

F is of dimension e_F in a base unit if, with e_a the exponent of each of its arguments,
sum_a e_a a dF/da = e_F F everywhere. Exponents of parameters come from their units; those of
numbers that are no parameters (a rounding speed, a stiffness of the arm) are unknown and solved
for.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
import sympy as sp
from pint import UnitRegistry

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.joints import joint
from flexgui.core.forces.element import Element

UNITS = UnitRegistry()
BASES = ("[length]", "[mass]", "[time]")
ENERGY = np.array([2.0, 1.0, -2.0])
PER_TIME = np.array([0.0, 0.0, -1.0])

SAMPLES = 60

SMALLEST = -3.0
"""Powers of ten: displacements and speeds from a thousandth to one."""

RESIDUAL = 1e-5
"""Relative: a homogeneous law misses by rounding, one with a corner that is rounded far below
the smallest speed by a millionth, a wrong unit by about one."""


def exponents(unit: str) -> np.ndarray:
    """Of length, mass and time; an angle has none."""
    found = UNITS.parse_units(unit).dimensionality
    return np.array([float(found.get(base, 0.0)) for base in BASES])


def consistent(element: Element, arm: Arm, units: Mapping[float, str]) -> bool:
    """Whether units can be given to the unknown numbers so that the law's forces fit its ports.

    `units` tells the unit of a value; ports that are neither joints nor at the tip may measure
    a length or an angle.
    """
    known = [units.get(value) for value in element.values]
    return any(_fits(element, ports, known) for ports in _possible_ports(element, arm))


def _possible_ports(element: Element, arm: Arm) -> list[tuple[np.ndarray, ...]]:
    """The dimensions that the displacements of the ports may have."""
    metre, angle = exponents("m"), exponents("rad")
    choices: list[tuple[np.ndarray, ...]] = [(metre,), (metre,)] if element.at_tip else []
    for row in element.directions:
        turned = np.flatnonzero(row)
        if len(turned) == 1 and turned[0] < arm.joints and row[turned[0]] == 1.0:
            choices.append((exponents(joint(arm.segments[turned[0]].joint).coordinate_unit),))
        else:
            choices.append((metre, angle))
    return list(itertools.product(*choices))


def _fits(element: Element, ports: Sequence[np.ndarray], known: Sequence[str | None]) -> bool:
    law = element.law
    speeds = [x + PER_TIME for x in ports]
    dims = {**dict(zip(law.x, ports, strict=True)), **dict(zip(law.v, speeds, strict=True))}
    for symbol, unit in zip(law.parameters, known, strict=True):
        if unit is not None:
            dims[symbol] = exponents(unit)
    free = [s for s in (*law.parameters, *law.states) if s not in dims]
    outputs = [(f, ENERGY - x, None) for f, x in zip(law.forces, ports, strict=True)]
    outputs += [(r, PER_TIME, w) for r, w in zip(law.rates, law.states, strict=True)]
    return _homogeneous(element, dims, free, outputs)


def _homogeneous(element, dims, free, outputs) -> bool:  # type: ignore[no-untyped-def]
    """Least squares over random points for the free exponents; fits where nothing remains.

    The dimension of an output is stated, or stated relative to a free symbol's.
    """
    rows, targets = [], []
    for expression, dimension, relative_to in outputs:
        terms, values = _terms(element, expression, [*dims, *free])
        scale = np.abs(values) + np.abs(terms).sum(axis=1) + 1e-300
        known = terms[:, : len(dims)] @ np.array(list(dims.values())).reshape(len(dims), 3)
        left = terms[:, len(dims) :].copy()
        if relative_to is not None:
            left[:, free.index(relative_to)] -= values
        rows.append(left / scale[:, None])
        targets.append((np.outer(values, dimension) - known) / scale[:, None])
    A, b = np.vstack(rows), np.vstack(targets)
    solution = np.linalg.lstsq(A, b, rcond=None)[0] if free else np.zeros((0, 3))
    return bool(np.abs(A @ solution - b).max() < RESIDUAL)


def _terms(  # type: ignore[no-untyped-def]
    element: Element, expression: sp.Expr, symbols
) -> tuple[np.ndarray, np.ndarray]:
    """a dF/da (S, A) for every symbol a, and F (S,), at random points of all magnitudes."""
    law = element.law
    rng = np.random.default_rng(1)
    # What is zero until a simulation writes it would make every law balance.
    stated = {s: x or 1.0 for s, x in zip(law.parameters, element.values, strict=True)}
    points = [
        np.full(SAMPLES, stated[s])
        * (10.0 ** rng.uniform(-0.5, 0.5, SAMPLES) if s in stated else 1.0)
        if s in stated
        else rng.choice([-1.0, 1.0], SAMPLES) * 10.0 ** rng.uniform(SMALLEST, 0.0, SAMPLES)
        for s in symbols
    ]
    functions = [expression, *[s * sp.diff(expression, s) for s in symbols]]
    evaluate = sp.lambdify(list(symbols), functions, modules="numpy")
    found = [np.broadcast_to(np.asarray(f, dtype=float), SAMPLES) for f in evaluate(*points)]
    return np.array(found[1:]).T, found[0]
