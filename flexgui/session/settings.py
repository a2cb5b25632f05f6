"""What a scenario states, however it is written, and in what two scenarios differ."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from flexgui.core.arm.build import build_arm
from flexgui.core.effects import catalogue
from flexgui.core.scenario.schema import Scenario
from flexgui.core.sentences import listed
from flexgui.sentences.written import format_number, with_unit
from flexgui.session.scenario_edits import SECTION_PARAMETERS

Path = tuple[str | int, ...]
DIGITS = 9
"""Of a number: fields show no more, and a unit changes the last ones."""

SHOWN: dict[Path, tuple[str, float, str]] = {
    ("arm", "segments", "young_modulus"): ("ε", 1e9, "GPa"),
    ("arm", "segments", "width"): ("d", 1e-3, "mm"),
    ("arm", "segments", "length"): ("l", 1.0, "m"),
    ("arm", "segments", "mass"): ("m", 1.0, "kg"),
    ("arm", "segments", "EI"): ("EI", 1.0, "N m²"),
    ("arm", "segments", "tip_mass"): ("tip mass", 1.0, "kg"),
    ("arm", "segments", "modes"): ("modes", 1.0, ""),
    ("drive", "gains"): ("gains", 1.0, ""),
    ("recordings", "simulate", "snr_db"): ("SNR", 1.0, "dB"),
}
"""Setting -> its symbol, and the unit in which the page states it; others have their name."""
MOST_SHOWN = 3
"""Differences that a sentence names."""


def settings_of(scenario: Scenario) -> Mapping[Path, Any]:
    """Path -> value of every setting of the scenario. Two scenarios with the same settings are
    computed alike: an arm has the values that it has, whether a preset or a person states them, and
    bounds of a section are shares of its value, with which they move."""
    arm = build_arm(scenario.arm)
    document = scenario.model_dump()
    document["arm"] = arm.model_dump() | {"name": scenario.arm.name}
    for setting, parameter in SECTION_PARAMETERS.items():
        bounds, value = document["identify"]["bounds"], getattr(arm.segments[0], setting)
        if parameter in bounds and value:
            bounds[parameter] = [end / value for end in bounds[parameter]]
    return dict(_leaves((), document))


def _leaves(path: Path, value: Any) -> Iterator[tuple[Path, Any]]:
    if isinstance(value, dict | list | tuple) and value:
        entries = value.items() if isinstance(value, dict) else enumerate(value)
        for key, each in entries:
            yield from _leaves((*path, key), each)
    else:
        yield path, float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value


def made_with(made: Scenario, now: Scenario) -> str:
    """'Made with ε = 1 GPa (now 1.05 GPa).': what has changed since; empty where nothing has."""
    if made == now:  # mostly, and much quicker
        return ""
    before, after = settings_of(made), settings_of(now)
    if before == after:
        return ""
    if made.title != now.title:
        return f"Made with “{made.title}”."
    changed: dict[Path, list[Path]] = defaultdict(list)
    for path in {**before, **after}:
        if path not in before or path not in after or before[path] != after[path]:
            changed[tuple(part for part in path if isinstance(part, str))].append(path)
    order = {name: place for place, name in enumerate(SHOWN)}
    names = sorted(changed, key=lambda name: order.get(name, len(order)))
    values = {name: [_values(name, changed[name], of) for of in (before, after)] for name in names}
    texts = list(dict.fromkeys(_difference(name, made, now, *values[name]) for name in names))
    rest = len(texts) - MOST_SHOWN
    more = [f"{rest} more setting{'s' if rest > 1 else ''}"] if rest > 0 else []
    return f"Made with {listed([*texts[:MOST_SHOWN], *more])}."


def _difference(name: Path, made: Scenario, now: Scenario, was: str, is_now: str) -> str:
    """'ε = 1 GPa (now 1.05 GPa)'; of the model and of the recordings in words."""
    if name[0] == "model" and _model(made) != _model(now):
        was, is_now = _model(made), _model(now)
    names = [[spec.name for spec in scenario.recordings] for scenario in (made, now)]
    if name[0] == "recordings" and names[0] != names[1]:
        was, is_now = (f"{len(each)} recording{'s'[: len(each) != 1]}" for each in names)
        if was == is_now:
            return "other recordings"
    return f"{was} (now {is_now.partition(' = ')[2] or is_now})"


def _model(scenario: Scenario) -> str:
    titles = {kind: effect.title for kind, effect in catalogue().items()}
    effects = [titles.get(effect.id, effect.id) for effect in scenario.model.effects]
    own = [effect.title or effect.id or "own effect" for effect in scenario.model.own]
    return f"the model “{' + '.join([*effects, *own]) or 'as given'}”"


def _values(name: Path, paths: Sequence[Path], settings: Mapping[Path, Any]) -> str:
    """'gains = 60, 30': of one setting for all segments or recordings, once where all are alike."""
    symbol, unit, unit_name = SHOWN.get(name, (".".join(map(str, name)), 1.0, ""))
    texts = [_text(settings.get(path), unit) for path in paths]
    shown = ", ".join(texts if len(set(texts)) > 1 else texts[:1])
    return f"{symbol} = {with_unit(shown, unit_name if shown != NONE else '')}"


NONE = "none"


def _text(value: Any, unit: float) -> str:
    if value is None or value == ():
        return NONE
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return format_number(value / unit) if is_number else str(value)
