"""What steps per sample still leave of a minimum that is stated."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from core.diagnose.minimum import _left_by, _moved, _richardson

SAMPLES = 200
ESTIMATED = 0.05
"""Relative: what is estimated from three numbers of steps knows the leading term alone."""


def fitted() -> Any:
    """A fit of two parameters whose errors are noise of size one."""
    rng = np.random.default_rng(3)
    return SimpleNamespace(
        hypothesis=SimpleNamespace(vector=np.zeros(2)),
        descended=SimpleNamespace(slopes=(rng.standard_normal((SAMPLES, 1, 2)),)),
        errors=(rng.standard_normal((SAMPLES, 1)),),
        cost=float(SAMPLES),
    )


def runs_of(refit: Any, missed: Any) -> list[list[np.ndarray]]:
    """Errors with steps of 1, 1/2 and 1/4, which move the parameters by `missed` of the step."""
    (S,) = refit.descended.slopes
    along = S @ np.array([1.0, -0.5])
    return [[along * missed(step)] for step in (1.0, 0.5, 0.25)]


@pytest.mark.parametrize(
    "missed",
    [lambda h: 0.3 * h**2 + 0.05 * h**4, lambda h: 0.02 * h**2 + 0.002 * h**4],
    ids=["coarse", "fine"],
)
def test_a_smooth_motion_leaves_a_fifteenth_of_the_last_change(missed: Any) -> None:
    refit = cast(Any, fitted())
    runs = runs_of(refit, missed)
    coarse, better = _richardson(*runs[:2]), _richardson(*runs[1:])
    # Without steps nothing is missed: what is extrapolated is all that is left.
    assert _left_by(runs, coarse, better, refit) == pytest.approx(
        _moved(better, refit), rel=ESTIMATED
    )


def test_edges_leave_all_of_the_last_change() -> None:
    refit = cast(Any, fitted())
    runs = runs_of(refit, lambda h: 0.3 * h)
    coarse, better = _richardson(*runs[:2]), _richardson(*runs[1:])
    assert _left_by(runs, coarse, better, refit) == pytest.approx(
        _moved(better, refit), rel=ESTIMATED
    )
