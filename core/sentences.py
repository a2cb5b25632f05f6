"""One sentence from a failed check of settings: which one, what is wrong, what to do."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from difflib import get_close_matches
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

LONGEST_SENTENCE = 300
"""Characters of a sentence that somebody still reads to its end."""
LONGEST_LIST = 150
"""Characters of the names that are offered where a name is wrong."""
LONGEST_QUOTE = 60
"""Characters of the user's own value that are repeated; a whole table would bury the rest."""


def one_line(text: str) -> str:
    """The text with every run of white space (also in quoted names) as one blank."""
    return " ".join(text.split())


def brief(text: str) -> str:
    """One line, at most LONGEST_SENTENCE long: very long names and lists lose their middle."""
    words = one_line(text).split(" ")
    if sum(map(len, words)) + len(words) > LONGEST_SENTENCE:
        words = [_cut(word, LONGEST_QUOTE) for word in words]
    return _cut(" ".join(words), LONGEST_SENTENCE)


def _cut(text: str, length: int) -> str:
    """Without its middle where it is longer than that."""
    if len(text) <= length:
        return text
    head = (2 * length) // 3
    return f"{text[: head - 1]}…{text[head - length :]}"


def first_sentence(text: str) -> str:
    """Up to the first full stop that ends a sentence."""
    head, stop, _ = one_line(text).partition(". ")
    return head + stop.strip()


def listed(parts: Sequence[str], last: str = "and") -> str:
    """`a, b and c`"""
    if len(parts) < 2:
        return "".join(parts)
    return f"{', '.join(parts[:-1])} {last} {parts[-1]}"


def quoted(value: Any) -> str:
    """The user's value, shortened, as it is repeated in a message."""
    text = one_line(repr(value))
    return text if len(text) <= LONGEST_QUOTE else text[: LONGEST_QUOTE - 3] + "..."


def install_command(extra: str) -> str:
    """Return the command that adds an extra of FlexGUI to this environment.

    FlexGUI is there already, from a clone or a wheel, so pip only adds the packages of the extra.
    """
    return f"{sys.executable} -m pip install 'flexgui-arm[{extra}]'"


def did_you_mean(name: str, candidates: Iterable[str]) -> str:
    """`did you mean 'x'?` with the known name that this one misspells, or a word of it; all of them
    where it misspells none."""
    names = sorted(candidates)
    if not names:
        return "leave it out."
    lowered = {x.lower(): x for x in names if len(x) <= LONGEST_QUOTE}
    words = {word: lowered[x] for x in reversed(lowered) for word in re.split("[_/]", x)}
    known = {**words, **lowered}
    matches = get_close_matches(name[:LONGEST_QUOTE].lower(), known, n=1, cutoff=0.65)
    return f"did you mean {known[matches[0]]!r}?" if matches else f"known: {few(names)}."


def few(names: Sequence[str]) -> str:
    """`a, b, c`, of long lists the first and how many more there are."""
    shown: list[str] = []
    for name in names:
        if shown and sum(map(len, shown)) + 2 * len(shown) + len(name) > LONGEST_LIST:
            return f"{', '.join(shown)} and {len(names) - len(shown):,} more"
        shown.append(_cut(name, LONGEST_QUOTE))
    return ", ".join(shown)


def predicate(error: Mapping[str, Any]) -> str:
    """What is wrong with one setting, as the rest of a sentence that starts with its name."""
    kind = str(error["type"])
    return _PREDICATES.get(kind, _other)(error)


def validation_sentence(error: ValidationError, root: type[BaseModel]) -> str:
    """The sentence for the first fault of a document checked against `root`.

    A misspelt key often leaves a required one missing; the misspelling is then the one to name.
    """
    faults: list[Any] = list(error.errors(include_url=False))
    fault = next((f for f in faults if f["type"] == "extra_forbidden"), faults[0])
    key = setting_name(fault["loc"], root)
    if fault["type"] == "extra_forbidden":
        settings = _settings_at(root, fault["loc"][:-1])
        return one_line(f"{key} is not a setting; {did_you_mean(str(fault['loc'][-1]), settings)}")
    return one_line(f"{key} {predicate(fault)}".strip())


