"""Lines from each reference to each output: one colour per output, one dash per reference."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from core.simulate.response import Port
from core.written import ShownUnit
from flexgui.views import colours
from flexgui.views.names import channel_symbol

DASHES = ("solid", "dash", "dot")
NEGLIGIBLE = 1e-9
"""Of the largest value: a coupling below is none and gets no line."""


def reference_symbol(port: Port) -> str:
    """'dtheta1_ref' -> 'θ̇₁*'."""
    return channel_symbol(port.name.removesuffix("_ref"), port.unit) + (
        "*" if port.name.endswith("_ref") else ""
    )


def pair_lines(
    x: np.ndarray,
    values: np.ndarray,
    outputs: Sequence[Port],
    references: Sequence[Port],
    hover: str,
) -> list[dict[str, Any]]:
    """Traces of values (N, ny, nr) over x (N,)."""
    size = float(np.abs(values).max(initial=0.0))
    return [
        {
            "type": "scatter",
            "x": x,
            "y": np.ascontiguousarray(values[:, i, j], dtype=np.float32),
            "mode": "lines",
            "name": f"{reference_symbol(reference)} → {channel_symbol(output.name, output.unit)}",
            "line": {
                "color": colours.joint(i)["color"],
                "width": 1.8,
                "dash": DASHES[j % len(DASHES)],
            },
            "hovertemplate": hover,
        }
        for i, output, j, reference in _pairs(outputs, references)
        if float(np.abs(values[:, i, j]).max(initial=0.0)) > NEGLIGIBLE * size
    ]


def _pairs(
    outputs: Sequence[Port], references: Sequence[Port]
) -> Iterator[tuple[int, Port, int, Port]]:
    for i, output in enumerate(outputs):
        for j, reference in enumerate(references):
            yield i, output, j, reference


def per_reference(unit: ShownUnit, references: Sequence[Port]) -> str:
    """'rad/s per rad/s' where all references share a unit, else only the output's."""
    units = {port.unit for port in references}
    return f"{unit.name} per {units.pop()}" if len(units) == 1 else unit.name
