"""The model beside the measurements: ladder, maps and signals come from one fit."""

from __future__ import annotations

from abc import ABC
from dataclasses import replace
from pathlib import Path

from flexgui.core.results import MISSING, Estimate, LinearModel, Outcome, RecordingComparison
from flexgui.session.running import Running
from flexgui.stages.compare.error_maps import WhereItFails, where_it_fails
from flexgui.stages.diagnose.look import Look, ladder_steps, story
from flexgui.views.pooled import overall_estimates

COMPARED_BY = (
    "Measurement and model are compared as in the diagnosis: the initial state of each recording "
    "is fitted too, so that all figures agree with the error ladder."
)


class Comparing(Running, ABC):
    """Ladder, maps and signals come from one fit, so that they agree."""

    def __init__(self, key: str, folder: Path) -> None:
        super().__init__(key, folder)
        self.looks: tuple[Look, ...] = ()
        """The way so far, each step complete or stopped by the person."""
        self.pending: Look | None = None
        """What the worker looks at now."""
        self._failing: WhereItFails | None = None
        self._scale: tuple[object, float] = (None, 1.0)

    @property
    def shown_looks(self) -> tuple[Look, ...]:
        """The way with what the worker has told so far."""
        if self.pending is None or self.pending.found is None:
            return self.looks
        return (*self._before(self.pending), self.pending)

    @property
    def look(self) -> Look | None:
        """The newest of them."""
        return next(reversed(self.shown_looks), None)

    @property
    def comparisons(self) -> tuple[RecordingComparison, ...]:
        """Measured against modelled: by the look's fit where there is one of the newest model, so
        that maps, ladder and signals agree; else by the identification."""
        look, outcome = self.look, self.outcome
        fitted = () if outcome is None else outcome.comparisons
        if look is None or not look.comparisons:
            return fitted
        identified_since = look is not self.pending and outcome is not look.outcome
        current = look.scenario == (self.outcome_of or self.scenario) and not identified_since
        return look.comparisons if current or look is self.pending else fitted

    @property
    def floors(self) -> dict[str, float] | None:
        """channel -> floor, those that the ladder stands on; None before anything was looked at."""
        steps = ladder_steps(self.shown_looks)
        return {e.channel: e.floor for e in steps[-1].errors} if steps else None

    @property
    def failing(self) -> WhereItFails | None:
        """Where the model fails, as it is compared now; None where nothing was compared."""
        shown, floors = self.comparisons, self.floors
        known = self._failing
        if known is None or known.comparisons is not shown or known.stated != floors:
            known = where_it_fails(shown, floors) if shown else None
            self._failing = known
        return known

    @property
    def worst_error(self) -> float:
        """What the darkest colour of the arm stands for, in floors: the worst error of the way's
        first look, so that an arm whose error is gone is seen to have lost its colour."""
        first = next(iter(self.shown_looks), None)
        shown = first.comparisons if first is not None and first.comparisons else self.comparisons
        if self._scale[0] is not shown:
            failing = self.failing
            if shown is not self.comparisons or failing is None:
                failing = where_it_fails(shown, self.floors) if shown else None
            traces = () if failing is None else tuple(failing.now.values())
            self._scale = (shown, max([one.worst for one in traces], default=1.0))
        return self._scale[1]

    def _before(self, look: Look) -> tuple[Look, ...]:
        """The steps that stay before this one: all, those to the same model, or none."""
        if look.title and not any(k.scenario == look.scenario for k in self.looks):
            return self.looks
        same = [k for k, each in enumerate(self.looks) if each.scenario == look.scenario]
        return self.looks[: same[-1]] if same else ()

    def _complete_outcome(self, outcome: Outcome) -> Outcome:
        last = self.looks[-1] if self.looks else None
        if last is None or last.scenario != self.outcome_of:
            return outcome
        shown = self.comparisons or outcome.comparisons
        notes = outcome.notes if shown is outcome.comparisons else (*outcome.notes, COMPARED_BY)
        diagnosis = story(self.looks)
        diagnosis = diagnosis and replace(diagnosis, linear_model=self.linear_model)
        given = self.first_fit if diagnosis is not None and diagnosis.added else ()
        return replace(outcome, comparisons=shown, notes=notes, diagnosis=diagnosis, as_given=given)

    @property
    def first_fit(self) -> tuple[Estimate, ...]:
        """Estimates of the way's first model, which the last result may no longer be about."""
        first = next(iter(self.shown_looks), None)
        if first is None:
            return ()
        if first.outcome is not None:
            return overall_estimates(first.outcome.fits)
        return () if first.found is None else first.found.step.parameters

    @property
    def whole(self) -> Outcome | None:
        """The last result with the way to it, as the report tells it."""
        return None if self.outcome is None else self._complete_outcome(self.outcome)

    @property
    def linear_model(self) -> LinearModel | None:
        """What the linear model costs, where the first model of the way was identified with it."""
        from flexgui.core.workbench import linear_model

        first = next(iter(self.shown_looks), None)
        if first is None or first.diagnosis is None or first.outcome is None:
            return None
        if first.outcome.level != "lpv":
            return None
        return linear_model(first.outcome.fits, first.outcome.comparisons, first.diagnosis)

    @property
    def known_biased(self) -> bool:
        """Whether an effect is known to be missing in the model of the last result."""
        same = [look.diagnosis for look in self.shown_looks if look.scenario == self.outcome_of]
        return any(found is not None and found.verdict == MISSING for found in same)
