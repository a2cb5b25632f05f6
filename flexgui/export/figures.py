"""The figures of a page: one packed block, which the page's script unpacks and draws."""

from __future__ import annotations

import base64
import gzip
from functools import cache
from typing import Any

import msgspec
import numpy as np
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from flexgui.export.plotly_js import with_traces
from flexgui.views.layout import Figure, plain_value

LINE_LEVELS, NO_VALUE = 65_534, 65_535
"""Between the least and the greatest value of a line, a hundred to a pixel; and no value at all."""
LOGARITHMIC = 100.0
"""Positive values with a larger ratio may stand on a logarithmic axis: they remain float32."""
EVEN = 0.05
"""Of a step: so far from a common grid an even time may be, by its rounding."""
OURS = frozenset({"bar", "heatmap"})
"""Kinds of traces in our own reports, besides scatter, which plotly.js always holds."""


class Figures:
    """Those that a template has placed so far."""

    def __init__(self) -> None:
        self._figures: list[Figure] = []

    def add(self, figure: Figure) -> int:
        """The number by which the script finds the figure."""
        self._figures.append(figure)
        return len(self._figures) - 1

    def packed(self) -> Markup:
        """Length of the JSON, the JSON, and the vectors that it points to."""
        vectors = bytearray()

        def stored(value: Any) -> Any:
            if not isinstance(value, np.ndarray) or value.dtype.kind != "f":
                return plain_value(value)
            return list(value) if value.ndim > 1 else _stored(value, vectors)

        text = msgspec.json.encode(self._figures, enc_hook=stored)
        return packed(len(text).to_bytes(4, "little") + text + vectors)

    def plotly(self) -> Markup:
        """plotly.js that draws them."""
        drawn = {trace.get("type", "scatter") for f in self._figures for trace in f["data"]}
        return packed_plotly(OURS | drawn - {"scatter"})


def packed(content: bytes) -> Markup:
    """gzip in base64, safe inside a script element; the same content gives the same text."""
    return Markup(base64.b64encode(gzip.compress(content, mtime=0)).decode("ascii"))


@cache
def packed_plotly(kinds: frozenset[str]) -> Markup:
    """plotly.js with these kinds of traces."""
    return packed(with_traces(get_plotlyjs(), kinds).encode())


def _stored(values: np.ndarray, vectors: bytearray) -> dict[str, float]:
    """Where a vector (N,) begins in `vectors`, to which it is added, and how to read it there."""
    where: dict[str, float] = {"vector": len(vectors), "count": values.size}
    finite = np.isfinite(values)
    known = values[finite].astype(float)
    steps = _steps(known) if known.size else 0
    if not steps:
        vectors += values.astype("<f4").tobytes()
        return where
    low, step = float(known.min()), float(np.ptp(known)) / steps or 1.0
    codes = np.full(values.shape, NO_VALUE, dtype=np.uint16)
    codes[finite] = np.round((known - low) / step)
    # Differences, all high bytes before all low ones: packed they are a fifth shorter.
    changes = np.diff(codes, prepend=np.uint16(0))
    vectors += (changes >> 8).astype(np.uint8).tobytes() + changes.astype(np.uint8).tobytes()
    return where | {"low": low, "step": step}


def _steps(known: np.ndarray) -> int:
    """Steps from the least to the greatest value: those of a common grid, as times have, if it is
    not too fine; 0 for values of many decades."""
    span, gaps = float(np.ptp(known)), np.diff(known)
    if gaps.size and gaps.min() > 0.0 and (whole := round(span / gaps.min())) <= LINE_LEVELS:
        places = (known - known[0]) * (whole / span)
        if np.abs(places - np.round(places)).max() < EVEN:
            return whole
    return 0 if 0.0 < LOGARITHMIC * known.min() < known.max() else LINE_LEVELS
