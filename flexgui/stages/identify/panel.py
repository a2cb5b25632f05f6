"""Third stage: the search, streaming while it runs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from markupsafe import Markup

from flexgui.core.errors import InputError
from flexgui.core.results import Outcome, RecordingComparison, Repeated
from flexgui.core.scenario.schema import Scenario
from flexgui.core.sensors import sensors
from flexgui.jobs.job import PAUSED, RUNNING, STOPPING
from flexgui.page.earlier_work import FIT, other_settings
from flexgui.page.job_status import waiting
from flexgui.page.panel import Panel
from flexgui.page.plot import Plot
from flexgui.page.widgets import (
    HtmlBlock,
    button,
    choice,
    color,
    folded,
    joined,
    number,
    paragraph,
    set_options,
    stage_macros,
    switch,
)
from flexgui.session.scenario_edits import cached_model, set_value
from flexgui.session.state import Topic
from flexgui.stages.identify.panel_parameters import ChosenParameters, parameter_text
from flexgui.stages.identify.panel_profile import ProfileChoice, ProfileFigure
from flexgui.stages.identify.state import noisy, paper_points, stated
from flexgui.views.comparison import live_worst
from flexgui.views.convergence import (
    History,
    Searched,
    live_convergence,
    live_descent,
    live_parameters,
    live_plane,
)
from flexgui.views.fit_table import fit_dots
from flexgui.views.headline import final_comparisons, final_estimates, first_estimates
from flexgui.views.names import TITLES
from flexgui.views.parameter_tables import (
    final_parameters,
    first_parameters,
    paper_table,
    short_between_runs,
    short_parameters,
)
from flexgui.views.summary import implausible, lead_sentences, summary
from flexgui.views.table import html_table

WORDS = stage_macros("identify", waiting=waiting)
METHODS = {
    "glocal": "All recordings together (glocal)",
    "local": "Each recording by itself (local)",
}
AUTOMATIC = "Automatic"
WHOLE_NUMBERS = (
    ("Population", "population", (4, 300, 1)),
    ("Generations", "generations", (0, 10_000, 1)),
    ("Seed", "seed", (0, 2**31, 1)),
)
"""Label, setting of [identify], limits."""


class IdentifyPanel(Panel):
    """Settings and progress on the right; what the search finds on the left."""

    kind = "Identify"
    topics = frozenset({Topic.SCENARIO, Topic.RUN, Topic.OUTCOME, Topic.DIAGNOSIS})

    @property
    def done(self) -> bool:
        return self.session.identification.current is not None

    def build_controls(self) -> None:
        context, session, gui = self.context, self.session, self.gui
        self._state = HtmlBlock(gui)
        self._bar: Any = gui.add_progress_bar(0.0, visible=False)
        self._start = button(
            context, "Start identification", session.identification.start, prominent=True
        )
        self._pause = button(context, "Pause", session.run.pause)
        self._resume = button(context, "Go on", session.run.resume, prominent=True)
        self._stop = button(context, "Stop", session.run.stop)
        self._next = button(
            context, "Next: compare model and measurements", lambda: session.show("Compare"),
            prominent=True,
        )  # fmt: skip
        self._summary = HtmlBlock(gui)
        with gui.add_folder("Fit settings"):
            choice(
                context, "Method", tuple(METHODS.values()), lambda: METHODS[self._get("method")],
                lambda words: self._put("method", next(m for m in METHODS if METHODS[m] == words)),
            )  # fmt: skip
            self._output = choice(
                context, "Output", tuple(self._outputs()), self._output_shown,
                lambda words: self._put("output", self._outputs()[words]),
                "Which measurement is compared with the model.",
            )  # fmt: skip
            self._chosen = ChosenParameters(context)
        with gui.add_folder("Search settings", expand_by_default=False):
            for label, name, limits in WHOLE_NUMBERS:
                number(context, label, limits, partial(self._get, name), partial(self._put, name))
            switch(
                context, "Refine", partial(self._get, "refine"), partial(self._put, "refine"),
                "Refine the result of the search by least squares.",
            )  # fmt: skip
        self._profile = ProfileChoice(context)

    def _outputs(self) -> dict[str, list[str] | None]:
        """Words -> what [identify] says: each output by itself, and those that stand together."""
        ways = [[kind] for kind in sensors()]
        ways += [list(self._get("output") or ())]
        return {AUTOMATIC: None} | {outputs_text(way): way for way in ways if way}

    def _output_shown(self) -> str:
        outputs = self._get("output")
        return AUTOMATIC if outputs is None else outputs_text(outputs)

    def _get(self, name: str) -> Any:
        return getattr(self.session.document.scenario.identify, name)

    def _put(self, name: str, value: Any) -> bool:
        return self.session.document.change(set_value(("identify", name), value))

    def build_plots(self) -> None:
        context, gui = self.context, self.gui
        self._about = HtmlBlock(gui)
        self._signal, self._cost = Plot(context, 0.5), Plot(context, 0.5)
        self._plane = Plot(context, 0.42)
        self._table, self._repeated = HtmlBlock(gui), HtmlBlock(gui)
        self._fit = Plot(context, 0.30, wide=True)
        self._profile_figure = ProfileFigure(context)
        self._paper = HtmlBlock(gui)

    def refresh(self) -> None:
        self._chosen.refresh()
        self._profile.refresh()
        self._profile_figure.refresh()
        set_options(self._output, tuple(self._outputs()), self._output_shown())
        self._show_state()
        outcome = None if self._running else self.session.identification.outcome
        history = self._history(outcome)
        searched = self._searched()
        so_far = self.session.identification.so_far
        self._signal.show(live_worst(self._compared(outcome)))
        self._cost.show(live_convergence(history) if history else live_descent(so_far.costs))
        self._plane.show(live_plane(history, searched))
        started = history or so_far.comparison or outcome is not None
        self._about.show("" if started else WORDS.nothing_yet())
        if outcome is None:
            table = live_parameters(history, searched)
            self._table.show(html_table(table) if table else "")
            self._fit.show(None)
            for words in (self._repeated, self._summary, self._paper):
                words.show()
            return
        whole = self.session.diagnosis.whole or outcome
        self._table.show(parameters_html(whole))
        self._repeated.show(repeated_html(outcome.repeated))
        self._fit.show_whole(fit_dots(final_comparisons(whole)))
        biased = self.session.diagnosis.known_biased
        self._summary.show(
            other_settings(self.session, FIT),
            WORDS.converged(outcome.fits),
            WORDS.summary(implausible(whole), whole.findings, biased, lead_sentences(whole)),
            folded("Full summary", joined(*map(paragraph, summary(whole)))),
        )
        self._paper.show(paper_comparison(outcome, self._fitted_scenario))

    @property
    def _running(self) -> bool:
        run = self.session.run.state
        return run.kind == "identify" and run.busy

    @property
    def _fitted_scenario(self) -> Scenario:
        """The one of the last result; the present one where there is none."""
        return self.session.identification.outcome_of or self.session.document.scenario

    def _history(self, outcome: Outcome | None) -> History:
        if outcome is None:
            return self.session.run.state.history
        return {f.label: f.convergence for f in outcome.fits if f.convergence}

    def _compared(self, outcome: Outcome | None) -> list[RecordingComparison]:
        """With what was measured: of the result, else of the fit that runs."""
        if outcome is not None:
            return [r for r in final_comparisons(outcome) if r.role == "estimate"]
        comparison = self.session.identification.so_far.comparison
        return [] if comparison is None else [comparison]

    def _searched(self) -> list[Searched]:
        scenario = self.session.document.scenario if self._running else self._fitted_scenario
        try:
            parameters = stated(scenario, cached_model(scenario))
        except InputError:
            return []
        return [Searched(p.name, p.symbol, p.unit, p.lower, p.upper) for p in parameters]

    def _show_state(self) -> None:
        run, busy = self.session.run.state, self._running
        done = self.session.identification.current is not None and not busy
        self._start.visible = not busy
        self.enable(not self.session.run.busy, self._start)
        self._start.label = "Start again" if done else "Start identification"
        self._start.color = color(not done)
        self._pause.visible = self._bar.animated = busy and run.phase == RUNNING
        self._resume.visible = busy and run.phase == PAUSED
        self._stop.visible = busy and run.phase != STOPPING
        self._next.visible = done
        self._bar.visible = busy
        self._bar.value = 100.0 * (run.share or 0.0)
        self._state.show(self._state_words())

    def _state_words(self) -> Markup:
        """How the search stands; what would be fitted, the sizes of the model's effects too."""
        run, scenario = self.session.run, self.session.document.scenario
        if self._running:
            return Markup(WORDS.state(run.state, run.remaining_seconds))
        count = sum(r.role == "estimate" for r in scenario.recordings)
        try:
            sizes = cached_model(scenario).effect_parameters.values()
        except InputError:
            return Markup(WORDS.to_fit(count, ()))
        searched = [*stated(scenario, cached_model(scenario)), *sizes]
        return Markup(WORDS.to_fit(count, [parameter_text(p) for p in searched]))


