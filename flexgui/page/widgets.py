"""Inputs that are bound to the session, checked on the way in and kept up to date on the way back,
and texts that are escaped."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import viser
from markupsafe import Markup, escape

from flexgui.page.panel import PageContext

HANDS_OFF = 0.6
"""s after a person's change in which an input is not overwritten: it would jump under the hand."""


def bind(
    context: PageContext, handle: Any, get: Callable[[], Any], put: Callable[[Any], object]
) -> Any:
    """Calls `put` with what a person enters; shows what `get` says when the session changes."""
    if context.read_only:
        handle.disabled = True
    else:

        @handle.on_update
        def _(event: Any) -> None:
            if event.client_id is None:
                return  # the page itself set it
            before = get()
            if put(handle.value) is False and before is not None:
                handle.value = before

    def sync() -> None:
        held = context.read_only or time.time() - handle.update_timestamp > HANDS_OFF
        value = get()
        if held and value is not None and handle.value != value:
            handle.value = value

    context.syncs.append(sync)
    return handle


def grey(gui: viser.GuiApi, but: set[str]) -> None:
    """Disables all inputs but those with the uuids given: a follower only looks."""
    for uuid, handle in tuple(gui._gui_input_handle_from_uuid.items()):
        group = isinstance(handle, viser.GuiButtonGroupHandle)  # cannot be disabled
        if uuid not in but and not group and hasattr(handle, "disabled"):
            handle.disabled = True


def slider(
    context: PageContext,
    label: str,
    limits: tuple[float, float, float],
    get: Callable[[], float],
    put: Callable[[float], object],
    hint: str = "",
) -> Any:
    """`limits` are (least, greatest, step); a value outside them is never passed on."""
    low, high, step = limits

    def inside(value: float) -> float:
        return min(max(float(value), low), high)

    def checked(value: Any) -> object:
        if not isinstance(value, int | float) or not math.isfinite(value):
            return False
        return put(inside(value))

    start = inside(get())
    handle = context.gui.add_slider(label, low, high, step, start, hint=hint or None)
    return bind(context, handle, lambda: inside(get()), checked)


def number(
    context: PageContext,
    label: str,
    get: Callable[[], float],
    put: Callable[[float], object],
    least: float | None = None,
    most: float | None = None,
    step: float | None = None,
    hint: str = "",
) -> Any:
    """A number field; what lies outside its limits changes nothing."""

    def checked(value: Any) -> object:
        if not isinstance(value, int | float) or not math.isfinite(value):
            return False
        if (least is not None and value < least) or (most is not None and value > most):
            return False
        return put(value)

    handle = context.gui.add_number(label, get(), min=least, max=most, step=step, hint=hint or None)
    return bind(context, handle, get, checked)


def choice(
    context: PageContext,
    label: str,
    options: tuple[str, ...],
    get: Callable[[], str],
    put: Callable[[str], object],
    hint: str = "",
) -> Any:
    """One of some texts."""

    def checked(value: Any) -> object:
        return put(value) if value in handle.options else False

    def known() -> str | None:
        value = get()
        return value if value in handle.options else None

    start = get() if get() in options else options[0]
    handle = context.gui.add_dropdown(label, options, initial_value=start, hint=hint or None)
    return bind(context, handle, known, checked)


def switch(
    context: PageContext,
    label: str,
    get: Callable[[], bool],
    put: Callable[[bool], object],
    hint: str = "",
) -> Any:
    """Yes or no."""
    handle = context.gui.add_checkbox(label, get(), hint=hint or None)
    return bind(context, handle, get, lambda value: put(bool(value)))


def button(
    context: PageContext,
    label: str,
    action: Callable[[], object],
    prominent: bool = False,
    hint: str = "",
) -> Any:
    """`prominent` is the next sensible thing to do."""
    handle = context.gui.add_button(label, color="blue" if prominent else "gray", hint=hint or None)
    if context.read_only:
        handle.disabled = True
    else:

        @handle.on_click
        def _(_: object) -> None:
            action()

    return handle


class Rebuilt:
    """Holds inputs and their links to the session."""

    def __init__(self, context: PageContext, folder: Any) -> None:
        self._context, self._folder = context, folder
        self._shape: object = None
        self._syncs: list[Callable[[], None]] = []

    def make(self, shape: object, build: Callable[[], None]) -> None:
        """Calls `build` inside the folder where the shape differs from the last one."""
        if shape == self._shape:
            return
        self._shape = shape
        for sync in self._syncs:
            self._context.syncs.remove(sync)
        for child in tuple(self._folder._children.values()):
            child.remove()
        before = len(self._context.syncs)
        with self._folder:
            build()
        self._syncs = self._context.syncs[before:]


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
