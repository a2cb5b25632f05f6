"""Edits that add effects to a model or remove them, and the rank of an own effect."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from flexgui.core.effects import catalogue, effect
from flexgui.core.errors import InputError
from flexgui.core.results import Event, ProposedLaw, RankedEffect
from flexgui.core.scenario.schema import Scenario
from flexgui.session.scenario_edits import Edit, ScenarioDict
from flexgui.stages.diagnose.model_versions import ModelVersion, ladder_steps

LEAST = 1e-9
"""A fitted size that is smaller, as a share of a plausible one, starts at the plausible one."""

_PARAMETER = re.compile(r"\s*([A-Za-z]\w*)\s*=\s*([-+0-9.eE]+)\s*(?:\[([^\]]*)\]|(.*?))\s*")


def with_effect(kind: str, ranked: RankedEffect | None) -> Edit:
    """Adds a listed effect, starting from the sizes of the ranking if there are any."""
    effect(kind)
    sizes = {e.name: e.value for e in ranked.parameters} if ranked is not None else {}
    has_size = any(abs(value) > LEAST for value in sizes.values())
    sizes = sizes if has_size else {}
    starts = {name: {"start": float(v), "vary": True} for name, v in sizes.items()}

    def edit(document: ScenarioDict) -> None:
        entries = document.setdefault("model", {}).setdefault("effects", [])
        # What an included effect has been given already is its own.
        stated = {name for entry in entries for name in entry}
        fresh = {name: start for name, start in starts.items() if name not in stated}
        entries.append({"id": kind} | fresh)

    return edit


def with_own(target: str, formula: str, parameters: str) -> Edit:
    """Adds an own effect; InputError if its parameters cannot be read."""
    own: dict[str, Any] = {"target": target, "formula": formula.strip()}
    own["parameters"] = own_parameters(parameters)

    def edit(document: ScenarioDict) -> None:
        mine = document.setdefault("model", {}).setdefault("own", [])
        kind = _next_id(mine)
        number = kind.removeprefix("own_")
        mine.append(own | {"id": kind, "title": f"Own effect {number} at {target}"})

    return edit


def of_formula(sentence: str) -> str:
    """A sentence on an own effect of a scenario, said of the formula that was entered."""
    return re.sub(r"^.*\[\[model\.own\]\](?: \d+)? formula", "The formula", sentence)


def with_law(law: ProposedLaw) -> Edit:
    """Adds a proposed law, which is an own effect from then on."""

    def edit(document: ScenarioDict) -> None:
        mine = document.setdefault("model", {}).setdefault("own", [])
        mine.append({**law.settings, "id": _next_id(mine)})

    return edit


def without_events(events: Sequence[Event]) -> Edit:
    """States a recording before and after what happened once in it."""
    rests = {event.recording: event.rest for event in events}

    def edit(document: ScenarioDict) -> None:
        entries = list[dict[str, Any]]()
        for entry in document.get("recordings", ()):
            rest = rests.get(entry["name"])
            if rest is None:
                entries.append(entry)
                continue
            entries += [entry | {"window": list(window)} for window in rest]
            for further in entries[len(entries) - len(rest) + 1 :]:
                further.pop("name")  # it gets one that is free
        document["recordings"] = entries

    return edit


def _next_id(mine: Sequence[Mapping[str, Any]]) -> str:
    """own_1, own_2, ..."""
    numbers = (int(re.sub(r"\D", "", o.get("id", "")) or 0) for o in mine)
    return f"own_{1 + max(numbers, default=0)}"


def own_parameters(text: str) -> dict[str, dict[str, Any]]:
    """'b = 0.5 [N m], c = 2' -> name -> start and unit; InputError for what is not so written."""
    parameters: dict[str, dict[str, Any]] = {}
    for part in filter(str.strip, text.split(",")):
        match = _PARAMETER.fullmatch(part)
        try:
            start = float(match[2]) if match else None
        except ValueError:
            start = None
        if match is None or start is None:
            raise InputError(
                f"The parameter {part.strip()!r} cannot be read. Write name = start [unit], "
                f"separated by commas: b = 0.5 [N m]."
            )
        parameters[match[1]] = {"start": start, "unit": (match[3] or match[4] or "").strip()}
    return parameters


def without_effect(kind: str) -> Edit:
    """Removes the last effect of that id, listed or own."""

    def edit(document: ScenarioDict) -> None:
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
    """(id, title) of the effects in the model, in the order of adding."""
    titles = {kind: effect.title for kind, effect in catalogue().items()}
    listed = [(e.id, titles.get(e.id, e.id)) for e in scenario.model.effects]
    own = [(o.id or "", o.title or o.id or "own effect") for o in scenario.model.own]
    return (*listed, *own)


def places(scenario: Scenario) -> tuple[tuple[str, str], ...]:
    """(title, where it acts) of the effects in the model."""
    effects = catalogue()
    listed = [(effects[e.id].title, effects[e.id].acts_at) for e in scenario.model.effects]
    own = [(o.title or "own effect", "tip" if o.target.startswith("tip") else "joints")
           for o in scenario.model.own]  # fmt: skip
    return (*listed, *own)


def titled(kinds: Sequence[str]) -> list[str]:
    """Titles of effects by their ids."""
    effects = catalogue()
    return [effects[kind].title if kind in effects else kind for kind in kinds]


PRICE = 0.05
"""Of a parameter, in logarithms of what is left: as the listed ones are ranked (design, 6)."""

LEAST_LEFT = 1e-4
"""Share of the error; below it nothing is distinguished by it."""


def ranked_with_own(before: ModelVersion, after: ModelVersion) -> ModelVersion:
    """The version before an own effect was added, with that effect in its ranking."""
    own = own_ranked(before, after)
    if own is None or before.found is None:
        return before
    listed = [r for r in before.found.ranking if r.effect != own.effect]
    worse = (r.refit_drop_percent is None or _price(r) > _price(own) for r in listed)
    place = next((k for k, is_worse in enumerate(worse) if is_worse), len(listed))
    ranking = (*listed[:place], own, *listed[place:])
    return replace(before, found=replace(before.found, ranking=ranking))


def own_ranked(before: ModelVersion, after: ModelVersion) -> RankedEffect | None:
    """The own effect that `after` adds, as an entry of the ranking of `before`."""
    if before.found is None or after.found is None or after.added is None or not before.ranking:
        return None
    from flexgui.core.estimate.minimum import RELEVANT  # late: it loads all of a diagnosis

    error_before, grown = (step.cost_per_sample for step in ladder_steps((before, after)))
    drop = max(error_before - grown, 0.0)
    names = {e.name for e in before.found.step.parameters}
    return RankedEffect(
        effect=after.added,
        title=after.title,
        score=math.nan,
        p_value=math.nan,
        expected_drop_percent=math.nan,
        refit_drop_percent=100.0 * drop / max(error_before - 1.0, drop, RELEVANT),
        delta_bic=None,
        parameters=tuple(e for e in after.found.step.parameters if e.name not in names),
        predicted=_predicted(before, after),
    )


def _predicted(before: ModelVersion, after: ModelVersion) -> tuple[np.ndarray, ...]:
    assert before.found is not None and after.found is not None
    pairs = list(zip(before.found.residual, after.found.residual, strict=False))
    alike = before.found.recordings == after.found.recordings
    same = alike and all(a.shape == b.shape for a, b in pairs)
    return tuple(np.asarray(a - b) for a, b in pairs) if same else ()


def _price(ranked: RankedEffect) -> float:
    unexplained = 1.0 - (ranked.refit_drop_percent or 0.0) / 100.0
    return math.log(max(unexplained, LEAST_LEFT)) + PRICE * len(ranked.parameters)


def own_place(before: ModelVersion, after: ModelVersion) -> str:
    """'Your formula is number 2 of 7: it explains 95.1 % of the error; Coulomb friction 99.9 %.'"""
    own = own_ranked(before, after)
    if own is None:
        return ""
    ranking = ranked_with_own(before, after).ranking
    place = next(k for k, r in enumerate(ranking, start=1) if r.effect == own.effect)
    text = (
        f"Your formula is number {place} of {len(ranking)}: it explains "
        f"{own.refit_drop_percent:.1f} % of the error above the noise floor"
    )
    competitor = next((r for r in ranking if r.effect != own.effect), None)
    if competitor is None or competitor.refit_drop_percent is None:
        return f"{text}."
    return (
        f"{text}; the best listed one, {competitor.title}, {competitor.refit_drop_percent:.1f} %."
    )