def setting_name(location: Iterable[str | int], root: type[BaseModel]) -> str:
    """`[identify] population`, `[[recordings]] 2 simulate.seconds` or plain `title`."""
    parts = [part for part in _keys(location, root) if part != "[key]"]  # a mark for a bad key
    if not parts:
        return "The document"
    head, inner = str(parts[0]), parts[1:]
    field = root.model_fields.get(head)
    if field is not None and _model_in(field.annotation) is not None:
        array = get_origin(field.annotation) is tuple
        head = f"[[{head}]]" if array else f"[{head}]"
        if array and inner:
            head, inner = f"{head} {int(inner[0]) + 1}", inner[1:]
    keys = ".".join(str(p) for p in inner if isinstance(p, str))
    entries = "".join(f" entry {p + 1}" for p in inner if isinstance(p, int))
    return f"{head} {keys}{entries}".replace("  ", " ").strip()


def _keys(location: Iterable[str | int], root: type[BaseModel]) -> list[str | int]:
    """The location without the alternatives of a union: pydantic names the one it tried."""
    keys: list[str | int] = []
    model: type[BaseModel] | None = root
    for part in location:
        if model is not None and part == model.__name__:
            continue
        keys.append(part)
        if model is not None and isinstance(part, str) and part in model.model_fields:
            model = _model_in(model.model_fields[part].annotation)
    return keys


def _settings_at(root: type[BaseModel], location: Iterable[str | int]) -> list[str]:
    model: type[BaseModel] | None = root
    for part in location:
        if model is None:
            return []
        if isinstance(part, str) and part in model.model_fields:
            model = _model_in(model.model_fields[part].annotation)
    if model is None:
        return []
    known_settings = getattr(model, "known_settings", None)
    return list(model.model_fields) if known_settings is None else list(known_settings())


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((m for m in map(_model_in, get_args(annotation)) if m is not None), None)


def _is(text: str) -> Callable[[Mapping[str, Any]], str]:
    def sentence(error: Mapping[str, Any]) -> str:
        limits = {k: _plain(v) for k, v in error.get("ctx", {}).items()}
        return f"is {quoted(error['input'])}; it must be {text.format(**limits)}."

    return sentence


def _plain(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _entries(error: Mapping[str, Any]) -> str:
    limits = error["ctx"]
    least, most = limits.get("min_length"), limits.get("max_length")
    bound = f"at least {least}" if least is not None else f"at most {most}"
    return f"has {limits['actual_length']} entries; give {bound}."


def _missing(error: Mapping[str, Any]) -> str:
    if isinstance(error["loc"][-1], int):
        return "is missing; the list is too short."
    return "is missing; add it."


def _own_sentence(error: Mapping[str, Any]) -> str:
    return str(error["ctx"]["error"])


def _other(error: Mapping[str, Any]) -> str:
    return f"is {quoted(error['input'])}: {error['msg']}."


_PREDICATES: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "missing": _missing,
    "value_error": _own_sentence,
    "too_short": _entries,
    "too_long": _entries,
    "greater_than": _is("greater than {gt}"),
    "greater_than_equal": _is("at least {ge}"),
    "less_than": _is("less than {lt}"),
    "less_than_equal": _is("at most {le}"),
    "literal_error": _is("{expected}"),
    "finite_number": _is("a finite number"),
    "float_type": _is("a number"),
    "float_parsing": _is("a number"),
    "int_type": _is("a whole number"),
    "int_parsing": _is("a whole number"),
    "int_from_float": _is("a whole number"),
    "int_parsing_size": _is("a smaller whole number"),
    "bool_type": _is("true or false"),
    "string_type": _is("a text in quotes"),
    "string_too_short": _is("a text that is not empty"),
    "dict_type": _is("a table of settings"),
    "model_type": _is("a table of settings"),
    "model_attributes_type": _is("a table of settings"),
    "tuple_type": _is("a list"),
    "list_type": _is("a list"),
}
