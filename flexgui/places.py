"""Sentences for a browser do not say where the server keeps what."""

from __future__ import annotations

import re
import sys
import tempfile
from functools import cache
from pathlib import Path

_ROOT = Path(__file__).resolve().parents[1]
_BELOW = r"(?=[/\\\s'\",;:.]|$)(?:[/\\][^/\\\s'\",;:]*)*"
"""The rest of a path after one of its folders."""


def without_places(text: str, *folders: Path) -> str:
    """The text with only the last part of each path below `folders` or the server's own places."""
    for folder in (*map(str, folders), *_own()):
        text = re.sub(re.escape(folder) + _BELOW, lambda found: _last(found[0]), text)
    return text


def _last(path: str) -> str:
    return re.split(r"[/\\]", path.rstrip("/\\"))[-1]


@cache
def _own() -> tuple[str, ...]:
    """The longest first: one may lie in another."""
    found = {tempfile.gettempdir(), str(Path.home()), sys.prefix, sys.base_prefix, str(_ROOT)}
    return tuple(sorted((each for each in found if len(Path(each).parts) > 1), key=len)[::-1])
