"""Arrays as files hold them, cut into one column per channel."""

from __future__ import annotations

import numpy as np

WIDEST = 64
"""Columns of one array that are channels; a wider one is a picture."""


def as_vectors(
    name: str,
    values: np.ndarray,
    columns: dict[str, np.ndarray],
    unusable: dict[str, str],
    unit: str = "",
) -> None:
    """Adds the columns of an array, and what is wrong where it has none.

    An array theta (N, 2), or (2, N), gives theta1 and theta2; a structured one its fields.

    Args:
        name: Path in the file.
        values: Any array.
        columns: Header -> (N,); added to.
        unusable: Header -> what is wrong; added to.
        unit: Of the values; empty where the file says none.
    """
    header = f"{name} [{unit}]" if unit else name
    if values.dtype.names:
        for part in values.dtype.names:
            as_vectors(f"{name}/{part}", values[part], columns, unusable)
        return
    if values.dtype.kind not in "iuf":
        unusable[header] = "is no array of real numbers"
        return
    values = np.squeeze(values)
    if values.ndim == 0:
        unusable[header] = "is one number and no vector"
    elif values.ndim == 1:
        columns[header] = values.astype(float) if values.dtype.kind == "f" else values
    elif values.ndim == 2 and min(values.shape) <= WIDEST:
        rows = values if values.shape[0] >= values.shape[1] else values.T
        for k in range(rows.shape[1]):
            end = f"{name}{k + 1}"
            columns[f"{end} [{unit}]" if unit else end] = rows[:, k].astype(float)
    else:
        unusable[header] = f"is no vector but has {values.ndim} dimensions"
