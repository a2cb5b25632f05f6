"""Inputs that are bound to the session: checked on the way in, kept up to date on the way back."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import viser

from flexgui.panels.page_context import PageContext

HANDS_OFF = 0.6
"""s after a person's change in which an input is not overwritten: it would jump under the hand."""


def bind(
    desk: PageContext, handle: Any, get: Callable[[], Any], put: Callable[[Any], object]
) -> Any:
    """Calls `put` with what a person enters; shows what `get` says when the session changes."""
    if desk.read_only:
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
        held = desk.read_only or time.time() - handle.update_timestamp > HANDS_OFF
        value = get()
        if held and value is not None and handle.value != value:
            handle.value = value

    desk.syncs.append(sync)
    return handle


def grey(gui: viser.GuiApi, but: set[str]) -> None:
    """Disables all inputs but those with the uuids given: a follower only looks."""
    for uuid, handle in tuple(gui._gui_input_handle_from_uuid.items()):
        group = isinstance(handle, viser.GuiButtonGroupHandle)  # cannot be disabled
        if uuid not in but and not group and hasattr(handle, "disabled"):
            handle.disabled = True


def slider(
    desk: PageContext,
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
    handle = desk.gui.add_slider(label, low, high, step, start, hint=hint or None)
    return bind(desk, handle, lambda: inside(get()), checked)


def number(
    desk: PageContext,
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

    handle = desk.gui.add_number(label, get(), min=least, max=most, step=step, hint=hint or None)
    return bind(desk, handle, get, checked)


def choice(
    desk: PageContext,
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
    handle = desk.gui.add_dropdown(label, options, initial_value=start, hint=hint or None)
    return bind(desk, handle, known, checked)


def switch(
    desk: PageContext,
    label: str,
    get: Callable[[], bool],
    put: Callable[[bool], object],
    hint: str = "",
) -> Any:
    """Yes or no."""
    handle = desk.gui.add_checkbox(label, get(), hint=hint or None)
    return bind(desk, handle, get, lambda value: put(bool(value)))


def button(
    desk: PageContext,
    label: str,
    action: Callable[[], object],
    prominent: bool = False,
    icon: Any = None,
    hint: str = "",
) -> Any:
    """`prominent` is the next sensible thing to do."""
    handle = desk.gui.add_button(
        label, color="blue" if prominent else "gray", icon=icon, hint=hint or None
    )
    if desk.read_only:
        handle.disabled = True
    else:

        @handle.on_click
        def _(_: object) -> None:
            action()

    return handle
