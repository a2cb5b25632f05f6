from __future__ import annotations

import pytest

from flexgui.views.ladder import _ticks, ladder
from tests.flexgui.test_diagnosis_report import FOUND, step


def test_the_axis_names_numbers_that_are_read_at_a_glance() -> None:
    assert _ticks(16.0)["ticktext"] == ["1", "2", "5", "10", "20", "50"]


def test_a_high_ladder_names_decades_only() -> None:
    assert _ticks(4000.0)["ticktext"] == ["1", "10", "100", "1000"]


@pytest.mark.parametrize("end", [0.5, 1.0, 9.99, 10.0, 299.0, 1e5])
def test_the_floor_is_always_named(end: float) -> None:
    assert _ticks(end)["tickvals"][0] == 1


def test_labels_stay_level_from_three_effects_on() -> None:
    kinds = ("Coulomb friction", "Structural damping", "Wrong scale of a sensor")
    figure = ladder((FOUND.steps[0], *(step(title, title, 4.0, 4.0) for title in kinds)))
    assert figure is not None and figure["layout"]["xaxis"]["tickangle"] == 0
    assert figure["data"][0]["x"][1:] == ["+ Coulomb<br>friction", "+ Structural<br>damping",
                                    "+ Wrong<br>scale of a<br>sensor"]  # fmt: skip
