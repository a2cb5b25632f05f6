"""What has been found so far, one line of JSON per finished case, and how the next call goes on."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TextIO, TypeVar

from ..errors import InputError
from ..resumable.executor import Executor, Stop, Work, never

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
            raise InputError(f"{self.path} cannot be read: {reason}.") from None
        records = [r for r in map(_parsed, text.splitlines()) if r is not None]
        head = next((r["study"] for r in records if "study" in r), None)
        if text and (head != self.identity or not text.startswith("{")):
            raise InputError(
                f"{self.path} has other content, perhaps the results of another study; choose "
                f"another --out or remove the file."
            )
        return {r["key"]: r for r in records if "key" in r}


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
        raise InputError(f"{path} cannot be written: {reason}.") from None


def _parsed(line: str) -> Record | None:
    try:
        record = json.loads(line)
    except json.JSONDecodeError:
        return None
    return record if isinstance(record, dict) else None


class Keyed(Protocol):
    """A case: one piece of work, independent of all others."""

    @property
    def key(self) -> str:
        """Names its result."""


C = TypeVar("C", bound=Keyed)


@dataclass(frozen=True)
class Finished:
    """One case is done."""

    record: Record
    done: int
    total: int
    before: bool
    """Whether an earlier run had found it."""


def resume(
    cases: Sequence[C],
    order: Callable[[C], str],
    work: Work,
    executor: Executor,
    journal: Journal | None = None,
    stop: Stop = never,
) -> Generator[Finished, None, None]:
    """Yields every case once: first what the journal holds, then the others as they come.

    `order` writes down what `work` needs to know of a case. What comes is in the journal before it
    is yielded. `stop` is asked several times a second; closing the generator stops too. The same
    call goes on where it stopped.
    """
    records = journal.records if journal is not None else {}
    before = [records[case.key] for case in cases if case.key in records]
    open_cases = [case for case in cases if case.key not in records]
    for done, record in enumerate(before, start=1):
        yield Finished(record, done, len(cases), True)
    if not open_cases or stop():
        return
    answers = executor.answers(work, [order(case) for case in open_cases], stop)
    with (
        closing(answers),
        journal.writing() if journal is not None else nullcontext() as writer,
    ):
        for done, (_, text) in enumerate(answers, start=len(before) + 1):
            if writer is not None:
                writer.line(text)
            yield Finished(json.loads(text), done, len(cases), False)