def outputs_text(kinds: Sequence[str]) -> str:
    """'Joint encoders, tip position'"""
    words = ", ".join(TITLES.get(kind, sensors()[kind].title) for kind in kinds)
    return f"{words[0].upper()}{words[1:]}"


def paper_comparison(outcome: Outcome, scenario: Scenario) -> Markup:
    """The paper's table, where the scenario is its experiment."""
    points = paper_points(scenario)
    if points is None:
        return Markup("")
    table = paper_table(outcome.fits, points, noisy(scenario))
    return joined(paragraph("The paper's table beside ours", "lead"), html_table(table))


def repeated_html(repeated: Sequence[Repeated]) -> Markup:
    """How well the parameters repeat, and which run differs; nothing where nothing was repeated."""
    table = short_between_runs(repeated)
    if table is None:
        return Markup("")
    differs = any(parameter.disagreeing for parameter in repeated)
    return Markup(WORDS.repeated(html_table(table), differs))


def parameters_html(outcome: Outcome) -> Markup:
    """Final parameters; those of the first fit folded, if the diagnosis has its own fit."""
    table = html_table(short_parameters(final_parameters(outcome), final_estimates(outcome)))
    first = first_parameters(outcome)
    folded = "" if first is None else html_table(short_parameters(first, first_estimates(outcome)))
    return Markup(WORDS.parameters(table, folded))
