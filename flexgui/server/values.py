"""Which values a widget takes by its kind, as viser itself checks none, and which uploads are
refused when they are announced, before any of their bytes is kept."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import singledispatch
from pathlib import Path
from typing import Any

import viser

from flexgui.server.limits import MEGA, Limits

SLACK = 1e-9
"""Of a range: browsers add steps up in floating point (0.1 + 0.2 > 0.3)."""

PLAIN_CONTROLS = "\n\r\t"


@singledispatch
def checked(handle: Any, value: object) -> Any:
    """The value as the widget may have it; RefusedError where it may not."""
    raise RefusedError(f"a {type(handle).__name__} takes no value")


@checked.register(viser.GuiButtonHandle)
@checked.register(viser.GuiCheckboxHandle)
def _bool(handle: Any, value: object) -> bool:
    if not isinstance(value, bool):
        raise RefusedError("neither true nor false")
    return value


@checked.register(viser.GuiSliderHandle)
@checked.register(viser.GuiNumberHandle)
def _number(handle: Any, value: object) -> float:
    return within(value, handle.min, handle.max)


@checked.register(viser.GuiMultiSliderHandle)
def _numbers(handle: Any, value: object) -> list[float]:
    numbers = [within(v, handle.min, handle.max) for v in items(value, len(handle.value))]
    if any(b < a for a, b in zip(numbers, numbers[1:], strict=False)):
        raise RefusedError("not in ascending order")
    return numbers


@checked.register(viser.GuiVector2Handle)
@checked.register(viser.GuiVector3Handle)
def _vector(handle: Any, value: object) -> list[float]:
    n = len(handle.value)
    low, high = handle.min or (None,) * n, handle.max or (None,) * n
    return [within(*each) for each in zip(items(value, n), low, high, strict=True)]


@checked.register(viser.GuiRgbHandle)
@checked.register(viser.GuiRgbaHandle)
def _colour(handle: Any, value: object) -> list[float]:
    return [within(v, 0, 255) for v in items(value, len(handle.value))]


@checked.register(viser.GuiDropdownHandle)
@checked.register(viser.GuiButtonGroupHandle)
def _option(handle: Any, value: object) -> str:
    if not isinstance(value, str) or value not in handle.options:
        raise RefusedError("none of the options")
    return value


@checked.register(viser.GuiTextHandle)
def _text(handle: Any, value: object) -> str:
    if not isinstance(value, str) or len(value) > Limits.text_length:
        raise RefusedError("no text, or a very long one")
    if any(c < " " and c not in PLAIN_CONTROLS for c in value):
        raise RefusedError("a text with control characters")
    return value


def number(value: object) -> float:
    """A finite number that is no bool."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise RefusedError("no finite number")
    return value


def within(value: object, low: float | None, high: float | None) -> float:
    """A number in its range, pulled back where it lies outside by rounding only."""
    found = number(value)
    slack = SLACK * max(abs(low or 0.0), abs(high or 0.0))
    if low is not None and found < low:
        if found < low - slack:
            raise RefusedError(f"{found!r} is less than {low!r}")
        return low
    if high is not None and found > high:
        if found > high + slack:
            raise RefusedError(f"{found!r} is more than {high!r}")
        return high
    return found


def items(value: object, n: int) -> Sequence[object]:
    """A list of n."""
    if not isinstance(value, list) or len(value) != n:
        raise RefusedError(f"not a list of {n}")
    return value


class RefusedError(Exception):
    """A message that changes nothing; the text is for the log, or for the person if `shown`."""

    def __init__(self, why: str, *, shown: bool = False) -> None:
        super().__init__(why)
        self.shown = shown


SMALLEST_PART = 64 * 1024
"""bytes; viser's client sends 512 KiB. Keeps a small file from having a million parts."""


class Transfers:
    """The uploads of one connection: announced bytes that have not arrived yet."""

    def __init__(self, limits: Limits, kept_bytes: Callable[[], int]) -> None:
        self._limits, self._kept_bytes = limits, kept_bytes
        self._left: dict[str, int] = {}

    def begin(self, message: dict[str, Any]) -> None:
        """RefusedError with a sentence for the person where it is too much."""
        size, name = message["size_bytes"], short(message["filename"])
        if size > self._limits.upload_bytes:
            raise RefusedError(
                f"{name} has {megabytes(size)}; a file may have "
                f"{megabytes(self._limits.upload_bytes)}.",
                shown=True,
            )
        under_way = sum(self._left.values())
        if self._kept_bytes() + under_way + size > self._limits.session_bytes:
            raise RefusedError(
                f"With {name} the files of this session would exceed "
                f"{megabytes(self._limits.session_bytes)}, which is its limit.",
                shown=True,
            )
        if len(self._left) >= self._limits.transfers:
            raise RefusedError(
                f"{self._limits.transfers} files are on their way already; wait for them.",
                shown=True,
            )
        if message["transfer_uuid"] in self._left or message["part_count"] > 1 + size // (
            SMALLEST_PART
        ):
            raise RefusedError("an upload in far too many parts, or one that has begun")
        if message["part_count"]:
            self._left[message["transfer_uuid"]] = size

    def part(self, message: dict[str, Any]) -> None:
        """RefusedError where it was not announced, or is more than was."""
        transfer, size = message["transfer_uuid"], len(message["content"])
        left = self._left.get(transfer)
        if left is None:
            raise RefusedError("a part of an upload that was not announced")
        if size > left or size == 0:
            del self._left[transfer]
            raise OverrunError(transfer)
        if left == size:
            del self._left[transfer]
        else:
            self._left[transfer] = left - size


class OverrunError(RefusedError):
    """More bytes than were announced: what has come of the file is to be dropped."""

    def __init__(self, transfer: str) -> None:
        super().__init__("an upload with more bytes than it said")
        self.transfer = transfer


def megabytes(size: int) -> str:
    """In words."""
    return f"{size / MEGA:,.0f} MB" if size >= MEGA else f"{size / 1000:,.1f} kB"


def short(name: str, length: int = 60) -> str:
    """A file's name that fits into a sentence."""
    plain = "".join(c if c.isprintable() else "?" for c in name)
    return plain if len(plain) <= length else plain[: length - 1] + "…"


def folder_bytes(folder: Path) -> int:
    """Of all files in it."""
    total = 0
    for path in folder.rglob("*"):
        try:
            total += path.lstat().st_size
        except OSError:  # gone meanwhile
            continue
    return total
