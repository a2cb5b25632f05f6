"""Checked construction of settings: a pydantic error becomes one sentence."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from core.errors import InputError
from core.sentences import did_you_mean, one_line, predicate

M = TypeVar("M", bound=BaseModel)


def gathered(table: Any, beside: Callable[[str], bool], field: str) -> Any:
    """A table of a file with the keys that belong into one field put there.

    Args:
        table: As the file states it; what is no table is left as it is.
        beside: Whether a key belongs into the field.
        field: Its name.
    """
    if not isinstance(table, dict):
        return table
    found = {k: v for k, v in table.items() if beside(k)}
    rest = {k: v for k, v in table.items() if not beside(k)}
    return {**rest, field: {**rest.get(field, {}), **found}} if found else rest


def validated(
    kind: type[M], options: Mapping[str, Any], where: str, beside: Iterable[str] = ()
) -> M:
    """`kind(**options)`; the first fault is said in one sentence that starts with `where`.

    `beside` are settings that stand in the same place and are not the options' own.
    """
    try:
        return kind.model_validate(dict(options))
    except ValidationError as error:
        faults: list[Any] = list(error.errors(include_url=False))
        fault = next((f for f in faults if f["type"] == "extra_forbidden"), faults[0])
        key = ".".join(str(part) for part in fault["loc"])
        if fault["type"] == "extra_forbidden":
            hint = did_you_mean(str(fault["loc"][-1]), [*kind.model_fields, *beside])
            text = f"{where} {key} is not a setting; {hint}"
        else:
            text = f"{where} {key} {predicate(fault)}"
        raise InputError(one_line(text)) from None
