"""The model beside the measurements: ladder, maps and signals come from one fit."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flexgui.core.results import RecordingComparison
from flexgui.stages.compare.error_maps import WhereItFails, where_it_fails
from flexgui.stages.diagnose.look import ladder_steps

if TYPE_CHECKING:
    from flexgui.session.session import Session


class Comparison:
    """Follows from the diagnosis and the identification; worked out when it is looked at."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._failing: WhereItFails | None = None
        self._scale: tuple[object, float] = (None, 1.0)

    @property
    def shown(self) -> tuple[RecordingComparison, ...]:
        """Measured against modelled: by the look's fit where there is one of the newest model, so
        that maps, ladder and signals agree; else by the identification."""
        diagnosis, fitted = self._session.diagnosis, self._session.identification
        look, outcome = diagnosis.look, fitted.outcome
        by_fit = () if outcome is None else outcome.comparisons
        if look is None or not look.comparisons:
            return by_fit
        if look is diagnosis.pending:
            return look.comparisons
        of = fitted.outcome_of or self._session.document.scenario
        return look.comparisons if look.scenario == of and outcome is look.outcome else by_fit

    @property
    def floors(self) -> dict[str, float] | None:
        """channel -> floor, those that the ladder stands on; None before anything was looked at."""
        steps = ladder_steps(self._session.diagnosis.shown_looks)
        return {e.channel: e.floor for e in steps[-1].errors} if steps else None

    @property
    def failing(self) -> WhereItFails | None:
        """Where the model fails, as it is compared now; None where nothing was compared."""
        shown, floors = self.shown, self.floors
        known = self._failing
        if known is None or known.comparisons is not shown or known.stated != floors:
            known = where_it_fails(shown, floors) if shown else None
            self._failing = known
        return known

    @property
    def worst_error(self) -> float:
        """What the darkest colour of the arm stands for, in floors: the worst error of the way's
        first look, so that an arm whose error is gone is seen to have lost its colour."""
        first = next(iter(self._session.diagnosis.shown_looks), None)
        shown = first.comparisons if first is not None and first.comparisons else self.shown
        if self._scale[0] is not shown:
            failing = self.failing
            if shown is not self.shown or failing is None:
                failing = where_it_fails(shown, self.floors) if shown else None
            traces = () if failing is None else tuple(failing.now.values())
            self._scale = (shown, max([one.worst for one in traces], default=1.0))
        return self._scale[1]
