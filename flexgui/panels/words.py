"""A block of HTML whose texts are all escaped, sent only where it changed."""

from __future__ import annotations

import viser
from markupsafe import Markup, escape


class Words:
    """An HTML element; empty content hides it."""

    def __init__(self, gui: viser.GuiApi, content: Markup | str = "") -> None:
        text = self._frame(content)
        self._handle = gui.add_html(text, visible=bool(content))
        self._text = text

    def show(self, content: Markup | str) -> None:
        """Plain text is escaped; Markup is taken as it is."""
        text = self._frame(content)
        if text != self._text:
            self._text = text
            self._handle.content = text
        if self._handle.visible != bool(content):
            self._handle.visible = bool(content)

    @staticmethod
    def _frame(content: Markup | str) -> str:
        return f"<div class='fx'>{escape(content)}</div>"


def paragraph(text: str, kind: str = "") -> Markup:
    """One sentence; `kind` is a class of the page's style: 'soft', 'bad', 'lead'."""
    return Markup("<p class='{}'>{}</p>").format(kind, text)


def joined(*parts: Markup | str) -> Markup:
    """The parts below one another."""
    return Markup("").join(parts)
