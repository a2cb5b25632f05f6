"""How viser casts what is set is the same with its type hints made once."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from viser import _assignable_props_api as api

from flexgui.server.guarded import keep_hints

HINTS = (
    npt.NDArray[np.float16], npt.NDArray[np.float32], npt.NDArray[np.float64],
    npt.NDArray[np.uint8], npt.NDArray[np.uint32], float, tuple[npt.NDArray[np.float64], ...],
    tuple[float, float, float],
)  # fmt: skip


@pytest.mark.parametrize("hint", HINTS, ids=str)
@pytest.mark.parametrize("name", ["vertices", "color"])
def test_a_value_is_cast_as_before(hint: Any, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(api, "npt", npt)
    numbers = np.array([0.25, 0.5, 1.0])
    value: Any = (numbers, numbers.astype(np.float32)) if "tuple[numpy" in str(hint) else numbers
    before = cast(hint, value, name)
    keep_hints()
    after = cast(hint, value, name)
    for a, b in zip(parts(before), parts(after), strict=True):
        assert a.dtype == b.dtype and np.array_equal(a, b)


def cast(hint: Any, value: Any, name: str) -> Any:
    """As a handle does it, which has no part in it but to call itself."""
    handle = api.AssignablePropsBase.__new__(Handle)
    return handle._cast_value_recursive(hint, value, name)


class Handle(api.AssignablePropsBase[Any]):
    def _queue_update(self, name: str, value: Any) -> None:
        raise NotImplementedError


def parts(value: Any) -> tuple[np.ndarray, ...]:
    return value if isinstance(value, tuple) else (value,)
