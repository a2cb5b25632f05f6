"""Inputs that are bound to the session, checked on the way in and kept up to date on the way back,
and texts that are escaped. viser sends nothing where a value is set that stands already."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, Literal

import viser
from jinja2 import Environment, PackageLoader
from markupsafe import Markup

from flexgui.export.template import environment
from flexgui.page.panel import PageContext

USER_PRIORITY = 0.6
"""s after a person's change in which an input is not overwritten: it would jump under the hand."""

Limits = tuple[float, float, float]
"""(least, greatest, step)"""


def on_user_input(context: PageContext, handle: Any, action: Callable[[], object]) -> Any:
    """Calls `action` when a person changes an input, not where the page itself has set it."""

    def changed(event: Any) -> None:
        if event.client_id is not None:
            action()

    handle.disabled = context.read_only
    if not context.read_only:
        handle.on_update(changed)
    return handle


def bind(
    context: PageContext, handle: Any, get: Callable[[], Any], put: Callable[[Any], object]
) -> Any:
    """Calls `put` with what a person enters; shows what `get` says when the session changes."""

    def enter() -> None:
        before = get()
        if put(handle.value) is False and before is not None:
            handle.value = before

    def sync() -> None:
        free = context.read_only or time.time() - handle.update_timestamp > USER_PRIORITY
        value = get()
        if free and value is not None and handle.value != value:
            handle.value = value

    context.syncs.append(sync)
    return on_user_input(context, handle, enter)


def disable_inputs(gui: viser.GuiApi, but: set[str]) -> None:
    """Disables all inputs but those with the uuids given: a follower only looks."""
    for uuid, handle in tuple(gui._gui_input_handle_from_uuid.items()):
        group = isinstance(handle, viser.GuiButtonGroupHandle)  # cannot be disabled
        if uuid not in but and not group and hasattr(handle, "disabled"):
            handle.disabled = True


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and math.isfinite(value)


def slider(
    context: PageContext,
    label: str,
    limits: Limits,
    get: Callable[[], float],
    put: Callable[[float], object],
    hint: str = "",
) -> Any:
    """A value outside its limits is never passed on."""
    low, high, step = limits

    def inside(value: float) -> float:
        return min(max(float(value), low), high)

    handle = context.gui.add_slider(label, low, high, step, inside(get()), hint=hint or None)
    return bind(
        context, handle, lambda: inside(get()), lambda v: _is_number(v) and put(inside(v))
    )  # fmt: skip


NO_NOISE_DB = 60.0
"""The slider's end: no noise at all."""


def noise_slider(context: PageContext, hint: str) -> Any:
    """The signal-to-noise ratio of all that is simulated."""
    document = context.session.document

    def get() -> float:
        snr = document.live.snr_db
        return NO_NOISE_DB if snr is None else snr

    def put(value: float) -> bool:
        return document.set_noise(None if value >= NO_NOISE_DB else value)

    hint += "; at the right end there is none."
    return slider(context, "SNR [dB]", (0, NO_NOISE_DB, 1), get, put, hint)


def number(
    context: PageContext,
    label: str,
    limits: tuple[float, float, float | None],
    get: Callable[[], float],
    put: Callable[[float], object],
    hint: str = "",
) -> Any:
    """A number field; what lies outside its limits changes nothing. A whole step: whole numbers."""
    low, high, step = limits
    kind = int if isinstance(step, int) else float
    least, most = (end if math.isfinite(end) else None for end in (low, high))
    handle = context.gui.add_number(label, get(), min=least, max=most, step=step, hint=hint or None)
    return bind(
        context, handle, get, lambda v: _is_number(v) and low <= v <= high and put(kind(v))
    )  # fmt: skip


def choice(
    context: PageContext,
    label: str,
    options: Sequence[str],
    get: Callable[[], str],
    put: Callable[[str], object],
    hint: str = "",
) -> Any:
    """One of some texts."""

    def known() -> str | None:
        value = get()
        return value if value in handle.options else None

    start = get() if get() in options else options[0]
    handle = context.gui.add_dropdown(label, options, initial_value=start, hint=hint or None)
    return bind(context, handle, known, lambda v: v in handle.options and put(v))


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
    handle: Any = context.gui.add_button(
        label, color=color(prominent), hint=hint or None, disabled=context.read_only
    )
    if not context.read_only:
        handle.on_click(lambda _: action())
    return handle


def color(invites: bool) -> Literal["blue", "gray"]:
    """Of a button: one invites, all others stay quiet."""
    return "blue" if invites else "gray"


def set_options(dropdown: Any, options: tuple[str, ...], value: str) -> None:
    """Sets what a dropdown offers, and what is chosen: the first where it has no such option."""
    if dropdown.options != options:
        dropdown.options = options
    dropdown.value = value if value in options else options[0]


class RebuiltFolder:
    """A folder whose inputs are made anew where others are needed."""

    def __init__(self, context: PageContext) -> None:
        self._context, self._folder = context, context.gui.add_folder(None)
        self._shape: object = None
        self._syncs: list[Callable[[], None]] = []
        context.syncs.append(self._sync)

    def make(self, shape: object, build: Callable[[], None]) -> None:
        """Calls `build` inside the folder where the shape differs from the last one."""
        if shape == self._shape:
            return
        self._shape = shape
        for child in tuple(self._folder._children.values()):
            child.remove()
        around, self._context.syncs = self._context.syncs, []
        with self._folder:
            build()
        self._syncs, self._context.syncs = self._context.syncs, around

    def _sync(self) -> None:
        for sync in self._syncs:
            sync()


FRAME = "<div class='fx'>{}</div>"


class HtmlBlock:
    """Paragraphs, tables and pictures below one another; hidden where there are none."""

    def __init__(self, gui: viser.GuiApi, *parts: Markup | str) -> None:
        content = joined(*parts).strip()
        self._handle = gui.add_html(FRAME.format(content), visible=bool(content))

    def show(self, *parts: Markup | str) -> None:
        """Plain text is escaped; Markup is taken as it is."""
        content = joined(*parts).strip()
        self._handle.content = FRAME.format(content)
        self._handle.visible = bool(content)


def paragraph(text: Markup | str, kind: str = "") -> Markup:
    """`kind` is a class of the page's style: 'soft', 'bad', 'lead'; no text makes no paragraph."""
    return Markup("<p class='{}'>{}</p>").format(kind, text) if text else Markup("")


def folded(summary: str, content: Markup) -> Markup:
    """What unfolds when its summary is pressed; nothing where there is no content."""
    fold = Markup("<details><summary>{}</summary>{}</details>")
    return fold.format(summary, content) if content else Markup("")


def joined(*parts: Markup | str) -> Markup:
    """The parts below one another."""
    return Markup("").join(parts)


@cache
def _templates() -> Environment:
    return environment().overlay(loader=PackageLoader("flexgui", "stages"))


def stage_macros(stage: str, **known: object) -> Any:
    """What the panel of a stage says: the macros of the template in its folder, each a function;
    `known` is what they may use."""
    known = {"paragraph": paragraph, "folded": folded, **known}
    return _templates().get_template(f"{stage}/words.html.j2", globals=known).module
