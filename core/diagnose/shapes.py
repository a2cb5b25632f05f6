"""Which shape an effect has at each joint: what enters neither linearly nor as a size."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.diagnose.columns import Column
from core.diagnose.gram import Explained, explain

Shape = tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Shaped:
    """The columns of one effect that explain the most together."""

    chosen: list[int]
    """One per parameter, each in the shape of its joint."""
    explained: Explained
    tried: float
    """How many sizes and shapes were tried for each of them."""


def place(name: str) -> str:
    """The number of the joint or segment at the end of a parameter's name, '' where it has none."""
    found = re.search(r"\d+$", name)
    return found[0] if found else ""


def own_shape(column: Column) -> dict[str, float]:
    """What shapes the column's own size: the effect at another joint may have another shape."""
    at = place(column.parameter)
    return {name: value for name, value in column.shape if place(name) in (at, "") or not at}


def best_shape(mine: Sequence[int], columns: Sequence[Column], w: np.ndarray) -> Shaped:
    """The shape that explains most at all joints alike, then joint by joint another one.

    `w` is the projected Gram matrix of all columns, `mine` those of the effect.
    """
    shapes = list(dict.fromkeys(columns[i].shape for i in mine))
    places = list(dict.fromkeys(place(columns[i].parameter) for i in mine))

    def taken(shape_at: Mapping[str, Shape]) -> tuple[list[int], Explained]:
        fitting = [i for i in mine if columns[i].shape == shape_at[place(columns[i].parameter)]]
        chosen = _best_per_parameter(fitting, columns, w)
        return chosen, explain(w, chosen, [columns[i].one_sided for i in chosen])

    best, at = None, {}
    for shape in shapes:
        found = taken(dict.fromkeys(places, shape))
        if best is None or found[1].drop > best[1].drop:
            best, at = found, dict.fromkeys(places, shape)
    assert best is not None
    for one in places if len(places) > 1 else ():
        for shape in shapes:
            found = taken({**at, one: shape})
            if found[1].drop > best[1].drop:
                best, at = found, {**at, one: shape}
    sizes = len(mine) / max(len(best[0]) * len(shapes), 1)
    return Shaped(*best, tried=sizes * float(len(shapes)) ** len(places))


def _best_per_parameter(mine: Sequence[int], columns: Sequence[Column], w: np.ndarray) -> list[int]:
    """The best size of each parameter on its own."""
    best: dict[str, tuple[float, int]] = {}
    for i in mine:
        drop = explain(w, [i], [columns[i].one_sided]).drop
        if columns[i].parameter not in best or drop > best[columns[i].parameter][0]:
            best[columns[i].parameter] = (drop, i)
    return [i for _, i in best.values()]
