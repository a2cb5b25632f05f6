"""Third stage: the search, streaming while it runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar

from markupsafe import Markup

from flexgui.core.errors import InputError
from flexgui.core.parameters import Parameter
from flexgui.core.results import Outcome, Repeated
from flexgui.core.sensors import sensors
from flexgui.jobs.job import PAUSED, QUEUED, RUNNING, STOPPING
from flexgui.page import widgets
from flexgui.page.panel import PageContext, Panel
from flexgui.page.plot import Plot
from flexgui.page.widgets import Rebuilt, Words, joined, paragraph
from flexgui.sentences.written import ShownUnit, shown_unit
from flexgui.session import Topic
from flexgui.session.edit import Document, model_of, put
from flexgui.stages.identify.state import candidates, noisy, paper_points, stated
from flexgui.views.convergence import (
    History,
    Searched,
    live_convergence,
    live_parameters,
    live_plane,
)
from flexgui.views.fit_table import live_fit
from flexgui.views.headline import final_comparisons, given, standing
from flexgui.views.html import html_table
from flexgui.views.names import plain_symbol, typeset
from flexgui.views.parameter_tables import (
    given_parameters,
    paper_table,
    short_between_runs,
    short_parameters,
    standing_parameters,
)
from flexgui.views.summary import alarms, summary

METHODS = ("glocal", "local")
AUTOMATIC = "automatic"
EMPTY = (
    "Press Start identification: the cost, the parameters and the FIT of every recording appear "
    "here while it runs, and the population of a search in the plane of its first two parameters."
)


class IdentifyPanel(Panel):
    """Settings and progress on the right; what the search finds on the left."""

    kind: ClassVar[str] = "Identify"
    topics: ClassVar[frozenset[Topic]] = frozenset(
        {Topic.SCENARIO, Topic.RUN, Topic.OUTCOME, Topic.DIAGNOSIS}
    )

    def build_controls(self) -> None:
        context, session, gui = self.context, self.context.session, self.context.gui
        self._state = Words(gui)
        self._bar: Any = gui.add_progress_bar(0.0, visible=False)
        self._start = widgets.button(
            context,
            "Start identification",
            lambda: session.identification.start(),
            prominent=True,
        )
        self._pause = widgets.button(context, "Pause", session.run.pause)
        self._resume = widgets.button(context, "Go on", session.run.resume, prominent=True)
        self._stop = widgets.button(context, "Stop", session.run.stop)
        self._next = widgets.button(
            context, "Next: compare model and measurements", lambda: session.show("Compare"),
            prominent=True,
        )  # fmt: skip
        self._summary = Words(gui)
        with gui.add_folder("Fit settings"):
            widgets.choice(
                context, "Method", METHODS, lambda: session.document.scenario.identify.method,
                lambda v: session.document.change(put(("identify", "method"), v)),
                "glocal: one fit over all recordings; local: one for each.",
            )  # fmt: skip
            widgets.choice(
                context, "Output", (AUTOMATIC, *sensors()), self._output, self._put_output,
                "Which output is compared with the model.",
            )  # fmt: skip
            self._chosen = ChosenParameters(context)
        with gui.add_folder("Search settings", expand_by_default=False):
            self._whole("Population", "population", 4, 300)
            self._whole("Generations", "generations", 0, 10_000)
            self._whole("Seed", "seed", 0, 2**31)
            widgets.switch(
                context, "Refine", lambda: session.document.scenario.identify.refine,
                lambda v: session.document.change(put(("identify", "refine"), v)),
                "Follow the search with a least-squares refinement.",
            )  # fmt: skip

    def _whole(self, label: str, name: str, least: int, most: int) -> None:
        session = self.context.session
        widgets.number(
            self.context, label, lambda: getattr(session.document.scenario.identify, name),
            lambda v: session.document.change(put(("identify", name), int(v))), least, most, 1,
        )  # fmt: skip

    def _output(self) -> str:
        output = self.context.session.document.scenario.identify.output
        return output[0] if output else AUTOMATIC

    def _put_output(self, name: str) -> bool:
        wanted = None if name == AUTOMATIC else [name]
        return self.context.session.document.change(put(("identify", "output"), wanted))

    def build_plots(self) -> None:
        gui = self.context.gui
        self._about = Words(gui)
        self._cost, self._plane = Plot(gui, 0.33), Plot(gui, 0.42)
        self._table = Words(gui)
        self._repeated = Words(gui)
        self._fit = Plot(gui, 0.30)
        self._paper = Words(gui)

    def refresh(self) -> None:
        self._chosen.refresh()
        self._show_state()
        history = self._history()
        searched = self._searched()
        self._cost.show(live_convergence(history) if history else None)
        self._plane.show(live_plane(history, searched))
        session = self.context.session
        outcome = None if self._running else session.identification.outcome
        nothing = not history and outcome is None
        self._about.show(paragraph(EMPTY, "soft") if nothing else "")
        if outcome is None:
            table = live_parameters(history, searched)
            self._table.show(html_table(table) if table else "")
            self._repeated.show("")
            self._fit.show(None)
            self._summary.show("")
        else:
            whole = session.diagnosis.whole or outcome
            self._table.show(found_parameters(whole))
            self._repeated.show(_runs(outcome.repeated))
            self._fit.show(live_fit(final_comparisons(whole)))
            self._summary.show(_sentences(whole, self._old(), session.diagnosis.known_biased))
        self._show_paper()

    @property
    def _running(self) -> bool:
        run = self.context.session.run.state
        return run.kind == "identify" and run.busy

    def _history(self) -> History:
        session = self.context.session
        if self._running or session.identification.outcome is None:
            return session.run.state.history
        return {
            f.label: f.convergence for f in session.identification.outcome.fits if f.convergence
        }

    def _searched(self) -> list[Searched]:
        session = self.context.session
        scenario = (
            session.document.scenario
            if self._running
            else session.identification.outcome_of or session.document.scenario
        )
        try:
            found = stated(scenario, model_of(scenario))
        except InputError:
            return []
        return [Searched(p.name, p.symbol, p.unit, p.lower, p.upper) for p in found]

    def _fitted(self) -> list[Markup]:
        """Symbols of what a fit of the scenario varies, the sizes of its effects too."""
        try:
            sizes = model_of(self.context.session.document.scenario).effect_parameters.values()
        except InputError:
            return []
        searched = [typeset(s.symbol, s.name) for s in self._searched()]
        return searched + [typeset(p.symbol, p.name) for p in sizes]

    def _old(self) -> bool:
        session = self.context.session
        return (
            session.identification.outcome is not None
            and session.identification.outcome_of != session.document.scenario
        )

    def _show_state(self) -> None:
        session, run = self.context.session, self.context.session.run.state
        busy = self._running
        self._start.visible = not busy
        self._start.disabled = self.context.read_only or session.run.busy
        done = session.identification.outcome is not None and not busy and not self._old()
        self._start.label = "Start again" if done else "Start identification"
        self._start.color = "gray" if done else "blue"
        self._pause.visible = busy and run.phase == RUNNING
        self._resume.visible = busy and run.phase == PAUSED
        self._stop.visible = busy and run.phase != STOPPING
        self._next.visible = done
        self._bar.visible = busy
        self._bar.value = 100.0 * (run.share or 0.0)
        self._bar.animated = busy and run.phase == RUNNING
        self._state.show(paragraph(self._sentence(), "lead"))

    def _sentence(self) -> Markup | str:
        session, run = self.context.session, self.context.session.run.state
        if not self._running:
            count = sum(r.role == "estimate" for r in session.document.scenario.recordings)
            what = Markup(", ").join(self._fitted()) or "none yet"
            many = "1 recording" if count == 1 else f"{count} recordings"
            return Markup("{} to fit; parameters: {}.").format(many, what)
        if run.phase == QUEUED:
            place = "" if run.place is None else f", place {run.place} in the queue"
            return f"Waiting{place}."
        words = {PAUSED: "Paused", STOPPING: "Stopping"}.get(run.phase, run.stage or "Starting")
        steps = f" {run.done} of {run.total}" if run.total else ""
        left = session.run.remaining_seconds
        time = f", about {max(left, 1.0):.0f} s left" if left is not None else ""
        at = f": {run.text}" if run.text else ""
        return f"{words}{steps}{at}{time}."

    def _show_paper(self) -> None:
        session = self.context.session
        scenario = session.identification.outcome_of or session.document.scenario
        points = paper_points(scenario)
        if points is None or session.identification.outcome is None or self._running:
            self._paper.show("")
            return
        table = paper_table(session.identification.outcome.fits, points, noisy(scenario))
        self._paper.show(
            joined(paragraph("The paper's table beside ours", "lead"), html_table(table))
        )


BIASED_NOTE = "Biased, since an effect is missing: Diagnose says which."


def _sentences(outcome: Outcome, old: bool, biased: bool) -> Markup:
    alarming = (paragraph(text, "alarm") for text in alarms(outcome))
    note = paragraph("The settings have changed since; start again to renew this.", "bad")
    doubt = paragraph(BIASED_NOTE, "bad") if biased else ""
    sentences = (paragraph(text) for text in summary(outcome))
    return joined(*alarming, doubt, *sentences, note if old else "")


def _runs(found: Sequence[Repeated]) -> Markup:
    """How well the parameters repeat, and which run differs; nothing where nothing was repeated."""
    table = short_between_runs(found)
    if table is None:
        return Markup("")
    odd = any(one.disagreeing for one in found)
    lead = paragraph("Runs of the same experiment differ." if odd else "The runs agree.", "lead")
    return joined(lead, Markup("<div class='scroll'>{}</div>").format(html_table(table)))


FIRST_FIT = "The first fit: of the identification, before the diagnosis"


def found_parameters(outcome: Outcome) -> Markup:
    """Those of the model as it now stands; the first fit's in a fold where a diagnosis has made its
    own."""
    found = html_table(short_parameters(standing_parameters(outcome), standing(outcome)))
    first = given_parameters(outcome)
    if first is None:
        return found
    fold = Markup("<details><summary>{}</summary>{}</details>")
    return found + fold.format(FIRST_FIT, html_table(short_parameters(first, given(outcome))))


ADD = "add a parameter …"


class ChosenParameters:
    """Rebuilt when other parameters are chosen; else its fields follow the session."""

    def __init__(self, context: PageContext) -> None:
        self._context = context
        self._rows = Rebuilt(context, context.gui.add_folder(None))
        self._add: Any = context.gui.add_dropdown("Add", (ADD,))
        if not context.read_only:
            self._add.on_update(self._added)

    def refresh(self) -> None:
        """Shows what the scenario states."""
        scenario = self._context.session.document.scenario
        try:
            model = model_of(scenario)
        except InputError:
            return
        chosen = stated(scenario, model)
        left = [n for n in candidates(model) if n not in scenario.identify.parameters]
        shape = (scenario.identify.parameters, scenario.arm.preset)
        if self._add.options != (ADD, *left):
            self._add.options = (ADD, *left)
        self._add.value = ADD

        def build() -> None:
            for parameter in chosen:
                self._row(parameter)

        self._rows.make(shape, build)

    def _row(self, p: Parameter) -> None:
        context, document, name = self._context, self._context.session.document, p.name
        unit = shown_unit(p.value or p.upper, p.unit)
        symbol = plain_symbol(p.symbol, name)
        bounds = context.gui.add_vector2(
            unit.label(symbol), self._bounds(name, p, unit), step=_step(p, unit),
            hint=f"{p.title or name}: bounds, from and to.",
        )  # fmt: skip

        def set_bounds(value: tuple[float, float]) -> bool:
            ends = [float(v) / unit.factor for v in value]
            return document.change(put(("identify", "bounds", name), ends))

        widgets.bind(context, bounds, lambda: self._bounds(name, p, unit), set_bounds)
        widgets.number(
            context, f"± {symbol}, known", lambda: self._prior(name) * unit.factor,
            lambda v: document.change(put(("identify", "prior", name), v / unit.factor or None)),
            least=0.0, hint="Standard deviation of the prior knowledge; 0: none.",
        )  # fmt: skip
        widgets.button(context, f"Do not estimate {symbol}", lambda: self._remove(name))

    def _bounds(self, name: str, p: Parameter, unit: ShownUnit) -> tuple[float, float]:
        low, high = self._context.session.document.scenario.identify.bounds.get(
            name, (p.lower, p.upper)
        )
        return _plain(low * unit.factor), _plain(high * unit.factor)

    def _prior(self, name: str) -> float:
        prior = self._context.session.document.scenario.identify.prior.get(name)
        return 0.0 if prior is None else prior.std

    def _remove(self, name: str) -> bool:
        def edit(document: Document) -> None:
            table = document.setdefault("identify", {})
            table["parameters"] = [n for n in table.get("parameters", ()) if n != name]
            for setting in ("bounds", "prior"):
                table.get(setting, {}).pop(name, None)

        return self._context.session.document.change(edit)

    def _added(self, event: Any) -> None:
        name = str(self._add.value)
        if event.client_id is None or name == ADD:
            return
        session = self._context.session
        names = [*session.document.scenario.identify.parameters, name]
        session.document.change(put(("identify", "parameters"), names))


def _plain(value: float) -> float:
    """As many digits as a field shows."""
    return float(f"{value:.4g}")


def _step(p: Parameter, unit: ShownUnit) -> float:
    size = abs(p.value * unit.factor) or 1.0
    return float(10.0 ** round(math.log10(size) - 2))
