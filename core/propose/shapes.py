"""Short functions of one variable: how each is written, and where its constants are looked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import sympy as sp

from ..effects.formula import parse_formula
from ..effects.formula_functions import with_expanded_tables

X, LOW, HIGH = "theta1", "low", "high"
"""Stand for the variable and the ends of its range while a shape is evaluated."""

Grid = Callable[[float, float], Sequence[tuple[float, ...]]]
"""Constants to begin with, from the ends of the variable's range."""


class Size(NamedTuple):
    """What a shape is linear in."""

    name: str
    power: float = 0.0
    """Of the variable that it multiplies."""


class Constant(NamedTuple):
    """What a shape is not linear in."""

    name: str
    power: float = 1.0
    """Of the variable in its unit."""
    place: bool = False
    """Whether it is a value of the variable, within its range; else only its sign is known."""


@dataclass(frozen=True)
class Shape:
    """A function that is linear in its sizes; its constants (places, widths, scales) are not."""

    title: str
    text: str
    """With {x} for the variable, {low} and {high} for the ends of its range, and the names of
    `sizes` and `constants` in braces."""
    sizes: tuple[Size, ...]
    constants: tuple[Constant, ...] = ()
    grid: Grid = lambda _low, _high: ((),)
    angles: bool = False
    """Whether it makes sense of angles alone."""

    @property
    def names(self) -> tuple[str, ...]:
        """Of sizes, then constants."""
        return (*(size.name for size in self.sizes), *(c.name for c in self.constants))

    @property
    def varies(self) -> bool:
        """Whether it depends on the variable at all."""
        return "{x}" in self.text

    @property
    def parameters(self) -> int:
        """Number of sizes and constants."""
        return len(self.sizes) + len(self.constants)

    def formula(self, x: str, low: float, high: float, names: Mapping[str, str]) -> str:
        """The function of x, between `low` and `high` in its unit, with the names that its sizes
        and constants get."""
        return self.text.format(x=x, low=f"{low:.6g}", high=f"{high:.6g}", **names)

    def columns(
        self, x: np.ndarray, low: float, high: float, constants: Sequence[float]
    ) -> np.ndarray:
        """(n, sizes): what each size multiplies, at values x (n,) between `low` and `high`,
        all in the unit of the variable."""
        with np.errstate(all="ignore"):
            each = [np.broadcast_to(f(x, low, high, *constants), x.shape) for f in _slopes(self)]
        return np.nan_to_num(np.column_stack(each), nan=0.0, posinf=0.0, neginf=0.0)


@dataclass(frozen=True)
class TableShape(Shape):
    """Values at equal distances; its ends must be numbers, so it is read between 0 and 1."""

    def columns(
        self, x: np.ndarray, low: float, high: float, constants: Sequence[float]
    ) -> np.ndarray:
        return super().columns((x - low) / (high - low), 0.0, 1.0, constants)


@lru_cache(maxsize=64)
def _slopes(shape: Shape) -> tuple[Callable[..., np.ndarray], ...]:
    """Per size the derivative by it, as a function of x, low, high and the constants."""
    names = shape.names
    ends = ("0", "1") if isinstance(shape, TableShape) else (LOW, HIGH)
    text = shape.text.format(x=X, low=ends[0], high=ends[1], **{name: name for name in names})
    symbols = {word: sp.Symbol(word, real=True) for word in (X, LOW, HIGH, *names)}
    expression = with_expanded_tables(parse_formula(text, symbols, shape.title), shape.title)
    known = [symbols[word] for word in (X, LOW, HIGH, *(c.name for c in shape.constants))]
    slopes = (sp.diff(expression, symbols[size.name]) for size in shape.sizes)
    return tuple(sp.lambdify(known, slope, modules="numpy", cse=True) for slope in slopes)


def _places(count: int) -> Grid:
    """One place within the range."""
    return lambda low, high: [(c,) for c in np.linspace(low, high, count + 2)[1:-1]]


def _step(low: float, high: float) -> list[tuple[float, ...]]:
    """A place and the width over which it is passed."""
    span = high - low
    return [(c, w * span) for (c,) in _places(24)(low, high) for w in (1.0 / 24.0, 0.1, 0.3)]


def _two_places(low: float, high: float) -> list[tuple[float, ...]]:
    places = [c for (c,) in _places(16)(low, high)]
    return [(a, b) for i, a in enumerate(places) for b in places[i + 1 :]]


def _scales(low: float, high: float) -> list[tuple[float, ...]]:
    return [((high - low) * s,) for s in (0.06, 0.12, 0.25, 0.5, 1.0, 2.0)]


def _small_scales(low: float, high: float) -> list[tuple[float, ...]]:
    """From where dry friction is sharp to where a root is straight."""
    return [((high - low) * s,) for s in (0.001, 0.003, 0.01, 0.03, 0.1)]


