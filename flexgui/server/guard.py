"""Checks what one browser sends, as viser checks nothing: whether it may use a widget, which values
the widget takes, and which uploads are refused before their bytes are kept."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping
from functools import singledispatch
from typing import Annotated, Any

import msgspec
import viser
from msgspec import Meta, convert

from flexgui.server.browser_connection import BrowserConnection, Upload
from flexgui.server.errors import explain_following, refuse_upload, restore_value
from flexgui.server.messages import (
    FileTransferPart,
    FileTransferStartUpload,
    GuiButtonHoldMessage,
    GuiUpdateMessage,
    Message,
    Number,
    Passive,
)
from flexgui.server.services import MEGA, Limits

log = logging.getLogger(__name__)

SLIDERS = (viser.GuiSliderHandle, viser.GuiMultiSliderHandle)


class RefusedError(Exception):
    """A message that changes nothing; the text is for the log, or for the person if `shown`."""

    def __init__(self, why: str, *, shown: bool = False) -> None:
        super().__init__(why)
        self.shown = shown


class Guard:
    """The checks of one connection. A refused message changes nothing and closes nothing."""

    def __init__(
        self, browser: Callable[[], BrowserConnection | None], transfers: Transfers
    ) -> None:
        """`browser` returns the connection's window; None before viser announces it."""
        self._browser, self._transfers = browser, transfers
        self._explained = False

    async def admit(self, raw: bytes, message: Message) -> bytes | None:
        """The bytes that viser may read; None for a refused message."""
        if isinstance(message, Passive):
            return raw
        browser = self._browser()
        if browser is None:
            return None
        allowed = browser.may_use(message.widget)
        try:
            if not allowed:
                raise RefusedError("who follows changes nothing")
            changed = await self._checked(browser, message)
        except (RefusedError, msgspec.ValidationError) as refusal:
            kind = type(message).__name__
            log.debug("Client %d, %s: %s", browser.client.client_id, kind, refusal)
            self._answer(browser.client, message, allowed, refusal)
            return None
        browser.note_activity()
        return msgspec.msgpack.encode(message) if changed else raw

    def slider(self, message: Message) -> str | None:
        """The id of the slider that a message moves; None for other messages."""
        if isinstance(message, GuiUpdateMessage) and (browser := self._browser()) is not None:
            handle = browser.client.gui._gui_input_handle_from_uuid.get(message.uuid)
            return message.uuid if isinstance(handle, SLIDERS) else None
        return None

    async def _checked(self, browser: BrowserConnection, message: Message) -> bool:
        """Whether the message had to be changed; RefusedError if it is not allowed."""
        match message:
            case GuiUpdateMessage(uuid, updates):
                sent, updates.value = updates.value, checked(_usable(browser, uuid), updates.value)
                return bool(sent != updates.value)
            case GuiButtonHoldMessage(uuid):
                _usable(browser, uuid)
            case FileTransferStartUpload():
                if not isinstance(_usable(browser, message.widget), viser.GuiUploadButtonHandle):
                    raise RefusedError("an upload to something that takes none")
                # On another thread: it walks a folder.
                kept = await asyncio.to_thread(browser.kept_bytes)
                self._transfers.begin(browser, message, kept)
            case FileTransferPart():
                self._transfers.part(browser, message)
        return False

    def _answer(
        self, client: viser.ClientHandle, message: Message, allowed: bool, refusal: Exception
    ) -> None:
        """Informs the page about a refusal, where it would not notice it by itself."""
        match message:
            case FileTransferStartUpload():
                shown = isinstance(refusal, RefusedError) and refusal.shown
                sentence = str(refusal) if shown else "This page takes no files now."
                refuse_upload(client, message, sentence)
            case FileTransferPart():
                client.gui._current_file_upload_states.pop(message.transfer_uuid, None)
            case _ if not allowed:
                restore_value(client, message.widget or "")
                if not self._explained:
                    self._explained = True
                    explain_following(client)


def _usable(browser: BrowserConnection, uuid: str) -> Any:
    """The widget; RefusedError if it cannot be used."""
    handle = browser.client.gui._gui_input_handle_from_uuid.get(uuid)
    if handle is None or handle._impl.removed:
        raise RefusedError("no such widget")
    if getattr(handle, "disabled", False):
        raise RefusedError("the widget is disabled")
    return handle


SLACK = 1e-9
"""Relative tolerance of a range: browsers add up steps in floating point (0.1 + 0.2 > 0.3)."""

PlainText = Annotated[
    str, Meta(max_length=Limits.text_length, pattern=r"\A[^\x00-\x08\x0b\x0c\x0e-\x1f]*\Z")
]
"""Without control characters."""


@singledispatch
def checked(handle: Any, value: object) -> Any:
    """The checked value for the widget; RefusedError or ValidationError if not allowed."""
    raise RefusedError(f"a {type(handle).__name__} takes no value")


@checked.register(viser.GuiButtonHandle)
@checked.register(viser.GuiCheckboxHandle)
def _bool(handle: Any, value: object) -> bool:
    return convert(value, bool)


