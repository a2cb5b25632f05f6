"""The fields of one guess: an effect, one of its parameters, and how large that is."""

from __future__ import annotations

from typing import Any

from core.effects import catalogue
from core.errors import InputError
from flexgui.panels.page_context import PageContext
from flexgui.panels.words import Words, paragraph
from flexgui.session.judging import NONE_GUESSED, AskedSize, Guess, asked_sizes, read_sizes


class GuessFields:
    """Stands in the folder that is open; `none` is what may be chosen besides an effect."""

    def __init__(self, desk: PageContext, label: str, none: str) -> None:
        gui, off = desk.gui, desk.read_only
        self._none = none
        self._kinds = {e.title: kind for kind, e in catalogue().items()}
        self._kind: Any = gui.add_dropdown(label, (none, *sorted(self._kinds)), disabled=off)
        self._of: Any = gui.add_dropdown(
            "Size of", ("–",), disabled=off, hint="Choose one of its parameters."
        )
        self._size: Any = gui.add_text(
            "is", "", disabled=off, hint="A number in this unit; may stay empty."
        )
        self._refused = Words(gui)
        self._shown = True
        if not desk.read_only:
            self._kind.on_update(lambda _: self._chosen())
            self._of.on_update(lambda _: self._name_field())
            self._size.on_update(lambda _: self._refused.show(""))
        self._chosen()

    @property
    def kind(self) -> str:
        """Of the effect that is chosen; empty where none is."""
        return self._kinds.get(str(self._kind.value), "")

    def guess(self) -> Guess | None:
        """What stands in the fields; None, and a sentence beside the field, where its size is no
        number."""
        one = self._parameter()
        try:
            size = "" if one is None else one.stated(str(self._size.value))
        except InputError as error:
            self._refused.show(paragraph(str(error), "bad"))
            return None
        self._refused.show("")
        return Guess(self.kind or NONE_GUESSED, size)

    def fill(self, guess: Guess) -> None:
        """Shows a guess that was made before, such as ahead of a reload."""
        known = catalogue().get(guess.kind)
        self._kind.value = self._none if known is None else known.title
        self._chosen()
        for name, value, _ in read_sizes(guess.size):
            titles = [one.title for one in asked_sizes(guess.kind) if one.name == name]
            if titles:
                self._of.value, self._size.value = titles[0], f"{value:.10g}"
        self._name_field()

    def show(self, visible: bool) -> None:
        """All fields, or none."""
        self._shown = visible
        self._kind.visible = visible
        one = self._parameter()
        self._of.visible = self._size.visible = visible and one is not None
        if not visible:
            self._refused.show("")

    def _chosen(self) -> None:
        """Another effect has other parameters."""
        titles = tuple(one.title for one in asked_sizes(self.kind)) or ("–",)
        if self._of.options != titles:
            self._of.options = titles
        self._refused.show("")
        self._name_field()
        self.show(self._shown)

    def _name_field(self) -> None:
        one = self._parameter()
        if one is not None and self._size.label != one.label:
            self._size.label = one.label

    def _parameter(self) -> AskedSize | None:
        found = asked_sizes(self.kind)
        chosen = [one for one in found if one.title == self._of.value]
        return chosen[0] if chosen else found[0] if found else None
