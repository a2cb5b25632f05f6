"""A question before what cannot be taken back: two buttons in place of one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flexgui.panels import widgets
from flexgui.panels.page_context import PageContext
from flexgui.panels.words import Words, paragraph


class Confirm:
    """A button that acts at once where there is nothing to lose, and else asks first."""

    def __init__(
        self, desk: PageContext, label: str, question: str, action: Callable[[], object],
        loses: Callable[[], bool], yes: str, no: str,
    ) -> None:  # fmt: skip
        self._action, self._loses, self._question = action, loses, question
        self._words = Words(desk.gui)
        self._begin: Any = widgets.button(desk, label, self._pressed, prominent=True)
        self._yes: Any = widgets.button(desk, yes, self._confirmed, prominent=True)
        self._no: Any = widgets.button(desk, no, self._left)
        self._asking, self._shown = False, True
        self.show(True)

    def show(self, visible: bool) -> None:
        """The button or its question; nothing."""
        self._shown = visible
        self._asking = self._asking and visible
        self._words.show(paragraph(self._question, "bad") if self._asking else "")
        self._begin.visible = visible and not self._asking
        self._yes.visible = self._no.visible = visible and self._asking

    def _pressed(self) -> None:
        if self._loses():
            self._asking = True
            self.show(self._shown)
        else:
            self._action()

    def _confirmed(self) -> None:
        self._left()
        self._action()

    def _left(self) -> None:
        self._asking = False
        self.show(self._shown)
