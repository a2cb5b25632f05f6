"""What a search remembers: the models that it fitted and what it tried on each."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from ..diagnose.acceptance import Round
from ..diagnose.base_fit import BaseFit
from ..diagnose.bending_shapes import FitsByShapes
from ..diagnose.evidence import assess_refit
from ..diagnose.fit_problem import FitProblem
from ..diagnose.fitted_model import FittedModel, screen_against, weighted
from ..diagnose.ladder_steps import ValidationFit, fit_validation
from ..diagnose.refit import Refit, with_whitened_cost
from ..effects.effect import Effect


class ModelRound(NamedTuple):
    """What was tried on a model."""

    model: FittedModel
    round: Round

    def against(self, like: FitProblem) -> ModelRound:
        """The same against the noise of other data of the same recordings."""
        old, model, found = self.model.data, self.model.against(like), self.round
        if model is self.model:
            return self
        data = model.data
        screened = screen_against(found.screen, model.refit, old, data)
        before = with_whitened_cost(model.refit, screened.whitener)
        by_kind = {s.effect.kind: s for s in screened.candidates}
        refitted = []
        for w in found.refitted:
            refit = with_whitened_cost(weighted(w.refit, old, data), screened.whitener)
            again = by_kind[w.screened.effect.kind]
            assessed = assess_refit(again, before, refit, data.count, len(by_kind))
            refitted.append(replace(assessed, unseen=w.unseen))
        seen = replace(
            found, screen=screened, refitted=tuple(refitted), before=before, after=before, data=data
        )
        return ModelRound(model, seen)


@dataclass
class Memo:
    """What was fitted and screened, which no later noise makes invalid."""

    validation: FitProblem | None
    stated: tuple[Effect, ...]
    modes: tuple[int, ...]
    """Bending shapes per segment of the model as given."""
    rounds: dict[tuple[str, ...], ModelRound] = field(default_factory=dict)
    """Key of a model -> what was tried on it."""
    shapes: FitsByShapes = field(default_factory=dict)
    """Models with other bending shapes."""
    titles: Counter[str] = field(default_factory=Counter)
    """How many rounds had a title: no two stages in turn have the same."""
    validated: dict[tuple[int, int], tuple[Refit, ValidationFit]] = field(default_factory=dict)

    def validation_fit(self, model: FittedModel) -> ValidationFit | None:
        """The model on the validation recordings; None without any."""
        if self.validation is None:
            return None
        data, refit = model.data, model.refit
        validation = self.validation.for_bare(data.bare)
        key = id(refit), data.result_substeps
        if key not in self.validated:
            weights = validation.weights_at(data.floors)
            later = replace(validation, floors=data.floors, weights=weights, result_substeps=key[1])
            fitted = fit_validation(later, refit)
            assert fitted is not None
            # The refit is kept too, so that no other one gets its id.
            self.validated[key] = refit, fitted
        return self.validated[key][1]

    def base_fit(self, model: FittedModel) -> BaseFit:
        """The model as the start of another search."""
        return BaseFit(model.data, model.refit, self.validation, self.validation_fit(model))
