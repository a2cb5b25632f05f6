"""The scenario with what a diagnosis found in it, to be run again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from .effects import catalogue, with_included
from .results import Diagnosis
from .results.identification import values_in
from .scenario.read import check_scenario, document_toml
from .scenario.schema import Scenario
from .scenario.stated_effects import base_model

NAME = "diagnosed.toml"

Document = dict[str, Any]


def diagnosed_toml(
    scenario: Scenario, diagnosis: Diagnosis, locate: Callable[[str], str] = lambda file: file
) -> str:
    """The scenario as TOML, with the added effects and all estimated values.

    `locate` gives the new path of a recording's file. InputError where the scenario is not valid.
    """
    document = diagnosed(scenario, diagnosis)
    for recording in document.get("recordings", ()):
        for key in {"file", "played"} & recording.keys():
            recording[key] = locate(recording[key])
    text = document_toml(document)
    check_scenario(document, NAME)
    return text


def diagnosed_scenario(scenario: Scenario, diagnosis: Diagnosis) -> Scenario:
    """The same as a checked scenario."""
    return check_scenario(diagnosed(scenario, diagnosis), NAME)


def diagnosed(scenario: Scenario, diagnosis: Diagnosis) -> Document:
    """The scenario's tables with the added effects and the estimated values, for a refinement only.

    Compared models are left out, because their fixed values are their own.
    """
    document = _thawed(scenario.model_dump(exclude_defaults=True))
    document.pop("compare", None)
    document.setdefault("diagnose", {})
    identify = document.setdefault("identify", {})
    identify["generations"] = 0
    model = document.setdefault("model", {})
    model["level"] = "nonlinear"
    _keep_priors(scenario, document)
    _put_effects(model, diagnosis)
    _put_shapes(document, diagnosis)
    _put_values(document, _stated_values(scenario, diagnosis), diagnosis.origins)
    return document


def _put_effects(model: Document, diagnosis: Diagnosis) -> None:
    """What was added, after what was there; a whole way already holds both."""
    entries = model.setdefault("effects", [])
    stated = [entry["id"] for entry in entries]
    for entry in diagnosis.effects:
        fresh = _thawed(dict(entry))
        if fresh["id"] in stated:
            stated.remove(fresh["id"])
        else:
            entries.append({k: v for k, v in fresh.items() if not _states(entries, k)})
    if not entries:
        del model["effects"]


def _put_shapes(document: Document, diagnosis: Diagnosis) -> None:
    """As many bending shapes as the recordings show."""
    if not diagnosis.shapes:
        return
    arm = document.setdefault("arm", {})
    if "segments" in arm:
        pairs = zip(arm["segments"], diagnosis.shapes, strict=True)
        arm["segments"] = [{**segment, "modes": n} for segment, n in pairs]
    else:
        arm["modes"] = list(diagnosis.shapes)


def _states(entries: list[Document], name: str) -> bool:
    """Whether an entry speaks of that parameter: an effect may bring what another includes."""
    return name != "id" and any(name in entry for entry in entries)


def _stated_values(scenario: Scenario, diagnosis: Diagnosis) -> dict[str, float]:
    """name -> value of what a scenario can state: what is shared, and what belongs to the only
    recording."""
    alone = scenario.recordings[0].name if len(scenario.recordings) == 1 else ""
    return {name: float(x) for name, x in values_in(alone, diagnosis.values).items()}


def _put_values(
    document: Document, values: Mapping[str, float], origins: Mapping[str, str]
) -> None:
    starts = document["identify"].setdefault("start", {})
    bounds = document["identify"].get("bounds", {})
    for name, value in values.items():
        table = _table_of(document["model"], name, origins.get(name, ""))
        if table is None or name in starts:
            starts[name] = _clipped(value, *bounds.get(name, (None, None)))
        if table is not None:
            _start(table, name, value)
    if not starts:
        del document["identify"]["start"]


def _table_of(model: Document, name: str, origin: str) -> Document | None:
    """The table that speaks of an effect's parameter; None where it belongs to no effect."""
    entries = model.get("effects", [])
    own = [item["parameters"] for item in model.get("own", ()) if name in item["parameters"]]
    saying = [entry for entry in entries if name in entry]
    same = [entry for entry in entries if entry["id"] == origin]
    including = [entry for entry in entries if origin in _parts(entry["id"])]
    return next(iter((*own, *saying, *same, *including)), None)


def _parts(kind: str) -> list[str]:
    effects = catalogue()
    return [item.kind for item in with_included([effects[kind]])] if kind in effects else []


def _start(table: Document, name: str, value: float) -> None:
    """Where a parameter that is estimated begins; one that the user holds stays."""
    stated = table.get(name, {})
    entry = dict(stated) if isinstance(stated, dict) else {"start": stated}
    if entry.get("vary", True):
        entry["start"] = _clipped(value, entry.get("lower"), entry.get("upper"))
        table[name] = entry


def _clipped(value: float, lower: float | None, upper: float | None) -> float:
    value = value if lower is None else max(value, lower)
    return value if upper is None else min(value, upper)


def _keep_priors(scenario: Scenario, document: Document) -> None:
    """What is believed is about the start unless it is said otherwise; the start moves now."""
    priors = document["identify"].get("prior", {})
    parameters = base_model(scenario).parameters
    for name, prior in priors.items():
        if prior.get("value") is None and name in parameters:
            prior["value"] = scenario.identify.start.get(name, parameters[name].value)
    tables = [*document["model"].get("effects", ())]
    tables += [item["parameters"] for item in document["model"].get("own", ())]
    for table in tables:
        for name, entry in table.items():
            prior = entry.get("prior") if isinstance(entry, dict) else None
            if prior and prior.get("value") is None and name in parameters:
                prior["value"] = parameters[name].value


def _thawed(value: Any) -> Any:
    """Plain lists and tables that may be changed."""
    if isinstance(value, Mapping):
        return {str(k): _thawed(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_thawed(entry) for entry in value]
    return value
