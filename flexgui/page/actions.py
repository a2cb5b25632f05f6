"""Buttons and selections in the page's own HTML, and the actions that they call.

viser's HTML is one-way: `browser/actions.js` writes what was pressed into a hidden text field,
whose values the server's guard checks like those of every other input.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Annotated, Any

import msgspec
import viser
from markupsafe import Markup
from msgspec import Meta

Text = Annotated[str, Meta(max_length=200)]


class Press(msgspec.Struct, array_like=True):
    """A button or selection was used."""

    number: Annotated[int, Meta(ge=0)]
    """Increases with each press, so that a second press of the same button changes the field."""
    action: Text
    value: Annotated[str, Meta(max_length=5000)] = ""
    """Of a sheet: all its fields as JSON."""


Action = Callable[[str], object]


class Actions:
    """The actions of the page's own HTML, by name."""

    def __init__(self) -> None:
        self._actions: dict[str, Action] = {}
        self._lock = threading.Lock()
        self._newest = -1

    def build(self, gui: viser.GuiApi) -> None:
        """Makes the hidden field, inside the open container."""
        gui.add_html("<div class='fx'><span class='fx-actions'></span></div>")
        field = gui.add_text("Action", "")

        def entered(event: Any) -> None:
            if event.client_id is not None:
                self.enter(field.value)

        field.on_update(entered)

    def register(self, name: str, action: Action) -> None:
        """Calls `action` with the value of the button that has this name."""
        self._actions[name] = action

    def enter(self, text: str) -> None:
        """Calls the action of the text that the browser has written; ignores an invalid text."""
        try:
            press = msgspec.json.decode(text, type=Press)
        except msgspec.DecodeError:
            return
        with self._lock:
            fresh, self._newest = press.number > self._newest, max(press.number, self._newest)
        action = self._actions.get(press.action)
        if fresh and action is not None:
            action(press.value)


def press(
    label: Markup | str,
    action: str,
    value: str = "",
    kind: str = "",
    hint: str = "",
    able: bool = True,
) -> Markup:
    """A button; `kind` is a class of the page's style: 'main' is highlighted, 'link' is text."""
    return Markup(
        "<button type='button' class='{}' data-action='{}' data-value='{}' title='{}'{}>{}</button>"
    ).format(kind, action, value, hint, "" if able else Markup(" disabled"), label)


def selection(
    label: str, name: str, options: dict[str, str], chosen: str, kept: bool = False
) -> Markup:
    """A selection among values with their texts: for the action `name`, or `kept` by the browser
    under that name only."""
    rows = Markup("").join(
        Markup("<option value='{}'{}>{}</option>").format(
            value, Markup(" selected") if value == chosen else "", words
        )
        for value, words in options.items()
    )
    return Markup("<label>{} <select data-{}='{}'>{}</select></label>").format(
        label, "kept" if kept else "action", name, rows
    )
