"""What is pressed in the page's own HTML, and what arrives instead of a press."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.page.actions import Actions, press, selection
from flexgui.page.in_browser import asset


def heard() -> tuple[Actions, list[str]]:
    actions, values = Actions(), list[str]()
    actions.register("add", values.append)
    return actions, values


def test_a_press_calls_its_action_with_its_value() -> None:
    actions, values = heard()
    actions.enter('[1,"add","coulomb_friction"]')
    actions.enter('[2,"add","coulomb_friction"]')
    assert values == ["coulomb_friction", "coulomb_friction"]


def test_a_press_that_comes_twice_or_late_counts_once() -> None:
    actions, values = heard()
    for number in (2, 2, 1):
        actions.enter(json.dumps([number, "add", ""]))
    assert values == [""]


NONSENSE = "", "{}", "[]", '[1,"unknown","x"]', '[-1,"add","x"]', '[1,"add",3]', '["1","add","x"]'


@given(st.sampled_from(NONSENSE) | st.text(max_size=300))
def test_what_makes_no_sense_does_nothing(text: str) -> None:
    actions, values = heard()
    actions.enter(text)
    assert not values


def test_texts_in_buttons_and_selections_are_escaped() -> None:
    evil = "<script>'\""
    for html in (press(evil, "add", evil, hint=evil), selection(evil, "add", {evil: evil}, evil)):
        assert "<script" not in html and "&lt;script&gt;&#39;&#34;" in html
    kept = selection("Text size", "text", {"100": "usual"}, "", kept=True)
    assert "data-kept='text'" in kept and "data-action" not in kept, "a browser keeps it"


BUTTONS = """<html data-mantine-color-scheme="{theme}"><style>{style}
  :root {{ color-scheme: {theme}; --mantine-color-body: Canvas; --mantine-color-text: CanvasText;
  --mantine-color-default-hover: {hover};
  --mantine-primary-color-filled: #1971c2; --mantine-primary-color-filled-hover: #1864ab; }}
  * {{ transition: none !important; }} </style><body style="background: Canvas; color: CanvasText">
  <div class="fx">{pressed}</div><div id="fx-line"><button class="play">II</button>
  <button>Top</button></div>"""
"""The page's own buttons, in the colours of viser's theme."""
HOVER = {"light": "#f8f9fa", "dark": "#3b3b3b"}
CONTRAST = """button => {
  const context = new OffscreenCanvas(1, 1).getContext("2d", {willReadFrequently: true});
  const light = colour => {
    context.fillStyle = colour;
    context.fillRect(0, 0, 1, 1);
    const [r, g, b] = [...context.getImageData(0, 0, 1, 1).data].map(
      v => v <= 10 ? v / 255 / 12.92 : ((v / 255 + .055) / 1.055) ** 2.4);
    return .2126 * r + .7152 * g + .0722 * b;
  };
  const style = getComputedStyle(button);
  const ground = light(style.backgroundColor), text = light(style.color);
  return (Math.max(ground, text) + .05) / (Math.min(ground, text) + .05);
}"""
READABLE = 4.5
"""Contrast of text, by the guidelines for accessible pages."""


@pytest.mark.parametrize("theme", HOVER)
def test_every_button_is_readable_under_the_mouse(chromium: Any, theme: str) -> None:
    pressed = "".join(press(kind or "plain", "add", "", kind) for kind in ("main", "", "link"))
    page = chromium.new_page(color_scheme=theme)
    page.set_content(
        BUTTONS.format(style=asset("page.css"), theme=theme, hover=HOVER[theme], pressed=pressed)
    )
    contrasts = {}
    for button in page.get_by_role("button").all():
        button.hover()
        contrasts[button.inner_text()] = button.evaluate(CONTRAST)
    page.close()
    assert len(contrasts) == 5
    assert all(contrast >= READABLE for contrast in contrasts.values()), contrasts
