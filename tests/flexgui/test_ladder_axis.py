"""The error ladder's axes and rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexgui.views.ladder import ladder
from tests.flexgui.test_diagnosis_report import FOUND, step


def ticks(error: float) -> list[str]:
    """Of a ladder that begins at so many floors."""
    figure = ladder([replace(FOUND.steps[0], cost_per_sample=error**2, errors=())])
    assert figure is not None
    return list(figure["layout"]["xaxis"]["ticktext"])


def test_the_axis_names_numbers_that_are_read_at_a_glance() -> None:
    assert ticks(16.0) == ["1", "2", "5", "10", "20", "50"]


def test_a_high_ladder_names_decades_only() -> None:
    assert ticks(2000.0) == ["1", "10", "100", "1000", "10000"]


@pytest.mark.parametrize("error", [0.5, 1.0, 9.99, 10.0, 299.0, 1e5])
def test_the_floor_is_always_named(error: float) -> None:
    assert ticks(error)[0] == "1"


def test_a_row_is_as_high_however_many_there_are_and_its_name_stands_level() -> None:
    kinds = ("Coulomb friction", "Structural damping", "Delay of one sensor against the others")
    steps = (FOUND.steps[0], *(step(title, title, 4.0, 4.0) for title in kinds))
    heights = [figure["layout"]["height"] for k in range(1, 5) if (figure := ladder(steps[:k]))]
    assert np.ptp(np.diff(heights)) == 0
    figure = ladder(steps)
    assert figure is not None
    assert figure["layout"]["yaxis"]["ticktext"] == [
        "as given", "+ Coulomb friction", "+ Structural damping",
        "+ Delay of one<br>sensor against the<br>others",
    ]  # fmt: skip
