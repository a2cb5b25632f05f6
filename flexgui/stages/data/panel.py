"""Second stage: simulate experiments or upload recordings, view and correct them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from flexgui.core.arm.build import build_arm
from flexgui.core.excitation.excitation import Excitation
from flexgui.core.plugins import classes_of
from flexgui.core.scenario.schema import Scenario
from flexgui.library.shipped import is_as_begun, scenario_choices
from flexgui.page.panel import Panel
from flexgui.page.plot import Plot
from flexgui.page.tour import to_identification
from flexgui.page.widgets import (
    HtmlBlock,
    button,
    choice,
    color,
    noise_slider,
    number,
    paragraph,
    set_options,
    switch,
)
from flexgui.session.state import Topic
from flexgui.stages.data.panel_columns import ColumnChoice
from flexgui.stages.data.panel_own import WORDS, Arrivals, upload_button
from flexgui.stages.data.panel_recording import FindingList, RecordingSettings, wording_of
from flexgui.stages.data.panel_rig import RigForm
from flexgui.stages.data.rigs import Experiments, has_working_points
from flexgui.views.preview import as_in_file, constant_columns, constants, groups, preview
from flexgui.views.table import Column, Row, Table, html_table

NONE = "no recordings yet"
RECORDING_COLUMNS = (Column("Recording"), Column("Role"), Column("From"), Column("Check"))
ROLES = {"estimate": "to fit", "validate": "to validate"}
DEGREE = math.pi / 180.0


class DataPanel(Panel):
    """Right: sources of recordings. Left: the chosen recording."""

    kind = "Data"
    topics = frozenset({Topic.SCENARIO, Topic.RECORDINGS})

    @property
    def done(self) -> bool:
        """Whether recordings stand that a person has brought, made, opened or used."""
        scenario, fitted = self.session.document.scenario, self.session.identification
        used = fitted.outcome is not None or not is_as_begun(scenario)
        return bool(scenario.recordings) and used

    def build_controls(self) -> None:
        context, gui = self.context, self.gui
        self._wanted = Experiments()
        self._lead = HtmlBlock(gui)
        self._next = button(
            context, "Next: identify", lambda: to_identification(context), prominent=True
        )
        # At the top, where what a file asks for will stand.
        with gui.add_folder("Use your own files"):
            upload_button(context, "Upload a recording or a scenario")
            self._refused = HtmlBlock(gui)
            self._rig = RigForm(context)
            self._pick = gui.add_dropdown("Scenario", tuple(scenario_choices()))
            button(
                context, "Open this scenario", lambda: self.session.choose(str(self._pick.value))
            )
        self._choice = choice(
            context, "Recording", self._names(), self._name, self._chosen, "Which one is shown."
        )
        self._findings = FindingList(context)
        self._one = RecordingSettings(context)
        self._arrived = Arrivals(context)
        self._columns = ColumnChoice(context)
        self._experiments = gui.add_folder("Simulate experiments")
        with self._experiments:
            self._simulate_controls()
        self._list = HtmlBlock(gui)

    def _names(self) -> tuple[str, ...]:
        specs = self.session.document.scenario.recordings
        return tuple(spec.name for spec in specs) or (NONE,)

    def _name(self) -> str:
        names, name = self._names(), self.session.playback.cursor.recording
        return name if name in names else names[0]

    def _simulate_controls(self) -> None:
        context = self.context
        self._field("From θ2 [deg]", "first", 5.0, 175.0, 0.5, DEGREE)
        self._field("To θ2 [deg]", "last", 5.0, 175.0, 0.5, DEGREE)
        self._field("Points", "count", 1, 15, 1)
        self._field("Length [s]", "seconds", 0.2, 30.0, 0.1)
        kinds = tuple(classes_of("flexgui.core.excitation", Excitation))
        choice(
            context, "Excitation", kinds, lambda: self._wanted.excitation,
            lambda v: self._want(excitation=v), "Of the velocity references.",
        )  # fmt: skip
        self._field("Size [rad/s]", "amplitude", 0.01, 2.0, 0.01)
        noise_slider(context, "Noise of the camera")
        self._field("Seed", "seed", 0, 10000, 1)
        switch(
            context, "With a sweep", lambda: self._wanted.sweep, lambda v: self._want(sweep=v),
            "A validation recording: θ2 moves over the whole range.",
        )  # fmt: skip
        button(context, "Simulate these experiments", self._simulate)

    def _field(
        self, label: str, name: str, lowest: float, highest: float, step: float, unit: float = 1.0
    ) -> None:
        whole = isinstance(lowest, int)

        def get() -> float:
            value = getattr(self._wanted, name) / unit
            return int(value) if whole else round(value, 6)

        number(
            self.context, label, (lowest, highest, step), get,
            lambda v: self._want(**{name: v if whole else v * unit}),
        )  # fmt: skip

    def _want(self, **changes: Any) -> None:
        self._wanted = replace(self._wanted, **changes)

    def _simulate(self) -> None:
        document = self.session.document
        if document.change(self._wanted.edit(document.live.snr_db)):
            count = len(document.scenario.recordings)
            sentence = f"The scenario now has {count} recordings; one of them is shown."
            self.session.show_message(sentence)

    def _chosen(self, name: str) -> bool:
        if name == NONE:
            return False
        self.session.playback.move(recording=name, time=0.0, playing=False)
        return True

    def build_plots(self) -> None:
        self._about = HtmlBlock(self.gui)
        self._groups = HtmlBlock(self.gui)
        self._picked: dict[str, bool] = {}
        """Group of signals -> whether it is drawn, of those that a person has picked or removed."""
        self.context.actions.register("draw signals", self._draw_or_not)
        self._plot = Plot(self.context, 1.30, wide=True)
        self._warnings = HtmlBlock(self.gui)

    def refresh(self) -> None:
        session, scenario = self.session, self.session.document.scenario
        set_options(self._choice, self._names(), self._name())
        fitted = sum(spec.role == "estimate" for spec in scenario.recordings)
        others = len(scenario.recordings) - fitted
        self._lead.show(paragraph(f"{fitted} to fit, {others} to validate.", "lead"))
        findings = {spec.name: wording_of(session, spec.name) for spec in scenario.recordings}
        self._list.show(html_table(listed(scenario, findings)))
        # Where nothing can be fitted yet, or a file waits for an answer, that comes first.
        own = session.recordings
        self._refused.show(*(paragraph(sentence, "bad") for sentence in own.refused))
        waits = own.waiting is not None or own.imports.pending or own.rig.is_asked
        self._next.color = color(bool(fitted and not waits))
        self._findings.refresh(self._name())
        for each in (self._one, self._arrived, self._columns, self._rig):
            each.refresh()
        self._experiments.visible = has_working_points(scenario)
        self._show_recording(scenario)

    def _show_recording(self, scenario: Scenario) -> None:
        waiting, recording = self.session.recordings.waiting, self.session.playback.recording
        self._groups.show()
        if waiting is not None and waiting.inspection is not None:
            known = waiting.known
            first = [known[channel] for channel in waiting.offered if channel in known]
            drawn = as_in_file(waiting.inspection.pictures, known.get("t", ""), first)
            self._about.show(paragraph(f"{waiting.file}, as it stands in the file.", "lead"))
            self._plot.show(drawn)
            still = constant_columns(waiting.inspection.pictures, known.get("t", ""))
            self._warnings.show(paragraph(still, "soft"))
            return
        if recording is None or not scenario.recordings:
            self._about.show(WORDS.nothing_yet(self._experiments.visible))
            self._plot.show(None)
            self._warnings.show()
            return
        samples = f"{len(recording.time)} samples, {1.0 / recording.sample_time:.4g} Hz"
        self._about.show(paragraph(f"{recording.name}: {samples}.", "lead"))
        slides = [segment.joint == "prismatic" for segment in build_arm(scenario.arm).segments]
        shown = groups(recording)
        picked = [g for g, first in shown.items() if self._picked.get(g, first)]
        self._groups.show(WORDS.groups(shown, picked))
        # What fits is shown until a person picks.
        chosen = picked if self._picked.keys() & shown.keys() else None
        drawn = preview(recording, slides, chosen) if picked else None
        self._plot.show(drawn, self._begins())
        remarks = (constants(recording, slides), *recording.warnings)
        self._warnings.show(*(paragraph(text, "soft") for text in remarks))

    def _draw_or_not(self, group: str) -> None:
        """Draws a group of signals, or draws it no longer."""
        recording = self.session.playback.recording
        if recording is not None and group in (shown := groups(recording)):
            self._picked[group] = not self._picked.get(group, shown[group])
            self._show_recording(self.session.document.scenario)

    def _begins(self) -> float | None:
        """Time of the shown recording's first sample, s; None where none is shown."""
        recording = self.session.playback.recording
        if recording is None or self.session.recordings.waiting is not None:
            return None
        return float(recording.time[0])

    def move_cursor(self) -> None:
        self._plot.move_cursor(self._begins())


def listed(scenario: Scenario, checked: Mapping[str, str] | None = None) -> Table:
    """The scenario's recordings; `checked`: name -> result of the check in one word."""
    findings = checked or {}
    rows = []
    for spec in scenario.recordings:
        source = spec.file or "simulated"
        if spec.simulate is not None and spec.simulate.snr_db is not None:
            source = f"simulated, {spec.simulate.snr_db:g} dB"
        rows.append(Row((spec.name, ROLES[spec.role], source, findings.get(spec.name, ""))))
    return Table(RECORDING_COLUMNS, tuple(rows))
