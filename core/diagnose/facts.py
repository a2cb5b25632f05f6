"""What a fitted model says about its effects: their sizes, and what its parameters are called."""

from __future__ import annotations

from collections.abc import Sequence

from core.diagnose.data import Data, names_of
from core.diagnose.refit import Refit
from core.diagnose.steps import estimates
from core.effects import catalogue
from core.effects.effect import Effect
from core.effects.sizes import typical
from core.model import Model
from core.results import Estimate


def sizes_of(found: Sequence[Effect], refit: Refit, data: Data) -> dict[str, tuple[Estimate, ...]]:
    """Effect -> its parameters with those of the effects that it includes, at the end."""
    listed, model = estimates(refit), refit.hypothesis.model
    names = {one.kind: names_of(one, model, data.sizes) for one in found}
    return {kind: tuple(e for e in listed if e.name in own) for kind, own in names.items()}


def titles_of(refit: Refit) -> dict[str, str]:
    """Parameter -> its title, also of effects that were only tried."""
    model = refit.hypothesis.model
    known = {name: item.title or name for name, item in model.parameters.items()}
    return {**titles_in_catalogue(model), **known}


def titles_in_catalogue(model: Model) -> dict[str, str]:
    """Of all effects of the catalogue, as this arm would have them."""
    found: dict[str, str] = {}
    for one in catalogue().values():
        arm = one.changed_arm(model.arm, {})
        for knob in one.knobs(arm, model.drive, typical(arm)):
            found[knob.parameter.name] = knob.parameter.title or knob.parameter.name
    return found
