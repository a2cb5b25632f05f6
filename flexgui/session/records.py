"""Frozen records as bytes and back: a tree of plain values beside its arrays, never a pickle."""

from __future__ import annotations

import dataclasses
import io
import json
import zlib
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

import numpy as np

from flexgui.classroom.challenging import Challenge, Revealed
from flexgui.classroom.judging import Guess, Judged, Judgement
from flexgui.core import results
from flexgui.core.errors import InputError
from flexgui.core.scenario.schema import Scenario
from flexgui.session.edit import text_of
from flexgui.stages.diagnose.look import Look
from flexgui.stages.diagnose.looked import Looked
from flexgui.views.over_speed import OverSpeed

TREE = "tree"
"""The name of the tree among the arrays."""
ARCHIVE = b"PK"
"""How an archive begins; a tree without arrays is text after its checksum."""
KIND, VALUE, NUMBER = "$", "v", "n"
T = TypeVar("T")

_RECORDS: dict[str, type] = {
    each.__name__: each
    for each in (
        *(getattr(results, name) for name in results.__all__),
        OverSpeed, Looked, Look, Challenge, Revealed, Guess, Judged, Judgement,
    )
    if isinstance(each, type)
}  # fmt: skip
"""What may stand in a file; anything else in one is damage."""


def packed(value: Any) -> bytes:
    """Of records, mappings, tuples, lists, arrays, scenarios, texts and numbers."""
    return _Packing().run(value)


def unpacked(content: bytes) -> Any:
    """What was packed; InputError where the bytes are not what `packed` gave."""
    try:
        found: dict[str, np.ndarray] = {}
        if content.startswith(ARCHIVE):
            with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
                found = {name: arrays[name] for name in arrays.files}
            text = found.pop(TREE).tobytes()
        else:
            text = _checked(content)
        return _Unpacking(found).value(json.loads(text))
    except InputError:  # a setting that this version does not know
        raise
    except Exception as error:  # zipfile and zlib have errors of their own
        raise InputError("the stored work is damaged.") from error


def _summed(text: bytes) -> bytes:
    """With its checksum before it, as an archive has of its members."""
    return b"%08x\n%s" % (zlib.crc32(text), text)


def _checked(content: bytes) -> bytes:
    """What was summed; ValueError where it has changed since."""
    text = content.partition(b"\n")[2]
    if _summed(text) != content:
        raise ValueError("another checksum")
    return text


class _Packing:
    """Arrays and records that several hold are written once."""

    def __init__(self) -> None:
        self._arrays: dict[str, np.ndarray] = {}
        self._names: dict[int, str] = {}
        self._numbers: dict[int, int] = {}

    def run(self, value: Any) -> bytes:
        tree = json.dumps(self.value(value)).encode()
        if not self._arrays:  # as a slider's every move: an archive takes ten times as long
            return _summed(tree)
        buffer = io.BytesIO()
        everything: dict[str, Any] = {TREE: np.frombuffer(tree, dtype=np.uint8), **self._arrays}
        np.savez(buffer, **everything)
        return buffer.getvalue()

    def value(self, value: Any) -> Any:
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, np.ndarray):
            return {KIND: "array", VALUE: self._array(value)}
        if isinstance(value, np.generic):
            return self.value(value.item())
        if isinstance(value, Scenario):
            return {KIND: "scenario", VALUE: text_of(value)}
        if isinstance(value, Mapping):
            return {KIND: "map", VALUE: [[self.value(k), self.value(v)] for k, v in value.items()]}
        if isinstance(value, tuple):
            return {KIND: "tuple", VALUE: self._each(value)}
        if isinstance(value, list):
            return self._each(value)
        return self._record(value)

    def _each(self, values: Iterable[Any]) -> list[Any]:
        return [self.value(each) for each in values]

    def _record(self, value: Any) -> dict[str, Any]:
        name = str(type(value).__name__)
        if _RECORDS.get(name) is not type(value) or not dataclasses.is_dataclass(value):
            raise TypeError(f"{type(value)} is no record that is kept")
        if id(value) in self._numbers:
            return {KIND: "again", VALUE: self._numbers[id(value)]}
        number = self._numbers[id(value)] = len(self._numbers)
        fields = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
        return {KIND: name, NUMBER: number, VALUE: {k: self.value(v) for k, v in fields.items()}}

    def _array(self, value: np.ndarray) -> str:
        if value.dtype == object:
            raise TypeError("an array of objects is not kept")
        name = self._names.setdefault(id(value), f"a{len(self._names)}")
        self._arrays[name] = value
        return name


class _Unpacking:
    def __init__(self, arrays: Mapping[str, np.ndarray]) -> None:
        self._arrays = arrays
        self._kinds: dict[str, Callable[[Any], Any]] = {
            "array": lambda name: self._arrays[name],
            "tuple": lambda values: tuple(self.value(v) for v in values),
            "map": lambda pairs: {self.value(k): self.value(v) for k, v in pairs},
            "scenario": _scenario,
            "again": lambda number: self._made[number],
        }
        self._made: dict[int, Any] = {}

    def value(self, tree: Any) -> Any:
        if isinstance(tree, list):
            return [self.value(each) for each in tree]
        if not isinstance(tree, dict):
            return tree
        make = self._kinds.get(tree[KIND])
        return self._record(tree) if make is None else make(tree[VALUE])

    def _record(self, tree: dict[str, Any]) -> Any:
        fields = {k: self.value(v) for k, v in tree[VALUE].items()}
        found = self._made[tree[NUMBER]] = known(_RECORDS[tree[KIND]], fields)
        return found


def known(record: Callable[..., T], fields: Mapping[str, Any]) -> T:
    """A record of what it knows among the fields, as another version may have written more or
    fewer; TypeError where one without a default is missing."""
    names = {f.name for f in dataclasses.fields(record)}  # type: ignore[arg-type]
    return record(**{name: value for name, value in fields.items() if name in names})


def _scenario(text: str) -> Scenario:
    from flexgui.core.scenario.read import parse_scenario

    return parse_scenario(text, "What was kept")