def _harmonics(low: float, high: float) -> list[tuple[float, ...]]:
    """Waves per turn, from half a wave over the range to ten."""
    least, most = np.pi / (high - low), 20.0 * np.pi / (high - low)
    return [(n,) for n in np.geomspace(least, most, 80)]


def _sum(*terms: str) -> str:
    return " + ".join(terms)


_WAVES = ("{a}*sin({n}*{x}) + {b}*cos({n}*{x})", "{e}*sin(2*{n}*{x}) + {f}*cos(2*{n}*{x})",
          "{g}*sin(3*{n}*{x}) + {h}*cos(3*{n}*{x})")  # fmt: skip
_FLAT = tuple(Size(name) for name in "abefgh")
_A, _B = _FLAT[:2]
_C, _D = Constant("c", place=True), Constant("d", place=True)
_W, _S, _N = Constant("w"), Constant("s"), Constant("n", -1.0)


def _table(knots: int) -> Shape:
    names = [f"a{i + 1}" for i in range(knots)]
    values = ", ".join(f"{{{name}}}" for name in names)
    return TableShape(
        f"table of {knots} values", f"spline({{x}}, {{low}}, {{high}}, {values})",
        tuple(Size(name) for name in names),
    )  # fmt: skip


SHAPES = (
    Shape("constant", "{a}", (_A,)),
    Shape("proportional", "{a}*{x}", (Size("a", 1),)),
    Shape("straight line", "{a} + {b}*{x}", (_A, Size("b", 1))),
    Shape("square", "{a}*{x}**2", (Size("a", 2),)),
    Shape("square with its sign", "{a}*{x}*abs({x})", (Size("a", 2),)),
    Shape("power of three halves with its sign", "{a}*{x}*(abs({x}) + {s})**0.5",
          (Size("a", 1.5),), (_S,), _small_scales),
    Shape("square root with its sign", "{a}*{x}/(abs({x}) + {s})**0.5", (Size("a", 0.5),), (_S,),
          _small_scales),
    Shape("rise and fall", "{a}*{x}/{s}*exp(1 - abs({x})/{s})", (_A,), (_S,), _scales),
    Shape("proportional and square", "{a}*{x} + {b}*{x}*abs({x})", (Size("a", 1), Size("b", 2))),
    Shape("cube", "{a}*{x}**3", (Size("a", 3),)),
    Shape("parabola", "{a} + {b}*{x} + {e}*{x}**2", (_A, Size("b", 1), Size("e", 2))),
    Shape("cubic", "{a} + {b}*{x} + {e}*{x}**2 + {f}*{x}**3",
          (_A, Size("b", 1), Size("e", 2), Size("f", 3))),
    Shape("absolute value", "{a}*abs({x})", (Size("a", 1),)),
    Shape("beyond a place", "{a}*max({x} - {c}, 0)", (Size("a", 1),), (_C,), _places(24)),
    Shape("before a place", "{a}*max({c} - {x}, 0)", (Size("a", 1),), (_C,), _places(24)),
    Shape("from a place on", "{a}*(1 + tanh(({x} - {c})/{w}))/2", (_A,), (_C, _W),
          _step),
    Shape("up to a place", "{a}*(1 - tanh(({x} - {c})/{w}))/2", (_A,), (_C, _W),
          _step),
    Shape("step", "{a} + {b}*tanh(({x} - {c})/{w})", (_A, _B), (_C, _W), _step),
    Shape("around a place", "{a}*exp(-(({x} - {c})/{w})**2)", (_A,), (_C, _W),
          _step),
    Shape("between two places", "{a}*(tanh(({x} - {c})/({d} - {c})*40) - "
          "tanh(({x} - {d})/({d} - {c})*40))/2", (_A,), (_C, _D), _two_places),
    Shape("outside a dead zone", "{a}*(max({x} - {d}, 0) - max({c} - {x}, 0))", (Size("a", 1),),
          (_C, _D), _two_places),
    Shape("exponential rise", "{a}*exp(({x} - {high})/{s})", (_A,), (_S,), _scales),
    Shape("exponential fall", "{a}*exp(({low} - {x})/{s})", (_A,), (_S,), _scales),
    Shape("constant and exponential", "{a} + {b}*exp(({low} - {x})/{s})", (_A, _B),
          (_S,), _scales),
    Shape("saturation", "{a}*tanh({x}/{s})", (_A,), (_S,), _scales),
    Shape("approach", "{a}*(1 - exp(({low} - {x})/{s}))", (_A,), (_S,), _scales),
    Shape("wave", _WAVES[0], _FLAT[:2], (_N,), _harmonics, True),
    Shape("two waves", _sum(*_WAVES[:2]), _FLAT[:4], (_N,), _harmonics, True),
    Shape("three waves", _sum(*_WAVES), _FLAT, (_N,), _harmonics, True),
    _table(5), _table(9),
)  # fmt: skip
"""What a law may look like, the simplest of each kind first."""
