"""First stage: the arm under the sliders."""

from __future__ import annotations

from typing import Any, ClassVar, cast

import numpy as np
from markupsafe import Markup

from core.results import DescriptorModel
from flexgui.panels import widgets
from flexgui.panels.arm_sliders import ArmSliders
from flexgui.panels.page_context import PageContext
from flexgui.panels.panel import Panel
from flexgui.panels.plot import Plot
from flexgui.panels.theme import THEMES
from flexgui.panels.words import Words, joined, paragraph
from flexgui.session import Topic
from flexgui.session.tour_card import holds_way_on
from flexgui.views.chart import chart
from flexgui.views.html import html_equations, html_matrices, html_table
from flexgui.views.layout import Figure
from flexgui.views.poles import mode_table, poles
from flexgui.views.responses import frequency_response, noisy_step, phase_response
from flexgui.views.table import affine, matrices

NO_NOISE_DB = 60
"""The slider's end: no noise at all."""

STILL, MODES = "none", 6

HEIGHT = 210
"""px of a chart, without its title and legend: all three plots fit on a usual screen."""

ABOUT = "Move a slider: the arm, its poles and its responses follow at once."


class ArmPanel(Panel):
    """Sliders on the right; step, frequency response and poles on the left."""

    kind: ClassVar[str] = "Arm"
    topics: ClassVar[frozenset[Topic]] = frozenset({Topic.LIVE, Topic.TOUR})

    def build_controls(self) -> None:
        desk, session = self.desk, self.desk.session
        self._title = Words(desk.gui)
        self._shown_equations: object = None
        self._shown_matrices: object = None
        first = desk.gui.add_folder(None)
        widgets.slider(
            desk, "SNR [dB]", (0, NO_NOISE_DB, 1), self._snr, self._put_snr,
            "Noise of the simulated experiments; at the right end there is none.",
        )  # fmt: skip
        widgets.slider(
            desk, "Exaggerate", (1, 50, 1), lambda: session.live.exaggeration,
            lambda v: session.set_live(exaggeration=v), "Enlarges the drawn deflection.",
        )  # fmt: skip
        self._next = widgets.button(
            desk, "Next: take measurements", lambda: session.show("Data"), prominent=True
        )
        widgets.choice(
            desk, "Vibration", (STILL, *(f"mode {k + 1}" for k in range(MODES))), self._mode,
            self._put_mode, "Plays a mode of this posture, slowly.",
        )  # fmt: skip
        self._modes = Words(desk.gui)
        with desk.gui.add_folder("More about the arm", expand_by_default=False):
            more = desk.gui.add_folder(None)
            widgets.choice(
                desk, "Page colours", THEMES, lambda: desk.theme.chosen, desk.theme.choose,
                "This browser keeps it.",
            )  # fmt: skip
        self._sliders = ArmSliders(desk, first, more)
        with desk.gui.add_folder("Equations of this model", expand_by_default=False):
            self._equations = Words(desk.gui)
        with desk.gui.add_folder("Matrices E0, E1, A, B", expand_by_default=False):
            self._matrices = Words(desk.gui)

    def _mode(self) -> str:
        mode = self.desk.session.live.mode
        return STILL if mode is None else f"mode {mode + 1}"

    def _put_mode(self, text: str) -> None:
        self.desk.session.set_live(mode=None if text == STILL else int(text.split()[1]) - 1)

    def _snr(self) -> float:
        snr = self.desk.session.live.snr_db
        return NO_NOISE_DB if snr is None else snr

    def _put_snr(self, value: float) -> None:
        snr = None if value >= NO_NOISE_DB else float(value)
        self.desk.session.set_noise(snr)

    def build_plots(self) -> None:
        gui = self.desk.gui
        self._about = Words(gui, paragraph(ABOUT, "soft"))
        self._step = Lines(self.desk, HEIGHT, "Step")
        self._response = Lines(self.desk, HEIGHT, "Magnitude")
        self._poles = Plot(gui, 0.46, "Poles")
        self._phase = Lines(self.desk, HEIGHT, "Phase")

    def refresh(self) -> None:
        session, view = self.desk.session, self.desk.session.view
        self._title.show(paragraph(session.scenario.title, "lead"))
        self._sliders.refresh()
        self._next.color = "gray" if holds_way_on(session) else "blue"
        if view is None:
            return
        self._step.show(noisy_step(view.step, view.noise))
        self._response.show(frequency_response(view.frequency))
        self._poles.show(poles(view.at.poles, view.modes, view.clamped))
        self._modes.show(html_table(mode_table(view.modes)))
        if view.equations is not self._shown_equations:
            self._shown_equations = view.equations
            self._equations.show(html_equations(view.equations))

    def settle(self) -> None:
        """What a hand on a slider need not wait for: the phase below the poles, the matrices."""
        view = self.desk.session.view
        if view is not None:
            self._phase.show(phase_response(view.frequency))
        if view is not None and view.scenario is not self._shown_matrices:
            self._shown_matrices = view.scenario
            self._matrices.show(_all_matrices(view.descriptor))


def _all_matrices(described: DescriptorModel) -> Markup:
    sums = joined(
        paragraph(affine("E", described.basis)), paragraph(affine("A", described.A_basis))
    )
    return joined(sums, html_matrices(matrices(described)))


PADDING = (6, 12, 0, 0)
"""px: above, right, below, left."""


class Lines:
    """One chart; hidden until there is something to draw."""

    def __init__(self, desk: PageContext, height: int, title: str) -> None:
        """`height` in px, without title and legend."""
        self._theme = desk.theme
        self._shown: Figure | None = None
        desk.theme.followers.append(self._recolour)
        nothing = np.array([0.0, 1.0])
        self._look: dict[str, Any] = {}
        self._handle = desk.gui.add_uplot(
            (nothing, nothing), ({}, {}), title=title, height=height, padding=PADDING, visible=False
        )

    def show(self, figure: Figure) -> None:
        """Draws a figure of lines over one common axis; one without any line hides the chart."""
        self._shown = figure
        if not figure["data"]:
            self._handle.visible = False
            return
        found = chart(figure, self._theme.dark)
        self._handle.data = found.data
        if found.look != self._look:
            self._look = found.look
            self._handle.series = cast(Any, found.look["series"])
            self._handle.scales = cast(Any, found.look["scales"])
            self._handle.axes = cast(Any, found.look["axes"])
        self._handle.visible = True

    def _recolour(self, dark: bool) -> None:
        """Text on a canvas follows no style sheet."""
        if self._shown is not None:
            self.show(self._shown)
