import xml.etree.ElementTree as ET

import pytest

from flexgui.views.table import ALLOWED, NAMESPACE, mathml

FORMULAS = (
    r"M(q)\,\ddot{q} = F(q,\dot{q}) + G u",
    r"\begin{bmatrix} 0 & I \\ -K & -D \end{bmatrix}",
    r"\left[\begin{matrix}1 & 0\\0 & 1\end{matrix}\right]",
    r"\frac{1}{2}\int_0^{l} EI\,\delta''^2\,dx",
    r"\cos{\left(\theta_{2} \right)} < 1",
    r"\text{<script>alert(1)</script>}",
    r"\text{a \& b}",
)
HOSTILE = (r"\text{<script>alert(1)</script>}", r"<img src=x onerror=alert(1)>",
           r"\href{javascript:alert(1)}{x}", r"\style{background:url(x)}{y}",
           r"\class{a}{\text{</math><script>}}")  # fmt: skip


@pytest.mark.parametrize("latex", FORMULAS)
def test_formulas_become_well_formed_mathml(latex: str) -> None:
    root = ET.fromstring(mathml(latex))
    assert root.tag == f"{{{NAMESPACE}}}math"


@pytest.mark.parametrize("latex", HOSTILE)
def test_formulas_carry_no_other_elements_and_no_links(latex: str) -> None:
    text = str(mathml(latex))
    assert "<script" not in text
    assert "<img" not in text
    for element in ET.fromstring(text).iter():
        assert element.tag == "code" or element.tag.split("}")[-1] in ALLOWED
        assert not set(element.attrib) & {"href", "style", "onerror", "src"}


@pytest.mark.parametrize("latex", [r"\bad{", "}{", ""])
def test_what_is_no_formula_is_shown_as_text(latex: str) -> None:
    ET.fromstring(mathml(latex))


def test_brackets_of_matrices_do_not_need_a_mathematical_font() -> None:
    text = str(mathml(r"\begin{bmatrix} 0 & I \\ -K & -D \end{bmatrix}"))
    assert 'class="square"' in text
    assert "[" not in text
