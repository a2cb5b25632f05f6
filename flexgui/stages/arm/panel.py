"""First stage: the arm and its sliders. The drive's class decides which sliders there are."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
from markupsafe import Markup

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.build import build_arm
from flexgui.core.drives.drive import Drive, DriveSlider, drive_classes
from flexgui.core.results import DescriptorModel
from flexgui.page.panel import PageContext, PageElement, Panel
from flexgui.page.plot import Plot
from flexgui.page.widgets import (
    HtmlBlock,
    Limits,
    RebuiltFolder,
    button,
    choice,
    color,
    joined,
    noise_slider,
    paragraph,
    set_options,
    slider,
)
from flexgui.session.scenario_edits import set_arm, set_value
from flexgui.session.state import Topic
from flexgui.session.tour import card_has_button
from flexgui.stages.arm.chart import chart
from flexgui.views.dynamics import frequency_response, mode_table, noisy_step, phase_response, poles
from flexgui.views.layout import Figure
from flexgui.views.table import affine, html_equations, html_matrices, html_table, matrices

NO_MODE = "none"
ABOUT = "Move a slider: the arm, its poles and its responses follow at once."


class ArmPanel(Panel):
    """Sliders on the right; step, frequency response and poles on the left."""

    kind = "Arm"
    topics = frozenset({Topic.LIVE, Topic.TOUR})

    def build_controls(self) -> None:
        context, gui, document = self.context, self.gui, self.session.document
        self._title = HtmlBlock(gui)
        self._shown_equations: object = None
        self._shown_matrices: object = None
        first = RebuiltFolder(context)
        with gui.add_folder(None):  # as wide as the sliders above
            noise_slider(context, "Noise of the simulated experiments")
            slider(
                context, "Exaggerate", (1, 50, 1), lambda: document.live.exaggeration,
                lambda v: document.set_live(exaggeration=v), "Enlarges the drawn deflection.",
            )  # fmt: skip
        self._next = button(
            context, "Next: take measurements", lambda: self.session.show("Data"), prominent=True
        )
        self._vibration = choice(
            context, "Vibration", tuple(self._modes_by_name()), self._mode_name,
            lambda name: document.set_live(mode=self._modes_by_name().get(name)),
            "Plays a mode of this posture, slowly.",
        )  # fmt: skip
        self._modes = HtmlBlock(gui)
        with gui.add_folder("More about the arm", expand_by_default=False):
            more = RebuiltFolder(context)
        self._sliders = ArmSliders(context, first, more)
        with gui.add_folder("Equations of this model", expand_by_default=False):
            self._equations = HtmlBlock(gui)
        with gui.add_folder("Matrices E0, E1, A, B", expand_by_default=False):
            self._matrices = HtmlBlock(gui)

    def _modes_by_name(self) -> dict[str, int | None]:
        """The bending modes that the arm has, and none."""
        view = self.session.document.live_model
        count = 0 if view is None else len(view.modes)
        return {NO_MODE: None} | {f"mode {k + 1}": k for k in range(count)}

    def _mode_name(self) -> str:
        playing = self.session.document.live.mode
        return next((name for name, k in self._modes_by_name().items() if k == playing), NO_MODE)

    def build_plots(self) -> None:
        HtmlBlock(self.gui, paragraph(ABOUT, "soft"))
        self._step = Lines(self.context, "Step")
        self._response = Lines(self.context, "Magnitude")
        self._poles = Plot(self.context, 0.46, "Poles")
        self._phase = Lines(self.context, "Phase")

    def refresh(self) -> None:
        view = self.session.document.live_model
        self._title.show(paragraph(f"Scenario: {self.session.document.scenario.title}", "lead"))
        self._sliders.refresh()
        self._next.color = color(not card_has_button(self.session))
        if view is None:
            return
        set_options(self._vibration, tuple(self._modes_by_name()), self._mode_name())
        self._step.show(noisy_step(view.step, view.noise))
        self._response.show(frequency_response(view.frequency))
        self._poles.show(poles(view.at.poles, view.modes, view.clamped))
        self._modes.show(html_table(mode_table(view.modes)))

    def draw_slow_parts(self) -> None:
        """Updates what is slow: the phase below the poles, the matrices, the equations."""
        view = self.session.document.live_model
        if view is None:
            return
        self._phase.show(phase_response(view.frequency))
        if view.scenario is not self._shown_matrices:
            self._shown_matrices = view.scenario
            self._matrices.show(_all_matrices(view.descriptor))
        if view.equations is not self._shown_equations:
            self._shown_equations = view.equations
            self._equations.show(html_equations(view.equations))


def _all_matrices(described: DescriptorModel) -> Markup:
    sums = (affine("E", described.basis), affine("A", described.A_basis))
    return joined(*map(paragraph, sums), html_matrices(matrices(described)))


CHART_HEIGHT = 210
"""px of a chart, without its title: all three plots fit on a usual screen."""
PADDING = (6, 12, 0, 0)
"""px: above, right, below, left."""


class Lines:
    """One chart; hidden until there is something to draw."""

    def __init__(self, context: PageContext, title: str) -> None:
        self._theme = context.theme
        self._shown: Figure | None = None
        context.theme.callbacks.append(self._recolour)
        context.plot_area.plots.append(self)
        self._area = context.plot_area
        nothing = np.array([0.0, 1.0])
        self._look: dict[str, Any] = {}
        self._handle = context.gui.add_uplot(
            (nothing, nothing), ({}, {}), title=title, height=CHART_HEIGHT, padding=PADDING,
            visible=False,
        )  # fmt: skip
        self.fit()

    def fit(self) -> None:
        """Takes the height that suits the window."""
        if not self._handle._impl.removed:
            self._handle.height = round(CHART_HEIGHT * self._area.stretch)

    def show(self, figure: Figure) -> None:
        """Draws a figure of lines over one common axis; a figure without lines hides the chart."""
        self._shown = figure
        if not figure["data"]:
            self._handle.visible = False
            return
        drawing = chart(figure, self._theme.dark)
        self._handle.data = drawing.data
        if drawing.look != self._look:
            self._look = drawing.look
            for name, value in drawing.look.items():
                setattr(self._handle, name, value)
        self._handle.visible = True

    def _recolour(self, dark: bool) -> None:
        """Passes the theme on, as text on a canvas follows no style sheet."""
        if self._shown is not None:
            self.show(self._shown)


THETA2: Limits = (5.0, 175.0, 0.5)
"""deg; stretched and folded arms have no fictitious rigid arm."""

SPAN = 4.0
"""A slider reaches from a quarter to four times a value that usual limits do not hold."""

OF_EACH_SEGMENT: tuple[tuple[str, str, Limits, str], ...] = (
    ("l{} [m]", "length", (0.1, 1.5, 0.01), "Length."),
    ("m{} [kg]", "mass", (0.1, 20.0, 0.1), "Mass."),
)
"""Label, setting, limits, hint."""


class ArmSliders(PageElement):
    """Sliders above the fold and under 'more'; rebuilt for another kind of arm."""

    def __init__(self, context: PageContext, first: RebuiltFolder, more: RebuiltFolder) -> None:
        super().__init__(context)
        self._scenario: object = None
        self._first, self._more = first, more
        self._made_for: object = None
        self.refresh()

    def refresh(self) -> None:
        """Rebuilds the sliders if the kind of arm changed."""
        scenario = self.session.document.scenario
        if scenario is self._made_for:
            return
        self._made_for = scenario
        arm, gains = self._arm, [(s.setting, len(self._stated(s))) for s in self._drive_sliders]
        segments = [(s.joint, s.has_section, s.EI is not None) for s in arm.segments]
        shape = (arm.name, segments, gains)
        self._first.make(shape, self._build_first)
        self._more.make(shape, self._build_more)

    @property
    def _arm(self) -> Arm:
        """The scenario's arm, built once per scenario because every slider reads it."""
        scenario = self.session.document.scenario
        if scenario is not self._scenario:
            self._scenario, self._built = scenario, build_arm(scenario.arm)
        return self._built

    @property
    def _drive_sliders(self) -> tuple[DriveSlider, ...]:
        """The sliders that the drive's class defines."""
        kind = self.session.document.scenario.drive.kind
        return drive_classes().get(kind, Drive).sliders

    def _stated(self, slider: DriveSlider) -> list[float]:
        """The setting's value for each joint; empty if the scenario does not state it."""
        return list(self.session.document.scenario.drive.options.get(slider.setting) or ())

    def _build_first(self) -> None:
        document, arm = self.session.document, self._arm
        if arm.joints > 1:
            slider(
                self.context, "θ2 [deg]", THETA2,
                lambda: round(math.degrees(document.live.theta2), 3),
                lambda deg: document.set_live(theta2=math.radians(deg)),
                "Working point: the angle of the second joint.",
            )  # fmt: skip
        if arm.segments[0].has_section:
            self._of_arm("ε [GPa]", "young_modulus", (0.2, 3.0, 0.01), "Young modulus.", unit=1e9)
            self._of_arm("d [mm]", "width", (20.0, 80.0, 0.1), "Section's width.", unit=1e-3)
        for k, segment in enumerate(arm.segments):
            if segment.EI is not None:
                none_usual = (1.0, 1.0, 1.0)
                self._of_arm(f"EI{k + 1} [N m²]", "EI", none_usual, "Bending stiffness.", k)

    def _build_more(self) -> None:
        segments = self._arm.segments
        for k, segment in enumerate(segments):
            if segment.has_section or segment.EI is not None:
                self._of_arm(f"Modes {k + 1}", "modes", (0, 3, 1), "Bending modes.", k)
            for label, name, limits, hint in OF_EACH_SEGMENT:
                self._of_arm(label.format(k + 1), name, limits, hint, k)
        last = len(segments) - 1
        self._of_arm("Tip mass [kg]", "tip_mass", (0.0, 5.0, 0.05), "At the end effector.", last)
        for row in self._drive_sliders:
            for k, value in enumerate(self._stated(row)):
                slider(
                    self.context, f"{row.letter}{k + 1} [{row.unit}]", around(value, row.limits),
                    partial(self._gain, row, k), partial(self._put_gain, row, k), row.hint,
                )  # fmt: skip

    def _of_arm(
        self,
        label: str,
        name: str,
        limits: Limits,
        hint: str,
        k: int | None = None,
        unit: float = 1.0,
    ) -> None:
        """A slider for one segment's value; without `k` for all segments."""
        whole = isinstance(limits[0], int)

        def get() -> float:
            segments = self._arm.segments[k or 0 :]
            value = getattr(segments[0], name) if segments else None
            return limits[0] if value is None else value / unit

        shown = limits if whole else around(get(), limits)
        slider(
            self.context, label, shown, get,
            lambda v: self._put(name, int(v) if whole else v * unit, k), hint,
        )  # fmt: skip

    def _put(self, name: str, value: float, k: int | None) -> bool:
        document = self.session.document
        # Another number of modes is compiled first, so that is kept at once.
        dragging = not isinstance(value, int)
        if k is None:
            return document.change(set_arm(document.scenario, name, value), dragging=dragging)
        values = [getattr(segment, name) for segment in self._arm.segments]
        if k >= len(values) or None in values:
            return False
        edit = set_arm(document.scenario, name, [*values[:k], value, *values[k + 1 :]])
        return document.change(edit, dragging=dragging)

    def _gain(self, slider: DriveSlider, k: int) -> float:
        """The gain of joint k; 0 while the sliders are still those of another drive."""
        values = self._stated(slider)
        value = values[k] if k < len(values) else 0.0
        return float(value) if isinstance(value, int | float) else 0.0

    def _put_gain(self, slider: DriveSlider, k: int, value: float) -> bool:
        values = self._stated(slider)
        if k >= len(values):
            return False
        values[k] = float(value)
        edit = set_value(("drive", slider.setting), values)
        return self.session.document.change(edit, dragging=True)


def around(value: float, limits: Limits) -> Limits:
    """The usual limits if they contain the value, in their unit, else limits around it with a
    suitable step."""
    low, high, _ = limits
    if low < high and low <= value <= high:
        return limits
    size = abs(value) or 1.0
    step = 10.0 ** math.floor(math.log10(size) - 1.5)
    return (_rounded(value / SPAN, step), _rounded(value * SPAN, step), step)


def _rounded(value: float, step: float) -> float:
    return round(math.ceil(value / step) * step, 9)
