"""The search: moves from model to model until none improves what is left.

A move adds the effect, or the set of effects, that the recordings need most (forward selection of
physical effects: Bacher and Madsen 2011), takes out what is not needed, puts a better effect in the
place of others, or sees the same model with other bending shapes or against a better noise. The
questions are asked in one order, and no model is visited twice against the same noise, but once
more at a better minimum.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

from ..diagnose import progress_messages as messages
from ..diagnose.bending_shapes import resolved
from ..diagnose.candidates import applicable
from ..diagnose.evidence import Round
from ..diagnose.judgement import Judge
from ..diagnose.linear_screen import Screen
from ..diagnose.memo import Memo
from ..diagnose.noise_update import against_noise_alone, higher_floors, lower_floors
from ..diagnose.output_changes import trials
from ..diagnose.ranking import ranking_of
from ..diagnose.remaining_error import remaining_error
from ..diagnose.removal_and_exchange import best_exchange, needed_effects, with_stated_sizes
from ..diagnose.search_options import Options, RankingCallback, RemainingTrials
from ..diagnose.search_round import search_round
from ..effects.effect import Effect
from ..estimate.fitted_model import FittedModel, fit_model
from ..estimate.minimum import RELEVANT, enough_substeps
from ..estimate.problem import within_noise
from ..identify.loop_rate import better_loop
from ..noise.noise_floor import Floor
from ..progress import Progress
from ..results import Proposal
from ..sentences import listed


class LawSearch(NamedTuple):
    """Laws that nobody listed, which compete with what a search adds."""

    instead: Callable[[Search, Found], Found | None]
    """Where a search ends at once, since a law explains all that its first addition does not."""
    at_end: Callable[[Search, Found], Found]
    """Where a search ends if laws compete with all that it has added."""


MOVES_PER_EFFECT = 4
"""Moves of a search per effect that it may find and one, at most: of each one addition, a removal
or an exchange, other shapes and another noise."""


class Move(NamedTuple):
    """A model, and how the search came to it from the one before."""

    model: FittedModel
    title: str = ""
    """Empty: the same model, seen otherwise."""
    added: tuple[str, ...] = ()
    """Ids of the effects that came in."""
    removed: tuple[str, ...] = ()
    """Titles of those that went."""
    to_confirm: bool = False
    """Whether it counts only if another effect follows."""


Path = tuple[Move, ...]


class Found(NamedTuple):
    """Where a search ended."""

    path: Path
    proposed: tuple[str, ...]
    """Ids of more effects that pass every test, which the limit keeps out."""
    proposal: Proposal | None = None
    """Laws for what no listed effect explains, where they were looked for."""

    @property
    def model(self) -> FittedModel:
        """The last model."""
        return self.path[-1].model


@dataclass
class Search:
    """The moves of one diagnosis."""

    options: Options
    progress: Progress
    on_ranking: RankingCallback | None
    memo: Memo
    laws: LawSearch | None = None
    proposed: tuple[str, ...] = ()
    """Ids of effects that pass every test on the last model, which the limit keeps out."""

    def run(self, base: FittedModel) -> Found:
        """The whole search from the model as given, with the bending shapes that it needs, and with
        the last model's sizes as stated where that leaves no more."""
        path: Path = (Move(self._resolved(base)),)
        unconfirmed: Found | None = None
        law = self.laws and self.laws.instead
        for _ in range(MOVES_PER_EFFECT * (self.options.max_effects + 1)):
            path = _with_last(path, self._prepared(path[-1].model))
            self.memo.visit(path[-1].model)
            if law is not None and self.added(path[-1].model):
                end, law = law(self, Found(path, ())), None
                if end is not None:
                    return end
            move = self._next_move(path)
            if move is None or self.progress.stopped():
                break
            unconfirmed = Found(path, self.proposed) if move.to_confirm else unconfirmed
            path = (*path, move) if move.title else _with_last(path, move.model)
        found = Found(path, self.proposed)
        # An estimate of the noise that no effect confirms is no better than the one before.
        if unconfirmed is not None and unconfirmed.model.key == found.model.key:
            found = unconfirmed
        last = with_stated_sizes(found.model, len(self.memo.stated), self.progress.stopped)
        found = found._replace(path=_with_last(found.path, last))
        return found if self.laws is None else self.laws.at_end(self, found)

    def _next_move(self, path: Path) -> Move | None:
        """The first answer that leads from the last model to one that is new; None where nothing
        leads on."""
        questions = (
            self._noise_of_better_model, self._shapes_of_better_model, self._addition,
            self._reduction, self._exchange, self._shapes, partial(self._noise, path[0].model),
            self._noise_alone,
        )  # fmt: skip
        for ask in questions:
            move = None if self.progress.stopped() else ask(path[-1].model)
            if move is not None and self.memo.is_new(move.model):
                return move
        return None

    def _prepared(self, model: FittedModel) -> FittedModel:
        """The model with steps that are fine enough, and the rate of the rig's loop that its
        torques show."""
        return self._with_better_loop(self._finer(model))

    def _noise_of_better_model(self, model: FittedModel) -> Move | None:
        """Added effects leave what may be noise: before more are added, the noise as this model
        shows it."""
        errors = model.refit.errors
        if not self.added(model) or within_noise(model.data, errors):
            return None
        if remaining_error(model.data, errors).above:
            return None
        floors = higher_floors(model, self.options, True)
        return None if floors is None else self._against(model, floors)

    def _shapes_of_better_model(self, model: FittedModel) -> Move | None:
        """Added effects leave more than noise: first the bending shapes that the model needs."""
        if not self.added(model) or within_noise(model.data, model.refit.errors):
            return None
        return self._shapes(model)

    def _shapes(self, model: FittedModel) -> Move | None:
        """The bending shapes that the model needs: a missing effect has hidden the need for one, or
        has seemed to be one."""
        other = self._resolved(model)
        return None if other is model else Move(other)

    def _noise(self, first: FittedModel, model: FittedModel) -> Move | None:
        """A better estimate of the noise; `first`: the model as given."""
        changed = model.key != first.key
        floors = higher_floors(model, self.options, changed)
        if floors is not None:
            return self._against(model, floors)
        known = self.memo.rounds.get(first.key)
        screened = None if known is None else known.round.screen
        floors = lower_floors(model, self.options, screened, changed)
        if floors is None:
            return None
        return self._against(model, floors)._replace(to_confirm=True)

    def _noise_alone(self, model: FittedModel) -> Move | None:
        """A model within the noise and what a person allows it to miss, against the noise alone:
        a tolerance hides nothing that is explained."""
        within = within_noise(model.data, model.refit.errors)
        other = against_noise_alone(model, self.options) if within else None
        return None if other is None else Move(other, to_confirm=True)

    def _against(self, model: FittedModel, floors: dict[str, Floor]) -> Move:
        """The model at its minimum against another noise."""
        self.progress.stage(messages.NOISE)
        return Move(model.against(model.data.in_floors(floors)))

    def _resolved(self, model: FittedModel) -> FittedModel:
        """The model with the bending shapes that it needs."""
        if not any(self.memo.modes):
            return model
        self.progress.stage(messages.SHAPES)
        return resolved(model, self.memo.modes, self.progress.stopped, self.memo.shapes)

    def _finer(self, model: FittedModel) -> FittedModel:
        """The model with steps that are fine enough for what it leaves; as it is where they are."""
        data, values = model.data, model.refit.problem.all_values()
        steps = enough_substeps(data, model.effects, values)
        if steps // 2 <= data.anchored_substeps:  # enough where an anchor corrects them
            return model
        finer = replace(data, substeps=steps, anchored_substeps=steps // 2)
        return fit_model(finer, model.effects, values, self.progress.stopped)

    def _with_better_loop(self, model: FittedModel) -> FittedModel:
        """The model with the rate of the rig's loop that leaves less error: an effect that was
        missing may have hidden it."""
        problem = model.refit.problem
        servo = better_loop(problem.residuals, problem.vector)
        if servo is None:
            return model
        data = model.data.for_bare(model.data.bare.steered_by(servo))
        other = fit_model(data, model.effects, problem.all_values(), self.progress.stopped)
        return other if other.refit.cost < model.refit.cost else model

    def added(self, model: FittedModel) -> tuple[Effect, ...]:
        """The effects of a model that nobody stated."""
        return model.effects[len(self.memo.stated) :]

    def _addition(self, model: FittedModel) -> Move | None:
        """The move that adds what is missing most."""
        most, self.proposed = self.options.max_effects - len(self.added(model)), ()
        within = within_noise(model.data, model.refit.errors)
        if within and (self.added(model) or model.key in self.memo.rounds):
            return None
        if most < 1 and not remaining_error(model.with_law_errors.data, model.refit.errors).above:
            return None
        found = self._round(model, max(most, 1))
        effects = [w.screened.effect for w in found.added]
        kinds = tuple(e.kind for e in effects)
        if not effects or most < 1:
            self.proposed = kinds
            return None
        after = FittedModel(found.data, found.after, (*model.effects, *effects))
        return Move(after, listed([e.title for e in effects]), kinds)

    def _round(self, model: FittedModel, most: int) -> Round:
        """Ranks the candidates on a model and tests the best; kept in the memo."""
        candidates = applicable(model.data, model.effects, self.options.candidates)
        title = messages.round_title(model.effects, bool(self.options.candidates))
        reports = self._callbacks(model, candidates)
        found = self.round_of(model, candidates, title, most, **reports)
        self.memo.keep(model, found)
        return found

    def round_of(
        self, model: FittedModel, candidates: Sequence[Effect], title: str, most: int,
        **callbacks: Callable[..., None],
    ) -> Round:  # fmt: skip
        """Rank these candidates on a model and test the best."""
        data, refit, present = model.data, model.refit, model.effects
        planned = [t for c in candidates for t in trials(refit.problem, c, data)]
        steps = messages.RoundProgress(self.progress, refit.problem.model.arm, planned)
        self.memo.titles[title] += 1
        number = self.memo.titles[title]
        steps.begin(title if number == 1 else f"{title}, round {number}", len(candidates))
        return search_round(
            data, refit, present, candidates, steps, most=most, judge=self._judge(model),
            on_stage=steps.begin, **callbacks,
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
        values = kept.refit.problem.values()
        after = fit_model(model.data, kept.effects, values, self.progress.stopped)
        return Move(after, f"Without: {', '.join(gone)}", removed=gone)

    def _exchange(self, model: FittedModel) -> Move | None:
        """The move that puts a better effect in the place of others: the first one was chosen while
        the others were missing."""
        if len(self.added(model)) < 2:
            return None
        self.progress.stage(messages.EXCHANGE)
        known, stopped = self.memo.rounds.get(model.key), self.progress.stopped
        same = known is not None and known.model.refit is model.refit
        screened = known.round.screen if known is not None and same else None
        candidates = applicable(model.data, model.effects, self.options.candidates)
        exchange = best_exchange(model, len(self.memo.stated), candidates, screened, stopped)
        if exchange is None:
            return None
        values = exchange.refit.problem.values()
        after = fit_model(model.data, exchange.effects, values, self.progress.stopped)
        # The whitener knows the error of the model as it stands; one that leaves relevantly more
        # of it is no better explanation, whatever its colour says.
        new = [e for e in exchange.effects if e not in model.effects]
        worse = after.refit.cost - model.refit.cost > RELEVANT * model.data.count
        if worse or self._judge(model).objection(after.data, after.refit, new):
            return None
        gone = tuple(e.title for e in model.effects if e not in exchange.effects)
        title = f"{listed([e.title for e in new])} for {', '.join(gone)}"
        return Move(after, title, tuple(e.kind for e in new), gone)

    def _judge(self, model: FittedModel) -> Judge:
        """What refuses a model that takes the place of this one."""
        return Judge(model, self.memo.validation_fit)


def _with_last(path: Path, model: FittedModel) -> Path:
    """The path with its last model in this form."""
    return (*path[:-1], path[-1]._replace(model=model))
