"""What has been found so far: one line of JSON per finished case, never lost."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from core.errors import InputError

Record = dict[str, Any]
"""Plain values; `key` says of which case."""

FORMAT = 1


class Journal:
    """Lines that are on the disk before they count; the last may be torn, and is done again.

    Results of different studies have the same keys where a study has settings: its `identity`
    then heads the file, and results under another one are refused.
    """

    def __init__(self, path: Path, identity: str | None = None) -> None:
        self.path, self.identity = path, identity
        self.records = self._read()

    @contextmanager
    def writing(self) -> Iterator[Writer]:
        """Opens the file for further lines."""
        with _refusing(self.path):
            self.path.parent.mkdir(parents=True, exist_ok=True)
            file = self.path.open("a", encoding="utf-8")
        with file:
            writer = Writer(file, self.path)
            with _refusing(self.path):
                text = self.path.read_bytes()
                if text and not text.endswith(b"\n"):
                    file.write("\n")
            if not text and self.identity is not None:
                writer.line(json.dumps({"format": FORMAT, "study": self.identity}))
            yield writer

    def _read(self) -> dict[str, Record]:
        if not self.path.exists():
            return {}
        try:
            text = self.path.read_text(encoding="utf-8", errors="replace")
        except OSError as error:
            reason = error.strerror or str(error)
            raise InputError(f"{self.path} cannot be read: {reason}.") from error
        found = [r for r in map(_parsed, text.splitlines()) if r is not None]
        head = next((r["study"] for r in found if "study" in r), None)
        if text and (head != self.identity or not text.startswith("{")):
            raise InputError(
                f"{self.path} holds something else, perhaps the results of another study; choose "
                f"another --out or remove the file."
            )
        return {r["key"]: r for r in found if "key" in r}


class Writer:
    """Appends lines to an open journal."""

    def __init__(self, file: TextIO, path: Path) -> None:
        self.file, self.path = file, path

    def line(self, text: str) -> None:
        """On the disk when this returns."""
        with _refusing(self.path):
            self.file.write(text + "\n")
            self.file.flush()
            os.fsync(self.file.fileno())


@contextmanager
def _refusing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"{path} cannot be written: {reason}.") from error


def _parsed(line: str) -> Record | None:
    try:
        found = json.loads(line)
    except json.JSONDecodeError:
        return None
    return found if isinstance(found, dict) else None
