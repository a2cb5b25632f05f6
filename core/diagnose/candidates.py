"""Which effects a search tries on a rig, and why not the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..effects import catalogue
from ..effects.effect import Effect, EffectParameter, Rig
from ..estimate.problem import FitData
from ..sentences import listed


def applicable(data: FitData, present: Sequence[Effect], only: Sequence[str] = ()) -> list[Effect]:
    """Candidates for this rig that are not in the model yet, with those of their parameters that
    are not estimated already. What has no size, such as a further bending shape, is none."""
    have = {e.kind for e in present}
    rig = replace(data.rig, level=data.bare.with_effects(present).level)
    return [
        candidate.without(_estimated(candidate, rig, data))
        for kind, candidate in _selected(only).items()
        if kind not in have
        and not _reason_against(candidate, rig, data)
        and _own_parameters(candidate, rig, data)
    ]


def not_applicable(data: FitData, only: Sequence[str] = ()) -> dict[str, str]:
    """effect -> why this rig cannot show it, or why it is not offered."""
    reasons = {kind: _reason_against(e, data.rig, data) for kind, e in _selected(only).items()}
    return {kind: reason for kind, reason in reasons.items() if reason}


def ruled_out(data: FitData, only: Sequence[str] = ()) -> dict[str, str]:
    """Title of an effect, or of one of its sizes, that is not searched -> what is stated of the
    rig."""
    each = [e.ruled_out(data.rig, data.sizes) for e in _selected(only).values()]
    return {title: words for statements in each for title, words in statements.items()}


def _selected(only: Sequence[str]) -> dict[str, Effect]:
    return {kind: e for kind, e in sorted(catalogue().items()) if not only or kind in only}


def _own_parameters(effect: Effect, rig: Rig, data: FitData) -> dict[str, EffectParameter]:
    """An effect's parameters by name."""
    arm = effect.changed_arm(rig.arm, {})
    return {k.parameter.name: k for k in effect.parameters(arm, rig.drive, data.sizes)}


def _estimated(effect: Effect, rig: Rig, data: FitData) -> frozenset[str]:
    """Names of an effect's parameters that every model estimates."""
    nuisance = {u.parameter.name for u in data.nuisance}
    return frozenset(nuisance.intersection(_own_parameters(effect, rig, data)))


def _reason_against(effect: Effect, rig: Rig, data: FitData) -> str:
    """Why an effect is not offered; empty if it is."""
    free, own = _estimated(effect, rig, data), _own_parameters(effect, rig, data)
    new = any(name not in free and not k.secondary for name, k in own.items())
    verb = "is" if len(free) == 1 else "are"
    estimated = f"{listed(sorted(free))} {verb} already estimated." if free and not new else ""
    statement = effect.ruled_out(rig, data.sizes).get(effect.title, "")
    stated = f"Stated: {statement}." if statement else ""
    return stated or effect.not_applicable(rig) or estimated
