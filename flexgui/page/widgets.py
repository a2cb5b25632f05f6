"""Inputs that are bound to the session: values are checked, and updated when the session changes;
and escaped texts. viser sends nothing if a value is unchanged."""

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
"""s after a person's input in which it is not overwritten, so that a slider does not jump."""

Limits = tuple[float, float, float]
"""(least, greatest, step)"""


def on_user_input(context: PageContext, handle: Any, action: Callable[[], object]) -> Any:
    """Calls `action` when a person changes an input, not when the page itself sets it."""

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
    """Calls `put` with a person's input; shows the value of `get` when the session changes."""

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
    """Disables all inputs except those with the given uuids, for a follower."""
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
    """A slider; shows the nearest value between its limits. The browser says what is wrong with an
    entry beyond them."""
    low, high, step = limits

    def inside() -> float:
        return min(max(float(get()), low), high)

    handle = context.gui.add_slider(label, low, high, step, inside(), hint=hint or None)

    def enter(value: Any) -> object:
        # What the browser writes back instead of a wrong entry is no entry either.
        written_back = value == round(inside(), handle.precision)
        refused = written_back or _complaint(value, (low, high, None))
        return None if refused else put(float(value))

    return bind(context, handle, inside, enter)


NO_NOISE_DB = 60.0
"""The slider's right end: no noise."""


def noise_slider(context: PageContext, hint: str) -> Any:
    """A slider for the signal-to-noise ratio of all simulated recordings."""
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
    """A number field. An entry outside its limits stays as it is typed, with a sentence below that
    says what is allowed, and the model keeps its value. An integer step: integers only."""
    step = limits[2]
    # The browser would change an entry outside given ends without a word.
    handle: Any = context.gui.add_number(label, get(), step=step, hint=hint or None)
    complaint = HtmlBlock(context.gui)
    refused: list[float] = []
    """The value that the model keeps while an entry is refused."""

    def shown() -> float | None:
        if refused and refused[0] != get():
            refused.clear()
            complaint.show("")
        return None if refused else get()

    def enter(value: Any) -> object:
        before, words = get(), _complaint(value, limits)
        refused[:] = [before] if words else []
        complaint.show(paragraph(words and f"{words}; still {before:.6g}.", "alarm"))
        return words or put(int(value) if isinstance(step, int) else float(value))

    return bind(context, handle, shown, enter)


def _complaint(value: Any, limits: tuple[float, float, float | None]) -> str:
    """What is allowed instead of an entry; empty where it is."""
    low, high, step = limits
    whole = isinstance(step, int)
    if _is_number(value) and low <= value <= high and not (whole and value != int(value)):
        return ""
    kind = "a whole number" if whole else "a number"
    ends = [(word, end) for word, end in (("from", low), ("to", high)) if math.isfinite(end)]
    shown = f"{value:.6g} is not" if _is_number(value) else "That is not"
    return " ".join([shown, kind, *(f"{word} {end:.6g}" for word, end in ends)])


def choice(
    context: PageContext,
    label: str,
    options: Sequence[str],
    get: Callable[[], str],
    put: Callable[[str], object],
    hint: str = "",
) -> Any:
    """A dropdown of texts."""

    def current() -> str | None:
        value = get()
        return value if value in handle.options else None

    start = get() if get() in options else options[0]
    handle = context.gui.add_dropdown(label, options, initial_value=start, hint=hint or None)
    return bind(context, handle, current, lambda v: v in handle.options and put(v))


def switch(
    context: PageContext,
    label: str,
    get: Callable[[], bool],
    put: Callable[[bool], object],
    hint: str = "",
) -> Any:
    """A checkbox."""
    handle = context.gui.add_checkbox(label, get(), hint=hint or None)
    return bind(context, handle, get, lambda value: put(bool(value)))


def button(
    context: PageContext,
    label: str,
    action: Callable[[], object],
    prominent: bool = False,
    hint: str = "",
) -> Any:
    """A button; the `prominent` one is the next sensible step. Pressed it ends the message of what
    was done before."""

    def pressed() -> None:
        if context.session.message.text:
            context.session.show_message("")
        action()

    handle: Any = context.gui.add_button(
        label, color=color(prominent), hint=hint or None, disabled=context.read_only
    )
    if not context.read_only:
        handle.on_click(lambda _: pressed())
    return handle


def color(invites: bool) -> Literal["blue", "gray"]:
    """The colour of a button: blue for the one that is highlighted."""
    return "blue" if invites else "gray"


def set_options(dropdown: Any, options: tuple[str, ...], value: str) -> None:
    """Sets a dropdown's options and its value: the first option if the value is none of them."""
    if dropdown.options != options:
        dropdown.options = options
    dropdown.value = value if value in options else options[0]


class RebuiltFolder:
    """A folder whose inputs are built again when other ones are needed."""

    def __init__(self, context: PageContext) -> None:
        self._context, self._folder = context, context.gui.add_folder(None)
        self._shape: object = None
        self._syncs: list[Callable[[], None]] = []
        context.syncs.append(self._sync)

    def make(self, shape: object, build: Callable[[], None]) -> None:
        """Calls `build` inside the folder if the shape differs from the last one."""
        if shape == self._shape:
            return
        self._shape = shape
        for child in tuple(self._folder._children.values()):
            child.remove()
        outer_syncs, self._context.syncs = self._context.syncs, []
        with self._folder:
            build()
        self._syncs, self._context.syncs = self._context.syncs, outer_syncs

    def _sync(self) -> None:
        for sync in self._syncs:
            sync()


FRAME = "<div class='fx'>{}</div>"


class HtmlBlock:
    """A block of HTML: paragraphs, tables, pictures; hidden if empty."""

    def __init__(self, gui: viser.GuiApi, *parts: Markup | str) -> None:
        content = joined(*parts).strip()
        self._handle = gui.add_html(FRAME.format(content), visible=bool(content))

    def show(self, *parts: Markup | str) -> None:
        """Shows the parts below one another; escapes plain text, but not Markup."""
        content = joined(*parts).strip()
        self._handle.content = FRAME.format(content)
        self._handle.visible = bool(content)


def paragraph(text: Markup | str, kind: str = "") -> Markup:
    """A paragraph; `kind` is a class of the page's style: 'soft', 'bad', 'lead'."""
    return Markup("<p class='{}'>{}</p>").format(kind, text) if text else Markup("")


def folded(summary: str, content: Markup) -> Markup:
    """Content that unfolds when its summary is pressed; empty without content."""
    fold = Markup("<details><summary>{}</summary>{}</details>")
    return fold.format(summary, content) if content else Markup("")


def joined(*parts: Markup | str) -> Markup:
    """The parts as one text, escaped."""
    return Markup("").join(parts)


@cache
def _templates() -> Environment:
    return environment().overlay(loader=PackageLoader("flexgui", "stages"))


def stage_macros(stage: str, **names: object) -> Any:
    """The macros of a stage's template; `names` are those that the template may use."""
    names = {"paragraph": paragraph, "folded": folded, **names}
    return _templates().get_template(f"{stage}/words.html.j2", globals=names).module
