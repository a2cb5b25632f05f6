"""What a fitted model says about its effects: their sizes, and what its parameters are called."""

from __future__ import annotations

from collections.abc import Sequence

from core.diagnose.data import Data, names_of
from core.diagnose.refit import Refit
from core.diagnose.steps import estimates
from core.effects.effect import Effect
from core.results import Estimate


def sizes_of(found: Sequence[Effect], refit: Refit, data: Data) -> dict[str, tuple[Estimate, ...]]:
    """Effect -> its parameters with those of the effects that it includes, at the end."""
    listed, model = estimates(refit), refit.hypothesis.model
    names = {one.kind: names_of(one, model, data.sizes) for one in found}
    return {kind: tuple(e for e in listed if e.name in own) for kind, own in names.items()}


def titles_of(refit: Refit) -> dict[str, str]:
    """Parameter -> its title."""
    model = refit.hypothesis.model
    return {name: item.title or name for name, item in model.parameters.items()}
