"""The search: moves from model to model until none improves, then again against a better noise.

A move adds the effect, or the set of effects, that the recordings need most (forward selection of
physical effects: Bacher and Madsen 2011), takes out what is not needed, or puts a better effect in
the place of others. A model is visited again only at a better minimum. When no move is left, the
noise is estimated again; what was screened and fitted is seen against it as it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from ..diagnose import progress_messages as messages
from ..diagnose.acceptance import PROMISING_SHARE, ModelCheck, Round, model_check
from ..diagnose.bending_shapes import resolved
from ..diagnose.evidence import RELEVANT
from ..diagnose.fit_problem import FitProblem, with_shared_motions
from ..diagnose.fitted_model import FittedModel, fit_model
from ..diagnose.linear_screen import Screen, screen
from ..diagnose.memo import Memo, ModelRound
from ..diagnose.noise_update import higher_floors, lower_floors
from ..diagnose.output_changes import trials
from ..diagnose.ranking import ranking_of
from ..diagnose.refit import Refit
from ..diagnose.remaining_error import remaining_error, within_noise
from ..diagnose.removal_and_exchange import best_exchange, needed_effects, with_stated_sizes
from ..diagnose.search_options import Options, RankingCallback, RemainingTrials
from ..diagnose.search_round import applicable, search_round
from ..diagnose.step_choice import enough_substeps
from ..effects.effect import Effect
from ..identify.loop_rate import better_loop
from ..least_squares import cost_of
from ..noise.noise_floor import Floor
from ..progress import Progress
from ..sentences import listed


class Move(NamedTuple):
    """A model, and how the search came to it from the one before."""

    model: FittedModel
    title: str = ""
    added: tuple[str, ...] = ()
    """Ids of the effects that came in."""
    removed: tuple[str, ...] = ()
    """Titles of those that went."""


class Found(NamedTuple):
    """Where a search ended."""

    path: tuple[Move, ...]
    proposed: tuple[str, ...]
    """Ids of more effects that pass every test, which the limit keeps out."""

    @property
    def model(self) -> FittedModel:
        """The last model."""
        return self.path[-1].model


@dataclass(frozen=True)
class Search:
    """The moves of one diagnosis."""

    options: Options
    progress: Progress
    on_ranking: RankingCallback | None
    memo: Memo

    def run(self, base: FittedModel) -> Found:
        """The whole search from the model as given, with the bending shapes that it needs, and with
        the last model's sizes as stated where that leaves no more."""
        found = self._with_shapes(base)
        last = with_stated_sizes(found.model, len(self.memo.stated), self.progress.stopped)
        return found._replace(path=(*found.path[:-1], found.path[-1]._replace(model=last)))

    def _with_shapes(self, base: FittedModel) -> Found:
        """The search, with the bending shapes that its first and its last model need."""
        base = self._resolved(base)
        found = self._against_best_noise(self._without_moves_left((Move(base),)))
        last = self._resolved(found.model)
        if last is found.model or self.progress.stopped():
            return found
        # A missing effect has hidden the need for a shape, or has seemed to be one.
        if len(found.path) == 1:
            self._round(last, 1)
        return self._without_moves_left((*found.path[:-1], found.path[-1]._replace(model=last)))

    def _against_best_noise(self, found: Found) -> Found:
        """The search, continued against each better estimate of the noise."""
        base = found.path[0].model
        while not self.progress.stopped():
            changed = found.model.key != base.key
            floors = higher_floors(found.model, self.options, changed)
            if floors is not None:
                found = self._without_moves_left(self._against(found.path, floors))
                continue
            first = self.memo.rounds.get(base.key)
            screened = None if first is None else first.round.screen
            floors = lower_floors(found.model, self.options, screened, changed)
            if floors is None:
                break
            further = self._without_moves_left(self._against(found.path, floors))
            # An estimate that no effect confirms is no better than the one before.
            if further.model.key == found.model.key or self.progress.stopped():
                break
            found = further
        return found

    def _against(self, path: tuple[Move, ...], floors: dict[str, Floor]) -> tuple[Move, ...]:
        """The path with its last model at its minimum against another noise."""
        last = path[-1]
        self.progress.stage(messages.NOISE)
        seen = last.model.against(last.model.data.in_floors(floors))
        return (*path[:-1], last._replace(model=seen))

    def _ready(self, path: tuple[Move, ...]) -> tuple[Move, ...]:
        """The path for the next move. Its last model has steps that are fine enough, and the rate
        of the rig's loop that its torques show. Where added effects leave more than noise, it is
        seen against its own noise, if the error may be noise, and has the bending shapes it needs.
        """
        model = self._with_better_loop(self._finer(path[-1].model))
        path = (*path[:-1], path[-1]._replace(model=model))
        data, errors = model.data, model.refit.errors
        if not self.added(model) or within_noise(data, errors):
            return path
        if not remaining_error(data, errors).above:
            floors = higher_floors(model, self.options, True)
            if floors is not None:
                return self._ready(self._against(path, floors))
        last = path[-1]
        return (*path[:-1], last._replace(model=self._resolved(last.model)))

    def _resolved(self, model: FittedModel) -> FittedModel:
        """The model with the bending shapes that it needs."""
        if not any(self.memo.modes):
            return model
        self.progress.stage(messages.SHAPES)
        return resolved(model, self.memo.modes, self.progress.stopped, self.memo.shapes)

    def _finer(self, model: FittedModel) -> FittedModel:
        """The model with steps that are fine enough for what it leaves; as it is where they are."""
        data, values = model.data, model.refit.parametrised.all_values()
        steps = enough_substeps(data, model.effects, values)
        if steps // 2 <= data.anchored_substeps:  # enough where an anchor corrects them
            return model
        finer = replace(data, substeps=steps, anchored_substeps=steps // 2)
        return fit_model(finer, model.effects, values, self.progress.stopped)

    def _with_better_loop(self, model: FittedModel) -> FittedModel:
        """The model with the rate of the rig's loop that leaves less error: an effect that was
        missing may have hidden it."""
        h = model.refit.parametrised
        servo = better_loop(h.residuals, h.vector)
        if servo is None:
            return model
        data = model.data.for_bare(model.data.bare.steered_by(servo))
        other = fit_model(data, model.effects, h.all_values(), self.progress.stopped)
        return other if other.refit.cost < model.refit.cost else model

    def _without_moves_left(self, path: tuple[Move, ...]) -> Found:
        """The path with moves until none improves the model."""
        visited = {move.model.key: move.model.refit.cost for move in path}
        proposed: tuple[str, ...] = ()
        while not self.progress.stopped():
            path = self._ready(path)
            model = path[-1].model
            move, proposed = self._addition(model)
            move = move or self._reduction(model) or self._exchange(model)
            if move is None or not _leads_on(move.model, visited):
                break
            visited[move.model.key] = move.model.refit.cost
            path = (*path, move)
        return Found(path, proposed)

    def added(self, model: FittedModel) -> tuple[Effect, ...]:
        """The effects of a model that nobody stated."""
        return model.effects[len(self.memo.stated) :]

    def _addition(self, model: FittedModel) -> tuple[Move | None, tuple[str, ...]]:
        """The move that adds what is missing most, or None; and the ids of the effects if the limit
        keeps them out."""
        most = self.options.max_effects - len(self.added(model))
        within = within_noise(model.data, model.refit.errors)
        if within and self.memo.rounds:
            return None, ()
        if most < 1 and not remaining_error(model.with_law_errors.data, model.refit.errors).above:
            return None, ()
        found = self._round(model, max(most, 1))
        effects = [w.screened.effect for w in found.added]
        if not effects or most < 1:
            return None, tuple(e.kind for e in effects)
        after = FittedModel(found.data, found.after, (*model.effects, *effects))
        return Move(after, listed([e.title for e in effects]), tuple(e.kind for e in effects)), ()

    def _round(self, model: FittedModel, most: int) -> Round:
        """Ranks the candidates on a model and tests the best; kept in the memo."""
        candidates = applicable(model.data, model.effects, self.options.candidates)
        title = messages.round_title(model.effects, bool(self.options.candidates))
        reports = self._callbacks(model, candidates)
        found = self.round_of(model, candidates, title, most, **reports)
        self.memo.rounds[model.key] = ModelRound(model, found)
        return found

    def round_of(
        self, model: FittedModel, candidates: Sequence[Effect], title: str, most: int,
        **callbacks: Callable[..., None],
    ) -> Round:  # fmt: skip
        """Rank these candidates on a model and test the best."""
        data, refit, present = model.data, model.refit, model.effects
        planned = [t for c in candidates for t in trials(refit.parametrised, c, data)]
        steps = messages.RoundProgress(self.progress, refit.parametrised.model.arm, planned)
        self.memo.titles[title] += 1
        number = self.memo.titles[title]
        steps.begin(title if number == 1 else f"{title}, round {number}", len(candidates))
        return search_round(
            data, refit, present, candidates, steps, most=most, check=self._check(model),
            unseen=lambda w: self._unseen(data, w.refit), on_stage=steps.begin,
            least_share=PROMISING_SHARE if model.within_laws else 0.0, **callbacks,
        )  # fmt: skip

    def _callbacks(
        self, model: FittedModel, candidates: Sequence[Effect]
    ) -> dict[str, Callable[..., None]]:
        """What a round calls with its screen and with each refit."""
        on_ranking = self.on_ranking
        if on_ranking is None or self.added(model):
            return {}  # a ranking is of the model as given

        def refitted(partial: Round) -> None:
            tested = {c.effect.kind for c in partial.screen.output_changes}
            remaining = partial.screen.remaining_trials
            untested = tuple(c.title for c in candidates if remaining and c.kind not in tested)
            on_ranking(ranking_of(partial, model.data), RemainingTrials(remaining, untested))

        def screened(so_far: Screen) -> None:
            refitted(Round(so_far, (), None, model.refit, model.refit, model.data))

        return {"on_screen": screened, "on_refit": refitted}

    def _reduction(self, model: FittedModel) -> Move | None:
        """The move that takes out what is not needed."""
        if not self.added(model):
            return None
        self.progress.stage(messages.REMOVAL)
        # What an idealised law may leave counts as noise where no listed effect explains it.
        exact = within_noise(model.data, model.refit.errors)
        data = model.data if exact else model.with_law_errors.data
        stopped, stated = self.progress.stopped, len(self.memo.stated)
        kept = needed_effects(data, model.refit, model.effects, stated, stopped)
        if len(kept.effects) == len(model.effects) and kept.effects == model.effects:
            return None
        gone = tuple(e.title for e in model.effects if e not in kept.effects)
        values = kept.refit.parametrised.values()
        after = fit_model(model.data, kept.effects, values, self.progress.stopped)
        return Move(after, f"Without: {', '.join(gone)}", removed=gone)

    def _exchange(self, model: FittedModel) -> Move | None:
        """The move that puts a better effect in the place of others: the first one was chosen while
        the others were missing."""
        if len(self.added(model)) < 2 or self.progress.stopped():
            return None
        self.progress.stage(messages.EXCHANGE)
        screened, data = self._screened(model)
        count, stopped = len(self.memo.stated), self.progress.stopped
        exchange = best_exchange(data, model.refit, model.effects, count, screened, stopped)
        if exchange is None:
            return None
        values = exchange.refit.parametrised.values()
        after = fit_model(data, exchange.effects, values, self.progress.stopped)
        # The whitener knows the error of the model as it stands; one that leaves relevantly more
        # of it is no better explanation, whatever its colour says.
        worse = after.refit.cost - model.refit.cost > RELEVANT * data.count
        if worse or self._check(model)(after.data, after.refit):
            return None
        gone = tuple(e.title for e in model.effects if e not in exchange.effects)
        new = [e for e in exchange.effects if e not in model.effects]
        title = f"{listed([e.title for e in new])} for {', '.join(gone)}"
        return Move(after, title, tuple(e.kind for e in new), gone)

    def _screened(self, model: FittedModel) -> tuple[Screen, FitProblem]:
        """The screen of a model, and the data with its motions."""
        known = self.memo.rounds.get(model.key)
        data = with_shared_motions(model.data, model.refit.parametrised)
        if known is not None and known.model.refit is model.refit:
            return known.round.screen, data
        candidates = applicable(data, model.effects, self.options.candidates)
        h, stopped = model.refit.parametrised, self.progress.stopped
        return screen(data, h, model.effects, candidates, lambda _: stopped()), data

    def _unseen(self, data: FitProblem, refit: Refit) -> float | None:
        """Squared error per sample on recordings that no fit uses; None without any."""
        fitted = self.memo.validation_fit(FittedModel(data, refit, ()))
        return None if fitted is None else cost_of(fitted.errors) / fitted.data.count

    def _check(self, model: FittedModel) -> ModelCheck:
        """What refuses a model that takes the place of this one."""
        return model_check(model.data, model.refit, model.within_laws, self._unseen)


def _leads_on(model: FittedModel, visited: Mapping[tuple[str, ...], float]) -> bool:
    """Whether a model is new, or at a better minimum than when it was visited: an effect that came
    and went may have brought the others there."""
    before = visited.get(model.key, math.inf)
    return model.refit.cost < before - RELEVANT * model.data.count
