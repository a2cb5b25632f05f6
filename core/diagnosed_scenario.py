"""The scenario with what was found in it, to be run again: estimated values, added effects."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from .effects import catalogue, with_included
from .results import Diagnosis, Outcome
from .results.identification import final_values, values_in
from .scenario.read import check_scenario, document_toml
from .scenario.schema import Scenario
from .scenario.stated_effects import base_model

IDENTIFIED, DIAGNOSED = "identified.toml", "diagnosed.toml"

Document = dict[str, Any]


def found_texts(
    scenario: Scenario, outcome: Outcome, locate: Callable[[str], str] = str
) -> dict[str, str]:
    """Name of a file -> the scenario as TOML with what was identified, and with what a diagnosis
    found. Where that added effects, the values without them are biased and not written.

    `locate` gives the new path of a recording's file. InputError where the scenario is not valid.
    """
    found, diagnosis = {}, outcome.diagnosis
    if any(fit.estimates for fit in outcome.fits) and not (diagnosis and diagnosis.added):
        found[IDENTIFIED] = identified(scenario, outcome)
    if diagnosis is not None:
        found[DIAGNOSED] = diagnosed(scenario, diagnosis)
    for name, document in found.items():
        check_scenario(document, name)
    return {name: document_toml(_moved(document, locate)) for name, document in found.items()}


def _moved(document: Document, locate: Callable[[str], str]) -> Document:
    for recording in document.get("recordings", ()):
        for key in {"file", "played"} & recording.keys():
            recording[key] = locate(recording[key])
    return document


def identified_scenario(scenario: Scenario, outcome: Outcome) -> Scenario:
    """The scenario with the estimated values, of local fits their means; InputError where it is
    not valid."""
    return check_scenario(identified(scenario, outcome), IDENTIFIED)


def diagnosed_scenario(scenario: Scenario, diagnosis: Diagnosis) -> Scenario:
    """The scenario with the added effects and the estimated values; InputError where it is not
    valid."""
    return check_scenario(diagnosed(scenario, diagnosis), DIAGNOSED)


def identified(scenario: Scenario, outcome: Outcome) -> Document:
    """The scenario's tables with the estimated values."""
    document = _for_refinement(scenario)
    _put_values(document, _stated_values(scenario, final_values(outcome.fits)), outcome.origins)
    return document


def diagnosed(scenario: Scenario, diagnosis: Diagnosis) -> Document:
    """The scenario's tables with the added effects and the estimated values."""
    document = _for_refinement(scenario)
    document.setdefault("diagnose", {})
    model = document.setdefault("model", {})
    model["level"] = "nonlinear"
    _put_effects(model, diagnosis)
    _put_shapes(document, diagnosis)
    _put_values(document, _stated_values(scenario, diagnosis.values), diagnosis.origins)
    return document


def _for_refinement(scenario: Scenario) -> Document:
    """The scenario's tables for a fit without a search. Compared models are left out, because their
    fixed values are their own."""
    document: Document = _thawed(scenario.model_dump(exclude_defaults=True))
    document.pop("compare", None)
    document.setdefault("identify", {})["generations"] = 0
    _keep_priors(scenario, document)
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


def _stated_values(scenario: Scenario, values: Mapping[str, float]) -> dict[str, float]:
    """name -> value of what a scenario can state: what is shared, and what belongs to the only
    recording."""
    alone = scenario.recordings[0].name if len(scenario.recordings) == 1 else ""
    return {name: float(x) for name, x in values_in(alone, values).items()}


def _put_values(
    document: Document, values: Mapping[str, float], origins: Mapping[str, str]
) -> None:
    starts = document["identify"].setdefault("start", {})
    bounds = document["identify"].get("bounds", {})
    for name, value in values.items():
        table = _table_of(document.get("model", {}), name, origins.get(name, ""))
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
    tables = [*document.get("model", {}).get("effects", ())]
    tables += [item["parameters"] for item in document.get("model", {}).get("own", ())]
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
