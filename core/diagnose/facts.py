"""What a fitted model says about its effects: their sizes, and what its parameters are called."""

from __future__ import annotations

from collections.abc import Sequence

from core.diagnose.data import Data
from core.diagnose.refit import Refit
from core.diagnose.steps import estimates
from core.effects import with_included
from core.effects.effect import Effect
from core.results import Estimate


def sizes_of(found: Sequence[Effect], refit: Refit, data: Data) -> dict[str, tuple[Estimate, ...]]:
    """Effect -> its parameters with those of the effects that it includes, at the end."""
    listed, model = estimates(refit), refit.hypothesis.model
    sizes = {}
    for one in found:
        names = {
            knob.parameter.name
            for part in with_included([one])
            for knob in part.knobs(model.arm, model.drive, data.sizes)
        }
        sizes[one.kind] = tuple(e for e in listed if e.name in names)
    return sizes


def titles_of(refit: Refit) -> dict[str, str]:
    """Parameter -> its title."""
    model = refit.hypothesis.model
    return {name: item.title or name for name, item in model.parameters.items()}
