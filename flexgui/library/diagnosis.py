"""What a diagnosis gives: verdict, ranking and the ladder of errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from flexgui.core.results import (
    LadderStep,
    Proposal,
    RankedEffect,
)
from flexgui.library.comparison import Comparison
from flexgui.library.identification import Identification
from flexgui.library.progress_callback import Callback
from flexgui.library.run_result import RunResult
from flexgui.library.shown import chosen, looked_up, paragraphs
from flexgui.sentences.verdict import all_paragraphs
from flexgui.views.headline import (
    comparisons_as_given,
)
from flexgui.views.ladder import ladder, ladder_table
from flexgui.views.ranking import ranking, ranking_table
from flexgui.views.table import html_table

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go


@dataclass(frozen=True, repr=False)
class Diagnosis(RunResult):
    """The missing effects, the evidence for them, and the error after each step."""

    @property
    def verdict(self) -> str:
        """'missing', 'nothing_missing', 'unlisted' or 'cannot_be_judged': of the model as given."""
        return self._diagnosis.verdict

    @property
    def final_verdict(self) -> str | None:
        """The same of what remains after the ladder; None where nothing was to be added."""
        return self._diagnosis.final_verdict

    @property
    def added(self) -> tuple[str, ...]:
        """Ids of the effects that were added, in their order."""
        return self._diagnosis.added

    @property
    def ranking(self) -> tuple[RankedEffect, ...]:
        """All candidates on the model as given, best first."""
        return self._diagnosis.ranking

    @property
    def steps(self) -> tuple[LadderStep, ...]:
        """The error ladder: the model as given, then after each effect."""
        return self._diagnosis.steps

    @property
    def words(self) -> tuple[str, ...]:
        """The verdict in words, a paragraph each."""
        return all_paragraphs(self._diagnosis)

    @property
    def _diagnosis(self) -> Any:
        assert self.outcome.diagnosis is not None
        return self.outcome.diagnosis

    def propose(self, progress: Callback | None = None) -> Proposal:
        """Propose laws for what the last model leaves.

        Args:
            progress: Called after each step; returning False stops.

        Returns:
            One to three laws, each with its formula, values and errors, or why there is none, and
            the variables that the rest depends on. `law.settings` is an effect for `with_effects`.

        Raises:
            InputError: Where the scenario or a recording is wrong.
        """
        if self._diagnosis.proposal is not None:
            found: Proposal = self._diagnosis.proposal
            return found
        return self.project().propose(progress)

    def compare_as_given(self) -> Comparison:
        """Compare measurements and the model as it was given."""
        before = comparisons_as_given(self.outcome)
        return Comparison(before or self.outcome.comparisons, self._diagnosis.floors or None)

    def to_dataframe(self, table: str = "ranking") -> pd.DataFrame:
        """Tabulate the diagnosis.

        Args:
            table: 'ranking', 'ladder', 'changes' (each parameter before and after what was added),
                'error_map' or 'parameters'.

        Raises:
            InputError: Where there is no such table.
        """
        from flexgui.export import tables

        names = {name: name for name in (*tables.OF_A_DIAGNOSIS, "parameters")}
        name = looked_up(names, table, f"to_dataframe: {table!r} is no table")
        return tables.table(self.outcome, name)

    def plot(self, view: str = "ladder") -> go.Figure:
        """Draw the diagnosis.

        Args:
            view: 'ladder' or 'ranking'.

        Raises:
            InputError: Where the view is not known or there is nothing to show.
        """
        views: dict[str, Any] = {
            "ladder": lambda: ladder(self.steps),
            "ranking": lambda: ranking(self.ranking, self._first_accepted),
        }
        return chosen(views, view)

    @property
    def _first_accepted(self) -> str | None:
        """The effect that the first round added."""
        return self._diagnosis.rounds[0].accepted if self._diagnosis.rounds else None

    def _repr_html_(self) -> str:
        steps = html_table(ladder_table(self._diagnosis))
        first = html_table(ranking_table(self.ranking, self._first_accepted))
        return str(paragraphs(self.words) + steps + first)


class StoppedError(RuntimeError):
    """A diagnosis was stopped before it began; `identification` is what there is."""

    def __init__(self, identification: Identification) -> None:
        super().__init__("The work was stopped before the diagnosis began.")
        self.identification = identification
