"""What a search remembers: the models that it fitted and what it tried on each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple
from weakref import ref

from ..diagnose.base_fit import BaseFit
from ..diagnose.bending_shapes import FitsByShapes
from ..diagnose.evidence import Round
from ..diagnose.noise_update import alike
from ..effects.effect import Effect
from ..estimate.fit_result import FitResult
from ..estimate.fitted_model import FittedModel
from ..estimate.minimum import RELEVANT
from ..estimate.problem import FitData
from ..estimate.validation import ValidationFit, fit_validation


class ModelRound(NamedTuple):
    """What was tried on a model."""

    model: FittedModel
    round: Round


class Visit(NamedTuple):
    """A model that the search went on from."""

    key: tuple[str, ...]
    floors: Mapping[str, float]
    cost: float


@dataclass
class Memo:
    """What was fitted and screened, and where the search has been."""

    validation: FitData | None
    stated: tuple[Effect, ...]
    modes: tuple[int, ...]
    """Bending shapes per segment of the model as given."""
    rounds: dict[tuple[str, ...], ModelRound] = field(default_factory=dict)
    """Key of a model -> what was tried on it."""
    visits: list[Visit] = field(default_factory=list)
    shapes: FitsByShapes = field(default_factory=dict)
    """Models with other bending shapes."""
    titles: Counter[str] = field(default_factory=Counter)
    """How many rounds had a title: no two stages in turn have the same."""
    validated: dict[tuple[int, int], tuple[ref[FitResult], ValidationFit]] = field(
        default_factory=dict
    )
    """Identity of a fit result, steps -> the result, which is not kept for this, and the model on
    the validation recordings."""

    def keep(self, model: FittedModel, found: Round) -> None:
        """Keep what was tried on a model, of the others without their columns: on long recordings
        these take gigabytes."""
        for key, known in self.rounds.items():
            lean = replace(known.round, screen=known.round.screen.without_columns())
            self.rounds[key] = known._replace(round=lean)
        self.rounds[model.key] = ModelRound(model, found)

    def visit(self, model: FittedModel) -> None:
        """Remember that the search goes on from a model."""
        self.visits.append(Visit(model.key, model.data.floors, model.refit.cost))

    def is_new(self, model: FittedModel) -> bool:
        """Whether the search was never at this model against this noise, or once, at a worse
        minimum: an effect that came and went may have brought the others to a better one."""
        before = [
            visit.cost
            for visit in self.visits
            if visit.key == model.key and alike(visit.floors, model.data.floors)
        ]
        better = model.refit.cost < min(before, default=0.0) - RELEVANT * model.data.count
        return not before or (len(before) == 1 and better)

    def validation_fit(self, model: FittedModel) -> ValidationFit | None:
        """The model on the validation recordings; None without any."""
        if self.validation is None:
            return None
        data, refit = model.data, model.refit
        validation = self.validation.for_bare(data.bare)
        key = id(refit), data.result_substeps
        known = self.validated.get(key)
        if known is not None and known[0]() is refit:
            return known[1]
        weights = validation.weights_at(data.floors)
        later = replace(validation, floors=data.floors, weights=weights, result_substeps=key[1])
        fitted = fit_validation(later, refit)
        assert fitted is not None
        alive = {k: v for k, v in self.validated.items() if v[0]() is not None}
        self.validated = alive | {key: (ref(refit), fitted)}
        return fitted

    def base_fit(self, model: FittedModel) -> BaseFit:
        """The model as the start of another search."""
        return BaseFit(model.data, model.refit, self.validation, self.validation_fit(model))
