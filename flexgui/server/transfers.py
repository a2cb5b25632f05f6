"""Uploads: refused when they are announced, before any of their bytes is kept."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from flexgui.server.limits import MEGA, Limits
from flexgui.server.values import RefusedError

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
                tell=True,
            )
        under_way = sum(self._left.values())
        if self._kept_bytes() + under_way + size > self._limits.session_bytes:
            raise RefusedError(
                f"With {name} the files of this session would exceed "
                f"{megabytes(self._limits.session_bytes)}, which is its limit.",
                tell=True,
            )
        if len(self._left) >= self._limits.transfers:
            raise RefusedError(
                f"{self._limits.transfers} files are on their way already; wait for them.",
                tell=True,
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
