"""Second stage: simulate experiments or bring recordings, look at them, correct them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

from flexgui.core.arm.build import build_arm
from flexgui.core.excitation.excitation import Excitation
from flexgui.core.plugins import classes_of
from flexgui.core.scenario.schema import Scenario
from flexgui.page import widgets
from flexgui.page.panel import Panel
from flexgui.page.plot import Plot
from flexgui.page.tour import to_identification
from flexgui.page.widgets import Words, joined, paragraph
from flexgui.session import Topic
from flexgui.session.demo import scenario_choices
from flexgui.stages.data.experiments import Experiments, has_working_points
from flexgui.stages.data.panel_columns import ColumnChoice
from flexgui.stages.data.panel_own import Arrivals, RigChoice, upload_hint
from flexgui.stages.data.panel_recording import FindingList, OneRecording, wording_of
from flexgui.views.html import html_table
from flexgui.views.preview import preview
from flexgui.views.table import Column, Row, Table

NONE = "no recordings yet"
SIMULATE, UPLOAD = "Simulate experiments or upload a recording", "Upload a recording"
EMPTY = (
    "{}: its references and measurements appear here, with their units and anything unusual about "
    "them."
)
COLUMNS = (Column("Recording"), Column("Role"), Column("From"), Column("Check"))
ROLES = {"estimate": "to fit", "validate": "to validate"}


class DataPanel(Panel):
    """Where recordings come from, on the right; what the chosen one holds, on the left."""

    kind: ClassVar[str] = "Data"
    topics: ClassVar[frozenset[Topic]] = frozenset({Topic.SCENARIO, Topic.RECORDINGS})

    def build_controls(self) -> None:
        context, gui = self.context, self.context.gui
        self._wanted = Experiments()
        self._lead = Words(gui)
        self._next = widgets.button(
            context, "Next: identify", lambda: to_identification(context), prominent=True
        )
        # At the top, where what a file asks for will stand.
        with gui.add_folder("Use your own files"):
            self._own_controls()
        self._choice = widgets.choice(
            context, "Recording", self._names(), self._name, self._chosen, "Which one is shown."
        )
        self._findings = FindingList(context)
        self._one = OneRecording(context)
        self._arrived = Arrivals(context)
        self._columns = ColumnChoice(context)
        self._experiments = gui.add_folder("Simulate experiments")
        with self._experiments:
            self._simulate_controls()
        self._list = Words(gui)

    def _own_controls(self) -> None:
        context, gui = self.context, self.context.gui
        self._rig = RigChoice(context)
        self._upload = gui.add_upload_button(
            "Upload a recording or a scenario",
            hint=upload_hint(context.session.services),
            disabled=context.read_only,
            color="gray",
        )
        if not context.read_only:
            self._upload.on_upload(self._uploaded)
        self._pick = gui.add_dropdown("Scenario", tuple(scenario_choices()))
        widgets.button(
            context, "Open this scenario",
            lambda: context.session.choose(str(self._pick.value)),
        )  # fmt: skip

    def _names(self) -> tuple[str, ...]:
        return tuple(spec.name for spec in self.context.session.document.scenario.recordings) or (
            NONE,
        )

    def _name(self) -> str:
        names, name = self._names(), self.context.session.playback.cursor.recording
        return name if name in names else names[0]

    def _simulate_controls(self) -> None:
        context, document = self.context, self.context.session.document
        self._field("From θ2 [deg]", "first", 5.0, 175.0, 0.5, math.pi / 180.0)
        self._field("To θ2 [deg]", "last", 5.0, 175.0, 0.5, math.pi / 180.0)
        self._field("Points", "count", 1, 15, 1)
        self._field("Length [s]", "seconds", 0.2, 30.0, 0.1)
        kinds = tuple(classes_of("flexgui.core.excitation", Excitation))
        widgets.choice(
            context, "Excitation", kinds, lambda: self._wanted.excitation,
            lambda v: self._want(excitation=v), "Of the velocity references.",
        )  # fmt: skip
        self._field("Size [rad/s]", "amplitude", 0.01, 2.0, 0.01)
        widgets.slider(
            context, "SNR [dB]", (0, 60, 1), lambda: 60 if document.live.snr_db is None
            else document.live.snr_db, lambda v: document.set_noise(None if v >= 60 else float(v)),
            "Noise of the camera; at the right end there is none.",
        )  # fmt: skip
        self._field("Seed", "seed", 0, 10000, 1)
        widgets.switch(
            context, "With a sweep", lambda: self._wanted.sweep, lambda v: self._want(sweep=v),
            "A validation recording in which θ2 moves over the whole range.",
        )  # fmt: skip
        self._make = widgets.button(context, "Simulate these experiments", self._simulate)

    def _field(
        self, label: str, name: str, least: float, most: float, step: float, unit: float = 1.0
    ) -> None:
        whole = isinstance(least, int)

        def get() -> float:
            value = getattr(self._wanted, name) / unit
            return int(value) if whole else round(value, 6)

        widgets.number(
            self.context, label, get,
            lambda v: self._want(**{name: int(v) if whole else v * unit}), least, most, step,
        )  # fmt: skip

    def _want(self, **changes: Any) -> None:
        self._wanted = replace(self._wanted, **changes)

    def _simulate(self) -> None:
        session = self.context.session
        if session.document.change(self._wanted.edit(session.document.live.snr_db)):
            count = len(session.document.scenario.recordings)
            session.show_message(f"The scenario now has {count} recordings; one of them is shown.")

    def _uploaded(self, event: Any) -> None:
        file = event.target.value
        self.context.session.recordings.upload(file.name, file.content)

    def _chosen(self, name: str) -> bool:
        if name == NONE:
            return False
        self.context.session.playback.move(recording=name, time=0.0, playing=False)
        return True

    def build_plots(self) -> None:
        gui = self.context.gui
        self._about = Words(gui)
        self._plot = Plot(gui, 1.30)
        self._warnings = Words(gui)

    def refresh(self) -> None:
        session = self.context.session
        names = self._names()
        if self._choice.options != names:
            self._choice.options = names
        if self._choice.value != self._name():
            self._choice.value = self._name()
        specs = session.document.scenario.recordings
        fitted = sum(spec.role == "estimate" for spec in specs)
        self._lead.show(paragraph(f"{fitted} to fit, {len(specs) - fitted} to validate.", "lead"))
        findings = {spec.name: wording_of(session, spec.name) for spec in specs}
        self._list.show(html_table(listed(session.document.scenario, findings)))
        # Where nothing can be fitted yet, or a file waits for an answer, that comes first.
        asked = session.recordings.waiting is not None or session.recordings.arrived
        self._next.color = "blue" if fitted and not asked else "gray"
        self._findings.refresh(self._name())
        self._one.refresh()
        self._arrived.refresh()
        self._columns.refresh()
        self._rig.refresh()
        self._experiments.visible = offered = has_working_points(session.document.scenario)
        recording = session.playback.recording
        if recording is None or names == (NONE,):
            self._about.show(paragraph(EMPTY.format(SIMULATE if offered else UPLOAD), "soft"))
            self._plot.show(None)
            self._warnings.show("")
            return
        samples = f"{len(recording.time)} samples, {1.0 / recording.sample_time:.4g} Hz"
        self._about.show(paragraph(f"{recording.name}: {samples}.", "lead"))
        joints = build_arm(session.document.scenario.arm).segments
        slides = [segment.joint == "prismatic" for segment in joints]
        self._plot.show(preview(recording, slides), self._cursor())
        self._warnings.show(joined(*(paragraph(text, "soft") for text in recording.warnings)))

    def _cursor(self) -> float | None:
        session = self.context.session
        if session.playback.recording is None:
            return None
        return float(session.playback.recording.time[0]) + session.playback.cursor.time

    def move_cursor(self) -> None:
        self._plot.move_cursor(self._cursor())


def listed(scenario: Scenario, checked: Mapping[str, str] | None = None) -> Table:
    """The scenario's recordings; `checked`: name -> what the check says in a word."""
    findings = checked or {}
    rows = []
    for spec in scenario.recordings:
        source = spec.file or "simulated"
        if spec.simulate is not None and spec.simulate.snr_db is not None:
            source = f"simulated, {spec.simulate.snr_db:g} dB"
        rows.append(Row((spec.name, ROLES[spec.role], source, findings.get(spec.name, ""))))
    return Table(COLUMNS, tuple(rows))
