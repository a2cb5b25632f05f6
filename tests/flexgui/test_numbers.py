import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.core.results import Estimate
from flexgui.export.export_files import _rounded
from flexgui.sentences.written import (
    channel_symbol,
    estimate_text,
    format_number,
    format_value,
    shown_unit,
    size_text,
)
from flexgui.views.names import equation, output_title, plain_symbol, typeset
from flexgui.views.parameter_tables import short_parameters
from flexgui.views.table import Column, Row, Table

HALF_A_DIGIT = 0.51
"""Rounding moves a number by half of its last digit, and a little by the binary fraction."""


@pytest.mark.parametrize(
    ("value", "std", "unit", "text"),
    [
        (520.8333, 0.0213, "N m²", "520.83 ± 0.02\N{NO-BREAK SPACE}N m²"),
        (1.00984, 0.0924, "GPa", "1.01 ± 0.09\N{NO-BREAK SPACE}GPa"),
        (50.2, 1.3, "mm", "50.2 ± 1.3\N{NO-BREAK SPACE}mm"),
        (60.0, 0.0998, "", "60.00 ± 0.10"),
        (1234.5, 56.0, "", "1230 ± 60"),
        (500.0, 3865.0, "", "500 ± 4000"),
        (5.99, 932.0, "", "6.0 ± 900"),
        (1e-9, 0.5, "", "0.0000 ± 0.5"),
        (2.346e-5, 3e-7, "m", "(2.35 ± 0.03) × 10⁻⁵\N{NO-BREAK SPACE}m"),
        (0.0, 0.5, "N m", "0.0 ± 0.5\N{NO-BREAK SPACE}N m"),
        (520.8333, math.nan, "N m²", "520.8\N{NO-BREAK SPACE}N m²"),
        (520.8333, 0.0, "", "520.8"),
        (math.nan, 1.0, "m", "–"),
    ],
)
def test_a_value_is_rounded_to_its_deviation(
    value: float, std: float, unit: str, text: str
) -> None:
    assert format_value(value, std, unit) == text


@pytest.mark.parametrize(
    ("estimate", "text"),
    [
        (Estimate("epsilon", 0.8e9, 5e10, "Pa", False, lower=0.8e9, at_bound=True),
         "not determined (the fit ended at its bound 0.8 GPa)"),
        (Estimate("epsilon", 0.8e9, math.nan, "Pa", False, lower=0.8e9, at_bound=True),
         "not determined (the fit ended at its bound 0.8 GPa)"),
        (Estimate("d", 0.05, 0.6, "m", True, lower=0.005),
         "not determined (the fit ended at 50 mm)"),
        (Estimate("offset", 0.1, 0.2, "N m", True), "0.10 ± 0.2 N m"),
        (Estimate("fc1", 0.0, math.nan, "N m", False, lower=0.0, at_bound=True), "0 N m"),
    ],
)  # fmt: skip
def test_a_deviation_above_the_value_is_no_estimate(estimate: Estimate, text: str) -> None:
    assert estimate_text(estimate).replace("\N{NO-BREAK SPACE}", " ") == text
    link = "is" if text.startswith("not") else "="
    assert size_text("x", estimate).startswith(f"x {link} ")
    assert f" {link} {text}" in equation(estimate).striptags().replace("\N{NO-BREAK SPACE}", " ")


def test_powers_of_units_are_raised() -> None:
    assert format_value(0.5, 0.01, "N m s^2/rad^2") == "0.500 ± 0.010\N{NO-BREAK SPACE}N m s²/rad²"


@pytest.mark.parametrize(("std", "said"), [(1e-3, False), (math.nan, True)])
def test_a_panel_says_what_no_deviation_means_only_where_one_lacks(std: float, said: bool) -> None:
    table = Table((Column("Parameter"), Column("Start")), (Row(("m1", "1 kg")),))
    shown = short_parameters(table, [Estimate("m1", 1.0, std, "kg", not said)])
    assert shown.rows == (Row(("m1",)),)
    assert bool(shown.caption) is said


@given(st.floats(1e-3, 9e5), st.floats(1e-6, 1e3))
def test_rounding_stays_within_the_deviation(value: float, std: float) -> None:
    text = format_value(value, std)
    if "×" in text:
        return
    shown, deviation = (float(part) for part in text.split(" ± "))
    assert abs(shown - value) <= HALF_A_DIGIT * min(std, 0.1 * value) + 1e-3 * std
    assert deviation == pytest.approx(std, rel=HALF_A_DIGIT)


@given(st.floats(1e-3, 9e5))
def test_four_digits_are_right_to_half_of_the_last(value: float) -> None:
    assert float(format_number(value)) == pytest.approx(value, rel=HALF_A_DIGIT * 1e-3)


@pytest.mark.parametrize(
    ("values", "unit", "factor", "name"),
    [
        (np.array([1e-4, np.nan, -3e-4]), "m", 1e3, "mm"),
        (0.5, "m", 1.0, "m"),
        (1e9, "Pa", 1e-9, "GPa"),
        (0.0, "rad", 1.0, "rad"),
        (np.array([]), "rad", 1.0, "rad"),
        (1e-9, "N m²", 1.0, "N m²"),
    ],
)
def test_units_suit_the_size(values: np.ndarray, unit: str, factor: float, name: str) -> None:
    shown = shown_unit(values, unit)
    assert (shown.factor, shown.name) == (factor, name)


def test_names_read_as_written_by_hand() -> None:
    assert channel_symbol("z2") == "z₂"
    assert channel_symbol("temperature") == "temperature"
    assert plain_symbol("\\varepsilon", "epsilon") == "ε"
    assert plain_symbol("\\lambda_{1}", "lambda1") == "λ₁"
    assert plain_symbol("", "EI1") == "EI₁"
    assert plain_symbol("\\dot{\\theta}_1", "x").endswith("₁")


def test_a_slide_has_a_position_q_and_a_force_and_no_angle() -> None:
    assert channel_symbol("theta1", "m") == "q₁"
    assert channel_symbol("dtheta1", "m/s") == channel_symbol("dtheta1").replace("θ", "q")
    assert channel_symbol("theta1", "rad") == channel_symbol("theta1") == "θ₁"
    assert channel_symbol("z1", "m") == "z₁", "what is no joint keeps its symbol"
    assert output_title("u1", "N") == "joint force u₁"
    assert output_title("u1", "N m") == "joint torque u₁"
    assert output_title("theta2", "rad") == "joint angle θ₂"
    assert output_title("theta2", "m") == "joint position q₂"
    assert output_title("z1", "m") == "tip position z₁"


def test_subscripts_that_are_words_are_typeset_for_html_and_everything_is_escaped() -> None:
    assert typeset("f_{c1}", "fc1") == "f<sub>c1</sub>"
    assert typeset("\\lambda_{1}", "lambda1") == "λ₁"
    assert typeset("", "my_gain") == "my_gain", "a name is no symbol"
    assert typeset("<b>_{c1}", "x") == "&lt;b&gt;<sub>c1</sub>"


def test_tables_keep_numbers_of_every_size() -> None:
    """The chance that noise looks like a strong effect is below what a factor of ten can lift."""
    values = np.array([0.0, np.nan, 1e-310, -4.9e-324, 1.0, 1.23456789012345e-7, 1e300])
    found = _rounded(values)
    assert np.allclose(found, values, rtol=1e-9, atol=0.0, equal_nan=True)
