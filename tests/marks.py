"""Which cases of a parametrized test everybody waits for."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def long_except(quick: Collection[Any], values: Iterable[Any]) -> list[Any]:
    """The values for `parametrize`; all that are not among the quick ones go to `make long`."""
    return [v if v in quick else pytest.param(v, marks=pytest.mark.long) for v in values]


def long_rows(rows: Iterable[tuple[Any, ...]]) -> list[Any]:
    """Rows of several values for `parametrize`, all of which go to `make long`."""
    return [pytest.param(*row, marks=pytest.mark.long) for row in rows]
