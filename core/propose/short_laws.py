"""Short laws for a smooth function, judged by the inner products of its hats alone."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TypeVar

import numpy as np
import scipy

from ..arm.arm import Arm
from ..effects.effect import Effect
from ..effects.own_formula import own_parameter
from ..effects.own_reading import own_law
from ..estimate.fitted_model import FittedModel
from ..parameters import Parameter
from ..propose.carriers import SmoothFunction, missed_by_law
from ..propose.shapes import SHAPES, Constant, Shape, Size
from ..propose.variables import ends
from ..results import Carrier, LawTerm
from ..sentences import listed
from ..units import quotient

Value = TypeVar("Value")

LINEAR = 1e-3
"""Share of the error that a linear answer to a force cannot tell from none."""

SAME = 0.01
"""Relative difference below which two laws are one."""

SMALL = 1e-3
"""Of the largest size: to begin with where a size is nothing."""

MOST_MOVED = 10.0
"""Factor by which a refit may move a scale."""

PARAMETER_PRICE = 0.05
"""Per parameter, in the logarithm of the share that is left."""

DIGITS = 6
"""Of a place that is no unknown."""

CURVE_POINTS = 200
"""Points of a law's curve."""


@dataclass(frozen=True)
class ShortLaw:
    """A shape in the place of a smooth function."""

    function: SmoothFunction
    shape: Shape
    constants: tuple[float, ...]

    @cached_property
    def range(self) -> tuple[float, float]:
        """Ends of the variable's range."""
        low, high = ends(self.function.variable)
        return float(f"{low:.{DIGITS}g}"), float(f"{high:.{DIGITS}g}")

    def columns(self, x: np.ndarray) -> np.ndarray:
        """(n, sizes) at the values x (n,) of the variable."""
        return self.shape.columns(x, *self.range, self.constants)

    @cached_property
    def share(self) -> float:
        """Share of the error above noise that it explains on parts held out."""
        weights = self.columns(self.function.knots)
        return self.function.matrices.combined(weights).held_out_share

    @property
    def penalised_error(self) -> float:
        """Logarithm of the share left plus the price, down to what a linear answer can tell; with
        the function that stands beside it."""
        beside = self.function.beside
        left = (1.0 - self.share) * (1.0 if beside is None else beside.left)
        return logarithm(left) + self.price

    @property
    def price(self) -> float:
        """Of its parameters, as a logarithm of the share that is left."""
        return PARAMETER_PRICE * (self.shape.parameters + len(self.function.variable.constants))

    @cached_property
    def sizes(self) -> np.ndarray:
        """(sizes,) by least squares along the fitted motion."""
        return self.function.matrices.combined(self.columns(self.function.knots)).fitted()[0]

    def values(self, x: np.ndarray) -> np.ndarray:
        """(n,) of the function at the values x (n,) of the variable."""
        return np.asarray(self.columns(x) @ self.sizes)

    @property
    def names(self) -> tuple[str, ...]:
        """Of sizes, constants of the shape, and those of the variable."""
        return (*self.shape.names, *(c.name for c in self.function.variable.constants))

    def formula(self, names: Sequence[str]) -> str:
        """With these names instead."""
        f, named = self.function, dict(zip(self.names, names, strict=True))
        text = self.shape.formula(f.variable.word.format(**named), *self.range, named)
        sign = "-" if f.factor.brakes else ""
        return f"{sign}({text})*{f.factor.formula}" if f.factor.formula else text

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """In the order of `names`: sizes with wide bounds, constants with those of the range."""
        sizes, f = self._sign * self.sizes, self.function
        typical = float(np.max(np.abs(sizes))) or 1.0
        return (
            *(
                own_parameter(size.name, float(x) or SMALL * typical, _size_unit(f, size))
                for size, x in zip(self.shape.sizes, sizes, strict=True)
            ),
            *(
                own_parameter(c.name, x, _constant_unit(f, c), *self._bounds(c, x))
                for c, x in zip(self.shape.constants, self.constants, strict=True)
            ),
            *(own_parameter(*constant) for constant in f.variable.constants),
        )

    def _bounds(self, constant: Constant, start: float) -> tuple[float, float]:
        ends_of_sign = sorted((start / MOST_MOVED, start * MOST_MOVED))
        return self.range if constant.place else (ends_of_sign[0], ends_of_sign[1])

    @property
    def _sign(self) -> float:
        """Of sizes in the formula: friction and damping act against the motion."""
        return -1.0 if self.function.factor.brakes else 1.0

    def with_values(self, values: Sequence[float]) -> ShortLaw:
        """The law with other values, in the order of `names`."""
        m, n = len(self.shape.sizes), len(self.shape.constants)
        law = replace(self, constants=tuple(float(c) for c in values[m : m + n]))
        vars(law)["sizes"] = self._sign * np.asarray(values[:m], dtype=float)
        return law

    @property
    def title(self) -> str:
        """Such as 'Friction at joint 2 over the position of joint 2, from a place on'."""
        f = self.function
        return (
            f"{f.factor.noun} at {f.target.title} over the {f.variable.title}, {self.shape.title}"
        )


