"""From TOML to a checked scenario, and back."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w
from pydantic import ValidationError

from ..arm.build import build_arm
from ..errors import InputError
from ..files import replacing
from ..scenario.data_folder import refuse_special
from ..scenario.schema import Scenario
from ..sentences import one_line, validation_sentence

LONGEST_SCENARIO = 500_000
"""Characters: a scenario with as many recordings as it may have, everything said of each."""
MOST_VALUES, MOST_PARTS, DEEPEST = 50_000, 32, 32
"""Keys, lists and their entries in a scenario (500 recordings of a hundred each), parts of one
dotted key, and brackets in brackets (the schema has six at most). Reading takes time with the
square of a key's parts and of its header's: without bounds, 500,000 characters took hours."""

_TOKEN = re.compile(
    r""" "{3}(?:[^\\"]|\\.|"(?!""))*"{3,5} | "(?!"")(?:[^"\\\n]|\\.)*" |
    '{3}(?:[^']|'(?!''))*'{3,5} | '(?!'')[^'\n]*' |
    \#[^\n]* | [^"'#.=,\[\]{}\n]+ | . """,
    re.DOTALL | re.VERBOSE,
)
"""A text, a comment, a run of what does not matter, or one character. Each character fits in one
way, so that no text is tried often. No possessive quantifiers: Python 3.11.2 now and then
misses a match with them."""


def read_scenario(path: Path) -> Scenario:
    """The scenario in a TOML file; InputError where there is none."""
    if path.is_dir():
        raise InputError(one_line(f"{path} is a folder; name the scenario file in it."))
    if not path.exists():
        raise InputError(one_line(f"{path} does not exist; check the name and the folder."))
    refuse_special(path)
    try:
        with path.open(encoding="utf-8-sig") as file:
            text = file.read(LONGEST_SCENARIO + 1)
    except UnicodeDecodeError:
        raise InputError(f"{path.name} is not UTF-8 text; save it as UTF-8.") from None
    except OSError as error:
        raise InputError(f"{path.name} cannot be read: {error.strerror or error}.") from None
    return parse_scenario(text, path.name)


def parse_scenario(text: str, source: str) -> Scenario:
    """The scenario in a TOML text, else InputError; `source` is how messages name where it comes
    from."""
    if len(text) > LONGEST_SCENARIO:
        raise InputError(
            f"{source} has more than {LONGEST_SCENARIO:,} characters; store recordings in files of "
            f"their own and write their names."
        )
    _check_extent(text, source)
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(one_line(f"{source} is not valid TOML: {error}.")) from None
    except (RecursionError, ValueError):
        raise InputError(
            f"{source} is not valid TOML; it is nested too deeply or is too long."
        ) from None
    return check_scenario(document, source)


def _check_extent(text: str, source: str) -> None:
    """InputError where reading a TOML text could take long, before it is tried."""
    values = parts = depth = 0
    for token in _TOKEN.finditer(text):
        symbol = token[0]
        if symbol in "\"'":  # a text without an end: nothing behind it will be read
            return
        values += symbol in "=,[{"
        depth += (symbol in "[{") - (symbol in "]}")
        parts = parts + 1 if symbol == "." else 0 if symbol in "=,[]{}\n" else parts
        if parts > MOST_PARTS or depth > DEEPEST:
            raise InputError(f"{source} is not valid TOML; it is nested too deeply or is too long.")
        if values > MOST_VALUES:
            raise InputError(
                f"{source} has more than {MOST_VALUES:,} values; store recordings in files of "
                f"their own and write their names."
            )


def check_scenario(document: Mapping[str, Any], source: str) -> Scenario:
    """The scenario in a document of tables, lists, texts and numbers; InputError for a wrong
    setting."""
    try:
        scenario = Scenario.model_validate(dict(document))
    except ValidationError as error:
        raise InputError(f"{source}: {validation_sentence(error, Scenario)}") from None
    try:
        arm = build_arm(scenario.arm)
        for k, variant in enumerate(scenario.compare):
            if variant.arm is not None:
                build_arm(variant.arm, arm, f"[[compare]] {k + 1} arm")
    except InputError as error:
        raise InputError(one_line(f"{source}: {error}")) from None
    return scenario


def write_scenario(scenario: Scenario, path: Path) -> None:
    """Write a file that `read_scenario` reads back as an equal scenario."""
    with replacing(path) as temporary:
        temporary.write_text(scenario_toml(scenario), encoding="utf-8")


def scenario_toml(scenario: Scenario) -> str:
    """The scenario as TOML: what differs from the defaults, as a person would write it."""
    return document_toml(scenario.model_dump(exclude_defaults=True))


def document_toml(document: Mapping[str, Any]) -> str:
    """A scenario's tables as TOML, tables that are empty too."""
    return _SHORT_LIST.sub(_on_one_line, tomli_w.dumps(_plain(dict(document))))


_SHORT_LIST = re.compile(r"\[\n((?: +[^\n\[\]{}]+,\n)+) *\]")
"""A list of numbers or words as tomli_w writes it, one entry per line."""
_WIDTH = 80


def _on_one_line(match: re.Match[str]) -> str:
    entries = [line.strip() for line in match[1].split("\n") if line]
    line = "[" + " ".join(entries).removesuffix(",") + "]"
    return line if len(line) <= _WIDTH else match[0]


def _plain(value: Any) -> Any:
    """Without tuples and without None, which TOML lacks."""
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items() if v is not None}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return value
