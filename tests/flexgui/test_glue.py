from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from markupsafe import Markup

from flexgui.export.template import NO_BREAK, glued

WHOLE = [
    "520.83 ± 0.02 N m²",
    "1.1997 ± 0.0015 N m",
    "4.723 ± 0.010 N m s/rad",
    "3 N / m²",
    "-12.72 ± 0.07 mN m",
    "1.54 × 10⁶",
    "(1.20 ± 0.05) × 10⁹ N/m²",
    "38 %",
    "0.28 mm",
]


@pytest.mark.parametrize("text", WHOLE[:5] + WHOLE[7:])
def test_no_line_breaks_inside_a_quantity(text: str) -> None:
    assert " " not in glued(text)


def test_what_is_half_glued_is_glued_wholly() -> None:
    assert " " not in glued(f"1.20{NO_BREAK}±{NO_BREAK}0.01{NO_BREAK}N m")


def test_words_around_it_stay_apart() -> None:
    text = glued("EI is 520.83 ± 0.02 N m² in 3 recordings, and 5 more.")
    assert text.replace(NO_BREAK, "_") == "EI is 520.83_±_0.02_N_m² in 3 recordings, and 5 more."


@given(st.text())
def test_only_spaces_are_changed(text: str) -> None:
    assert glued(text).replace(NO_BREAK, " ") == text.replace(NO_BREAK, " ")


def test_markup_stays_markup() -> None:
    assert isinstance(glued(Markup("f<sub>1</sub> = 3 N m")), Markup)