@dataclass(frozen=True)
class Law:
    """One short law, or the sum of two at the same target."""

    terms: tuple[ShortLaw, ...]

    @property
    def target(self) -> str:
        """As of an own formula."""
        return self.terms[0].function.target.name

    @property
    def title(self) -> str:
        """Of both terms."""
        return listed([term.title for term in self.terms])

    @property
    def names(self) -> tuple[str, ...]:
        """Of all parameters; one name may stand in both terms."""
        return tuple(name for term in self.terms for name in term.names)

    def formula(self, names: Sequence[str]) -> str:
        """With these names instead."""
        pairs = zip(self.terms, self._split(names), strict=True)
        return " + ".join(term.formula(own) for term, own in pairs)

    def effect(self, arm: Arm, kind: str, taken: Collection[str]) -> Effect:
        """The law as an own effect, with names of parameters that are not taken yet."""
        names = free_names(self.names, taken)
        started = [p for term in self.terms for p in term.parameters]
        parameters = tuple(
            replace(parameter, name=name, symbol=name, title=name)
            for name, parameter in zip(names, started, strict=True)
        )
        return own_law(arm, self.target, self.formula(names), parameters, kind, self.title)

    def with_values(self, values: Sequence[float]) -> Law:
        """The law with other values, in the order of `names`."""
        pairs = zip(self.terms, self._split(values), strict=True)
        return Law(tuple(term.with_values(own) for term, own in pairs))

    def _split(self, values: Sequence[Value]) -> list[Sequence[Value]]:
        """Those of each term."""
        ends_of = np.cumsum([0, *(len(term.names) for term in self.terms)])
        return [values[a:b] for a, b in pairwise(ends_of)]


def logarithm(left: float) -> float:
    """Of a share of the error that is left, down to what a linear answer can tell."""
    return float(np.log(max(left, LINEAR)))


def free_names(names: Sequence[str], taken: Collection[str]) -> list[str]:
    """The names, numbered where they are taken."""
    free: list[str] = []
    for name in names:
        numbered = (f"{name}{k}" for k in range(2, 1000))
        free.append(next(n for n in (name, *numbered) if n not in taken and n not in free))
    return free


def _size_unit(f: SmoothFunction, size: Size) -> str:
    """Such as N m/rad^2."""
    return quotient(f.target.unit, (f.factor.unit, 1.0), (f.variable.unit, size.power))


def carrier_of(f: SmoothFunction) -> Carrier:
    """A function of one variable as a record."""
    values, deviations = f.matrices.fitted()
    unit = quotient(f.target.unit, (f.factor.unit, 1.0))
    return Carrier(
        target=f.target.name, target_title=f.target.title, variable=f.variable.word,
        title=f.variable.title, unit=f.variable.unit, factor=f.factor.words, share=f.share,
        places=f.knots, values=values, deviations=deviations, value_unit=unit,
    )  # fmt: skip


