"""On Diagnose: the laws that are proposed for what no listed effect explains."""

from __future__ import annotations

from itertools import zip_longest

from flexgui.core.diagnose.evidence import WHOLE_SHARE
from flexgui.core.results import NOTHING, UNLISTED, Proposal
from flexgui.page.panel import PageContext, PageElement
from flexgui.page.plot import Plot
from flexgui.page.widgets import HtmlBlock
from flexgui.stages.diagnose.model_versions import ModelVersion
from flexgui.stages.diagnose.panel_candidates import WORDS
from flexgui.views.layout import Figure
from flexgui.views.proposal import law_over_variable

LAW_HEIGHT = 240.0
"""px"""


class ProposedLaws(PageElement):
    """What the rest depends on, and each law with a button that adds it."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._words = HtmlBlock(self.gui)
        context.actions.register("add law", lambda k: self.session.diagnosis.add_law(int(k)))
        context.actions.register("leave out events", lambda _: self.session.diagnosis.leave_out())
        context.actions.register("propose law", lambda _: self.session.diagnosis.propose())

    def show(self, version: ModelVersion | None, able: bool, marked: bool) -> None:
        """Of a version; `able`: whether something can be added now, `marked`: whether the first
        law is the next step."""
        found = None if version is None else version.diagnosis
        if found is None:
            self._words.show()
        elif found.proposal is not None:
            self._words.show(WORDS.laws(found.proposal, found.verdict == UNLISTED, able, marked))
        else:
            free = able and not self.session.run.busy
            self._words.show("" if found.verdict == NOTHING else WORDS.ask_for_laws(free))


class LawFigure(PageElement):
    """The first law over its variable, and what the model with it shows in its place."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._words = HtmlBlock(self.gui)
        self._plots = Plot(context, 0.5), Plot(context, 0.5)
        self._drawn: Proposal | None = None

    def refresh(self) -> None:
        """Draws the proposal of the newest version; nothing where no variable carries the rest."""
        proposal = _proposal(self.session.diagnosis.newest)
        if proposal is self._drawn:
            return
        self._drawn = proposal
        figures: list[Figure] = []
        if proposal is None or not proposal.carriers or proposal.events:
            self._words.show()
        elif not proposal.laws:
            carrier = proposal.carriers[0]
            shown = carrier.share >= WHOLE_SHARE
            self._words.show(WORDS.over_carrier(carrier) if shown else "")
            figures = [law_over_variable(carrier)] if shown else []
        else:
            law = proposal.laws[0]
            self._words.show(WORDS.over_variable(law))
            figures = [law_over_variable(term.carrier, term) for term in law.terms]
        for plot, figure in zip_longest(self._plots, figures):
            plot.show(figure, height=LAW_HEIGHT)


def _proposal(version: ModelVersion | None) -> Proposal | None:
    found = None if version is None else version.diagnosis
    return None if found is None else found.proposal
