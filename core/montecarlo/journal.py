"""What a study has found so far: one line of JSON per finished case, never lost."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from core.errors import InputError

Record = dict[str, Any]
"""`key`, `part`, `answer`, `seconds`."""

FORMAT = 1


class Journal:
    """Lines that are on the disk before they count; the last may be torn, and is done again."""

    def __init__(self, path: Path, identity: str) -> None:
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
            if not text:
                writer.line({"format": FORMAT, "study": self.identity})
            yield writer

    def _read(self) -> dict[str, Record]:
        if not self.path.exists():
            return {}
        try:
            lines = self.path.read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError as error:
            reason = error.strerror or str(error)
            raise InputError(f"{self.path} cannot be read: {reason}.") from error
        found = [record for record in map(_parsed, lines) if record is not None]
        head = next((r for r in found if "study" in r), None)
        if lines and (head is None or head["study"] != self.identity):
            raise InputError(
                f"{self.path} holds the results of another study; choose another --out or remove "
                f"the file."
            )
        return {r["key"]: r for r in found if {"key", "part", "answer"} <= r.keys()}


class Writer:
    """Appends lines to an open journal."""

    def __init__(self, file: TextIO, path: Path) -> None:
        self.file, self.path = file, path

    def line(self, record: Record) -> None:
        """On the disk when this returns."""
        with _refusing(self.path):
            self.file.write(json.dumps(record, allow_nan=False) + "\n")
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
