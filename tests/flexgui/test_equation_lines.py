"""Long equations stand in several lines; nothing of them is lost."""

from __future__ import annotations

import re

import pytest

from flexgui.core.effects import catalogue
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.simulate.equations import equations
from flexgui.library.shipped import demo_scenario
from flexgui.views.equation_lines import NEXT_ROW, in_lines
from flexgui.views.table import mathml

WIDTH = 48


def formulas() -> list[str]:
    """Of the effects, and of an arm with as many bending shapes as there can be."""
    scenario = demo_scenario()
    document = scenario.model_copy(
        update={"arm": scenario.arm.model_copy(update={"overrides": {"modes": 3}})}
    )
    model = base_model(document)
    return [e.latex for e in equations(model)] + [e.formula for e in catalogue().values()]


@pytest.mark.parametrize("latex", formulas())
def test_nothing_of_a_formula_is_lost_in_its_lines(latex: str) -> None:
    broken = in_lines(latex, WIDTH)
    assert signs(broken) == signs(latex)
    assert "<code" not in str(mathml(broken)), "it can be shown"
    if "begin{bmatrix}" in latex:
        assert broken == latex


def signs(latex: str) -> str:
    """What is seen, without what puts it into lines."""
    plain = re.sub(r"\\(begin|end)\{aligned\}|\\left|\\right|\\q?quad|&|,\s*$", "", latex)
    return re.sub(r"[\s\\,]", "", plain)


def test_the_widest_equation_is_broken_into_lines_of_a_panel() -> None:
    widest = max(formulas(), key=widest_row)
    before, after = widest_row(widest), widest_row(in_lines(widest, WIDTH))
    assert before > 5 * WIDTH > 2 * WIDTH >= after, "of a fraction both parts are counted here"


def widest_row(latex: str) -> int:
    """Characters that are seen, of a fraction those of both parts."""
    rows = (re.sub(r"\\[A-Za-z]+", "x", row) for row in latex.split(NEXT_ROW))
    return max(len(re.sub(r"[{}_^]", "", signs(row))) for row in rows)


def test_a_sum_is_broken_before_its_signs() -> None:
    terms = " + ".join(f"a_{{{k}}} \\sin{{\\left(x_{{{k}}} \\right)}}" for k in range(30))
    lines = in_lines(f"y = {terms}", WIDTH).split(NEXT_ROW)
    assert in_lines("a = b + c", WIDTH) == "a = b + c"
    assert len(lines) > 3 and all("+" in line[:12] for line in lines[1:])
