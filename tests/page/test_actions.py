"""What is pressed in the page's own HTML, and what arrives instead of a press."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.page.actions import Actions, press, selection


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


@pytest.mark.parametrize("text", ["", "{}", "[]", '[1,"unknown","x"]', '[-1,"add","x"]',
                                  '[1,"add",3]', '["1","add","x"]'])  # fmt: skip
def test_what_makes_no_sense_does_nothing(text: str) -> None:
    actions, values = heard()
    actions.enter(text)
    assert not values


@given(st.text(max_size=300))
def test_any_text_is_survived(text: str) -> None:
    actions, values = heard()
    actions.enter(text)
    assert not values


def test_texts_in_buttons_and_selections_are_escaped() -> None:
    evil = "<script>'\""
    for html in (press(evil, "add", evil, hint=evil), selection(evil, "add", {evil: evil}, evil)):
        assert "<script" not in html and "&lt;script&gt;&#39;&#34;" in html


def test_what_a_browser_keeps_is_no_action() -> None:
    html = selection("Text size", "text", {"100": "usual"}, "", kept=True)
    assert "data-kept='text'" in html and "data-action" not in html
