"""plotly.js without the kinds of traces that a page does not draw: a quarter of the whole."""

from __future__ import annotations

import re
from collections.abc import Set

HELPERS = re.compile(r"([\w$]+)=\(e,t,r\)=>\(\)=>.*?[ ,;]([\w$]+)=\(e,t\)=>\(\)=>.{0,60}exports")
"""Of its bundler (esbuild): what wraps an ECMAScript module, and what wraps one of CommonJS."""
REGISTERED = re.compile(r"\.register\(\[([\w$(),]+)\]\)")
"""The list of kinds, in the last module."""
KIND = re.compile(r'moduleType:"trace",name:"(\w+)"')
MODULE_NAME, LONGEST_MODULE_NAME = re.compile(r"[\w$]+$"), 12
"""Of a module, and its letters at most."""
CALL = "()"
"""A module is used by a call without arguments."""
PASSING = 80
"""Letters of a module that only passes another one on, at most."""


def with_traces(source: str, kinds: Set[str]) -> str:
    """plotly.js with scatter and `kinds` alone: the modules that they reach.

    The source as it is where it lacks a kind or is bundled in another way.
    """
    helpers = HELPERS.search(source)
    inner, outer = helpers.groups() if helpers else ("", "")
    start, *rest = re.split(rf"var ([\w$]+)={re.escape(outer)}\(", source) if outer else [source]
    registered = REGISTERED.search(rest[-1]) if rest else None
    if registered is None:
        return source
    modules = dict(zip(rest[::2], rest[1::2], strict=True))
    place = {name: name for name in modules}
    for name, text in modules.items():
        # One of CommonJS is followed by those of ECMAScript before the next.
        place |= dict.fromkeys(_before(f"={inner}(", text), name)
    entries = {_kind(modules, entry): entry for entry in _before(CALL, registered[1])}
    if not kinds <= entries.keys():
        return source
    wanted, last = ",".join(f"{entries[kind]}()" for kind in sorted(kinds)), rest[-2]
    modules[last] = modules[last].replace(registered[1], wanted)
    kept, found = set[str](), {last}
    while found:
        kept |= found
        calls = {call for name in found for call in _before(CALL, modules[name])}
        found = {place[call] for call in calls & place.keys()} - kept
    texts = (f"var {name}={outer}({modules[name]}" for name in modules if name in kept)
    return start + "".join(texts)


def _before(mark: str, text: str) -> list[str]:
    """The names that stand right before a mark; splitting is far quicker than searching them."""
    ends = (piece[-LONGEST_MODULE_NAME:] for piece in text.split(mark)[:-1])
    return [name[0] for end in ends if (name := MODULE_NAME.search(end))]


def _kind(modules: dict[str, str], entry: str) -> str:
    """Name of the kind of an entry, which may pass another one on; empty where none is stated."""
    text = modules.get(entry, "")
    if found := KIND.search(text):
        return found[1]
    passed = _before(CALL, text) if len(text) < PASSING else []
    return _kind(modules, passed[0]) if passed else ""
