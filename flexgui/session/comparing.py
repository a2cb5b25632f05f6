"""The looks at the models of the way, and what they say about where the newest one fails."""

from __future__ import annotations

from abc import ABC
from dataclasses import replace
from pathlib import Path

from core.results import Outcome, RecordingComparison
from flexgui.session.failing import WhereItFails, where_it_fails
from flexgui.session.look import Look, ladder_steps, story
from flexgui.session.running import Running

COMPARED_BY = (
    "Measured and modelled are compared as the diagnosis does it: the starts of each recording are "
    "fitted too, so that all figures agree with the error ladder."
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
        steps = ladder_steps(self.shown_looks[:1])
        return {e.channel: e.floor for e in steps[0].errors} if steps else None

    @property
    def failing(self) -> WhereItFails | None:
        """Where the model fails, as it is compared now; None where nothing was compared."""
        shown, floors = self.comparisons, self.floors
        known = self._failing
        if known is None or known.comparisons is not shown or known.stated != floors:
            known = where_it_fails(shown, floors) if shown else None
            self._failing = known
        return known

    def _before(self, look: Look) -> tuple[Look, ...]:
        """The steps that stay before this one: all, those to the same model, or none."""
        if look.title and not any(k.scenario == look.scenario for k in self.looks):
            return self.looks
        same = [k for k, each in enumerate(self.looks) if each.scenario == look.scenario]
        return self.looks[: same[-1]] if same else ()

    def _told_whole(self, outcome: Outcome) -> Outcome:
        last = self.looks[-1] if self.looks else None
        if last is None or last.scenario != self.outcome_of:
            return outcome
        shown = self.comparisons or outcome.comparisons
        notes = outcome.notes if shown is outcome.comparisons else (*outcome.notes, COMPARED_BY)
        return replace(outcome, comparisons=shown, notes=notes, diagnosis=story(self.looks))
