"""Signals of a recording that a force may depend on, beside the state of the arm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..errors import InputError
from ..recording.channels import FURTHER

TIME = "t"
"""Name of the time since a recording began, in s."""

INPUTS = (TIME, *FURTHER.names)
"""All that a force may depend on."""


def input_signals(
    names: Sequence[str], time: np.ndarray, columns: Mapping[str, np.ndarray], recording: str
) -> np.ndarray | None:
    """Signals (N, inputs) at `time` (N,); None if no names are given.

    Empty samples of a slower sensor are filled along straight lines, at the ends with the nearest
    one.

    Args:
        names: Some of INPUTS.
        time: (N,) s.
        columns: Name -> (N,), in SI units.
        recording: Its name, for messages.

    Raises:
        InputError: If a column is missing or empty.
    """
    if not names:
        return None
    return np.column_stack([_signal(name, time, columns, recording) for name in names])


def _signal(
    name: str, time: np.ndarray, columns: Mapping[str, np.ndarray], recording: str
) -> np.ndarray:
    if name == TIME:
        return time - time[0]
    column = columns.get(name)
    sampled = np.zeros(0, dtype=bool) if column is None else np.isfinite(column)
    if column is None or not sampled.any():
        raise InputError(
            f"Recording {recording} has no column {name}, on which a force of the model depends; "
            f"map one to it with columns = {{ {name} = ... }}, or leave that force out."
        )
    return np.asarray(np.interp(time, time[sampled], column[sampled]))