def law_term(law: ShortLaw, grown: FittedModel, names: Sequence[str]) -> LawTerm:
    """A term of a law, beside what the model that has `grown` by it shows of it; `names` of its
    parameters."""
    f = law.function
    places = np.linspace(*ends(f.variable), CURVE_POINTS)
    missed, deviations = missed_by_law(grown, f, names)
    shown = replace(carrier_of(f), values=law.values(f.knots) + missed, deviations=deviations)
    return LawTerm(shown, places, law.values(places))


def _constant_unit(f: SmoothFunction, constant: Constant) -> str:
    unit = f.variable.unit
    return unit if constant.power > 0.0 or not unit else f"1/{unit}"


def short_laws(function: SmoothFunction, *, roughly: bool = False) -> list[ShortLaw]:
    """One law of each shape at its best constants, best first; `roughly`: at those of its grid."""
    laws = [law for shape in SHAPES for law in _best(function, shape, roughly)]
    return sorted(laws, key=lambda law: law.penalised_error)


def _best(function: SmoothFunction, shape: Shape, roughly: bool) -> Iterator[ShortLaw]:
    """The shape at the constants that explain most; nothing for a shape that makes no sense."""
    variable = function.variable
    if (shape.angles and not variable.whole_turns) or (variable.constants and not shape.varies):
        return
    inner, outer = function.matrices.reduction()

    places = [i for i, c in enumerate(shape.constants) if c.place]

    def left(constants: Sequence[float]) -> float:
        if np.any(np.diff([constants[i] for i in places]) <= 0.0):
            return 0.0  # the first place is the lower one
        W = ShortLaw(function, shape, tuple(constants)).columns(function.knots)
        A, b = W.T @ inner @ W, W.T @ outer
        d = np.sqrt(np.maximum(np.diag(A), 1e-300))
        scaled = A / np.outer(d, d) + 1e-9 * np.eye(len(d))
        solved = np.linalg.solve(scaled, b / d)
        return -float(b / d @ solved)

    grid = shape.grid(*ends(variable))
    best = min(grid, key=left)
    if best and not roughly:
        # What is narrower than the hats are apart they cannot show; the refit does.
        ends_of = zip(np.min(grid, axis=0), np.max(grid, axis=0), strict=True)
        best = _refined(left, best, list(ends_of))
    yield ShortLaw(function, shape, tuple(float(c) for c in best))


def _refined(  # type: ignore[no-untyped-def]
    left, start: Sequence[float], bounds: Sequence[tuple[float, float]]
) -> tuple[float, ...]:
    """The constants moved to where least is left."""
    options = {"maxfev": 120, "xatol": 1e-4, "fatol": 1e-6}
    found = scipy.optimize.minimize(
        left, start, method="Nelder-Mead", bounds=bounds, options=options
    )
    return tuple(found.x) if found.fun < left(start) else tuple(start)


def different_laws(laws: Sequence[ShortLaw], most: int) -> list[ShortLaw]:
    """The first `most` laws, without those that are one that came before in other words."""
    kept: list[ShortLaw] = []
    for law in laws:
        if len(kept) < most and all(_distance(law, other) > SAME for other in kept):
            kept.append(law)
    return kept


def _distance(law: ShortLaw, other: ShortLaw) -> float:
    """Relative rms difference of two laws along the motion; infinite at different targets."""
    if law.function.target.name != other.function.target.name:
        return float("inf")
    a, b = _along(law), _along(other)
    size = float(np.linalg.norm(b))
    return float(np.linalg.norm(a - b)) / size if size else float("inf")


def _along(law: ShortLaw) -> np.ndarray:
    """(samples,) what a law adds along the motions."""
    f = law.function
    values = law.values(np.concatenate(f.variable.along))
    return np.asarray(values * np.concatenate(f.factor.along))
