"""A figure as the text that Plotly reads: arrays go as base64, not as digits."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np

TYPES = {"f": np.dtype("<f4"), "i": np.dtype("<i4")}
"""Kind of number -> how it travels: seven digits are more than a pixel shows."""


def figure_json(value: Any) -> str:
    """JSON of a figure or a part of one; vectors as {dtype, bdata}, NaN (a gap) as null."""
    return _ENCODER.encode(value).decode()


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if not isinstance(value, np.ndarray):
        raise TypeError(f"a figure holds no {type(value).__name__}")
    kind = TYPES.get(value.dtype.kind)
    if kind is None or value.ndim != 1:
        return value.tolist()
    return {"dtype": kind.str[1:], "bdata": value.astype(kind).tobytes()}


_ENCODER = msgspec.json.Encoder(enc_hook=_plain)