@checked.register(viser.GuiTextHandle)
def _text(handle: Any, value: object) -> str:
    return convert(value, PlainText)


@checked.register(viser.GuiDropdownHandle)
@checked.register(viser.GuiButtonGroupHandle)
def _option(handle: Any, value: object) -> str:
    option = convert(value, str)
    if option not in handle.options:
        raise RefusedError("none of the options")
    return option


@checked.register(viser.GuiSliderHandle)
@checked.register(viser.GuiNumberHandle)
def _number(handle: Any, value: object) -> float:
    return within(convert(value, Number), handle.min, handle.max)


@checked.register(viser.GuiMultiSliderHandle)
def _ascending(handle: Any, value: object) -> list[float]:
    n = len(handle.value)
    values = _numbers(value, (handle.min,) * n, (handle.max,) * n)
    if values != sorted(values):
        raise RefusedError("not in ascending order")
    return values


@checked.register(viser.GuiVector2Handle)
@checked.register(viser.GuiVector3Handle)
def _vector(handle: Any, value: object) -> list[float]:
    free = (None,) * len(handle.value)
    return _numbers(value, handle.min or free, handle.max or free)


@checked.register(viser.GuiRgbHandle)
@checked.register(viser.GuiRgbaHandle)
def _colour(handle: Any, value: object) -> list[float]:
    n = len(handle.value)
    return _numbers(value, (0,) * n, (255,) * n)


def _numbers(value: object, low: tuple[Any, ...], high: tuple[Any, ...]) -> list[float]:
    numbers = convert(value, list[Number])
    if len(numbers) != len(low):
        raise RefusedError(f"not a list of {len(low)}")
    return [within(*each) for each in zip(numbers, low, high, strict=True)]


def within(value: float, low: float | None, high: float | None) -> float:
    """The value, moved into its range from `low` to `high` in its unit if only rounding put it
    outside; else RefusedError."""
    slack = SLACK * max(abs(low or 0.0), abs(high or 0.0))
    if low is not None and value < low:
        if value < low - slack:
            raise RefusedError(f"{value!r} is less than {low!r}")
        return low
    if high is not None and value > high:
        if value > high + slack:
            raise RefusedError(f"{value!r} is more than {high!r}")
        return high
    return value


SMALLEST_PART = 64 * 1024
"""bytes; viser's client sends 512 KiB. Keeps a small file from having a million parts."""


class Transfers:
    """The uploads under way in all windows. The windows of a session share its limits; a window
    that has left holds nothing."""

    def __init__(self, limits: Limits, browsers: Mapping[int, BrowserConnection]) -> None:
        self._limits, self._browsers = limits, browsers

    def begin(self, browser: BrowserConnection, start: FileTransferStartUpload, kept: int) -> None:
        """`kept` bytes are stored already; RefusedError with a sentence above a limit."""
        limits, size, name = self._limits, start.size_bytes, short(start.filename)
        everybody = list(self._browsers.values())
        mine = [u for b in everybody if b.session is browser.session for u in b.uploads.values()]
        if size > limits.upload_bytes:
            most = megabytes(limits.upload_bytes)
            raise RefusedError(f"{name} has {megabytes(size)}; a file may have {most}.", shown=True)
        if kept + sum(u.size for u in mine) + size > limits.session_bytes:
            raise RefusedError(
                f"{name} is too large: the files of this session may have "
                f"{megabytes(limits.session_bytes)} in all.",
                shown=True,
            )
        if len(mine) >= limits.transfers:
            raise RefusedError(
                f"{limits.transfers} files are being uploaded; wait for them.", shown=True
            )
        if sum(u.size for b in everybody for u in b.uploads.values()) + size > limits.upload_memory:
            raise RefusedError(
                f"{name} has to wait: the server has no room for more uploads now. Try again in a "
                f"minute.",
                shown=True,
            )
        if start.transfer_uuid in browser.uploads or start.part_count > 1 + size // SMALLEST_PART:
            raise RefusedError("an upload in far too many parts, or one that has begun")
        if start.part_count:
            browser.uploads[start.transfer_uuid] = Upload(size, size)

    def part(self, browser: BrowserConnection, part: FileTransferPart) -> None:
        """RefusedError if the part was not announced or is too large: the file is to be dropped."""
        upload, size = browser.uploads.pop(part.transfer_uuid, Upload(0, 0)), len(part.content)
        if not 0 < size <= upload.left:
            raise RefusedError("a part that was not announced, or has more bytes than it said")
        if upload.left > size:
            browser.uploads[part.transfer_uuid] = Upload(upload.size, upload.left - size)


def megabytes(size: int) -> str:
    """A size in bytes as text: '100 MB' or '1.5 kB'."""
    return f"{size / MEGA:,.0f} MB" if size >= MEGA else f"{size / 1000:,.1f} kB"


def short(name: str, length: int = 60) -> str:
    """A file's name, shortened for a sentence."""
    plain = "".join(c if c.isprintable() else "?" for c in name)
    return plain if len(plain) <= length else plain[: length - 1] + "…"
