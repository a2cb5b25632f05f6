"""Edits that put effects into a scenario's model and take them out."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from core.effects import catalogue, effect
from core.errors import InputError
from core.results import RankedEffect
from core.scenario.schema import Scenario
from flexgui.session.edit import Document, Edit

LEAST = 1e-9
"""A fitted size that is smaller, as a share of a plausible one, starts at the plausible one."""

_PARAMETER = re.compile(r"\s*([A-Za-z]\w*)\s*=\s*([-+0-9.eE]+)\s*(?:\[([^\]]*)\]|(.*?))\s*")


def with_effect(kind: str, ranked: RankedEffect | None) -> Edit:
    """Adds a listed effect, from the sizes that the ranking has found where there are any."""
    effect(kind)
    sizes = {e.name: e.value for e in ranked.parameters} if ranked is not None else {}
    known = any(abs(value) > LEAST for value in sizes.values())
    starts = {name: {"start": float(v), "vary": True} for name, v in sizes.items()} if known else {}

    def edit(document: Document) -> None:
        entries = document.setdefault("model", {}).setdefault("effects", [])
        # What an included effect has been given already is its own.
        given = {name for entry in entries for name in entry}
        fresh = {name: start for name, start in starts.items() if name not in given}
        entries.append({"id": kind} | fresh)

    return edit


def with_own(target: str, formula: str, parameters: str) -> Edit:
    """Adds an effect that a person wrote; InputError where its parameters cannot be read."""
    own: dict[str, Any] = {"target": target, "formula": formula.strip()}
    own["parameters"] = own_parameters(parameters)

    def edit(document: Document) -> None:
        mine = document.setdefault("model", {}).setdefault("own", [])
        number = 1 + max((int(re.sub(r"\D", "", o.get("id", "")) or 0) for o in mine), default=0)
        mine.append(own | {"id": f"own_{number}", "title": f"Own effect {number} at {target}"})

    return edit


def own_parameters(text: str) -> dict[str, dict[str, Any]]:
    """'b = 0.5 [N m], c = 2' -> name -> start and unit."""
    found: dict[str, dict[str, Any]] = {}
    for part in filter(str.strip, text.split(",")):
        match = _PARAMETER.fullmatch(part)
        try:
            start = float(match[2]) if match else None
        except ValueError:
            start = None
        if match is None or start is None:
            raise InputError(
                f"The parameter {part.strip()!r} cannot be read; write name = start [unit], with "
                f"commas between them, such as b = 0.5 [N m]."
            )
        found[match[1]] = {"start": start, "unit": (match[3] or match[4] or "").strip()}
    return found


def without_effect(kind: str) -> Edit:
    """Takes out the last effect of that id, listed or own."""

    def edit(document: Document) -> None:
        model = document.get("model", {})
        for table in ("effects", "own"):
            entries = model.get(table, [])
            places = [k for k, entry in enumerate(entries) if entry.get("id") == kind]
            if places:
                entries.pop(places[-1])
            if not entries:
                model.pop(table, None)

    return edit


def present(scenario: Scenario) -> tuple[tuple[str, str], ...]:
    """(id, title) of the effects in the model, as they were added."""
    known = catalogue()
    listed = [(e.id, known[e.id].title if e.id in known else e.id) for e in scenario.model.effects]
    own = [(o.id or "", o.title or o.id or "own effect") for o in scenario.model.own]
    return (*listed, *own)


def places(scenario: Scenario) -> tuple[tuple[str, str], ...]:
    """(title, where it acts) of the effects in the model."""
    known = catalogue()
    listed = [(known[e.id].title, known[e.id].acts_at) for e in scenario.model.effects]
    own = [(o.title or "own effect", "tip" if o.target.startswith("tip") else "joints")
           for o in scenario.model.own]  # fmt: skip
    return (*listed, *own)


def titled(kinds: Sequence[str]) -> list[str]:
    """Titles of effects by their ids."""
    known = catalogue()
    return [known[kind].title if kind in known else kind for kind in kinds]
