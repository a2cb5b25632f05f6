"""First stage: the arm under the sliders. Which there are depends on its kind."""

from __future__ import annotations

import math
from functools import partial
from typing import Any, ClassVar, cast

import numpy as np
from markupsafe import Markup

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.build import build_arm
from flexgui.core.drives.drive import Drive, DriveSlider, drive_classes
from flexgui.core.results import DescriptorModel
from flexgui.page import widgets
from flexgui.page.layout import THEMES
from flexgui.page.panel import PageContext, Panel
from flexgui.page.plot import Plot
from flexgui.page.widgets import Rebuilt, Words, joined, paragraph
from flexgui.session import Topic
from flexgui.session.edit import arm_setting, put
from flexgui.session.tour import holds_way_on
from flexgui.stages.arm.chart import chart
from flexgui.views.dynamics import frequency_response, mode_table, noisy_step, phase_response, poles
from flexgui.views.html import html_equations, html_matrices, html_table
from flexgui.views.layout import Figure
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
        context, session = self.context, self.context.session
        self._title = Words(context.gui)
        self._shown_equations: object = None
        self._shown_matrices: object = None
        first = context.gui.add_folder(None)
        widgets.slider(
            context, "SNR [dB]", (0, NO_NOISE_DB, 1), self._snr, self._put_snr,
            "Noise of the simulated experiments; at the right end there is none.",
        )  # fmt: skip
        widgets.slider(
            context, "Exaggerate", (1, 50, 1), lambda: session.document.live.exaggeration,
            lambda v: session.document.set_live(exaggeration=v), "Enlarges the drawn deflection.",
        )  # fmt: skip
        self._next = widgets.button(
            context, "Next: take measurements", lambda: session.show("Data"), prominent=True
        )
        widgets.choice(
            context, "Vibration", (STILL, *(f"mode {k + 1}" for k in range(MODES))), self._mode,
            self._put_mode, "Plays a mode of this posture, slowly.",
        )  # fmt: skip
        self._modes = Words(context.gui)
        with context.gui.add_folder("More about the arm", expand_by_default=False):
            more = context.gui.add_folder(None)
            widgets.choice(
                context, "Page colours", THEMES, lambda: context.theme.chosen, context.theme.choose,
                "This browser keeps it.",
            )  # fmt: skip
        self._sliders = ArmSliders(context, first, more)
        with context.gui.add_folder("Equations of this model", expand_by_default=False):
            self._equations = Words(context.gui)
        with context.gui.add_folder("Matrices E0, E1, A, B", expand_by_default=False):
            self._matrices = Words(context.gui)

    def _mode(self) -> str:
        mode = self.context.session.document.live.mode
        return STILL if mode is None else f"mode {mode + 1}"

    def _put_mode(self, text: str) -> None:
        self.context.session.document.set_live(
            mode=None if text == STILL else int(text.split()[1]) - 1
        )

    def _snr(self) -> float:
        snr = self.context.session.document.live.snr_db
        return NO_NOISE_DB if snr is None else snr

    def _put_snr(self, value: float) -> None:
        snr = None if value >= NO_NOISE_DB else float(value)
        self.context.session.document.set_noise(snr)

    def build_plots(self) -> None:
        gui = self.context.gui
        self._about = Words(gui, paragraph(ABOUT, "soft"))
        self._step = Lines(self.context, HEIGHT, "Step")
        self._response = Lines(self.context, HEIGHT, "Magnitude")
        self._poles = Plot(gui, 0.46, "Poles")
        self._phase = Lines(self.context, HEIGHT, "Phase")

    def refresh(self) -> None:
        session, view = self.context.session, self.context.session.document.view
        self._title.show(paragraph(session.document.scenario.title, "lead"))
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
        view = self.context.session.document.view
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

    def __init__(self, context: PageContext, height: int, title: str) -> None:
        """`height` in px, without title and legend."""
        self._theme = context.theme
        self._shown: Figure | None = None
        context.theme.followers.append(self._recolour)
        nothing = np.array([0.0, 1.0])
        self._look: dict[str, Any] = {}
        self._handle = context.gui.add_uplot(
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


Limits = tuple[float, float, float]
"""(least, greatest, step)"""

THETA2: Limits = (5.0, 175.0, 0.5)
"""deg; stretched and folded arms have no fictitious rigid arm."""

SPAN = 4.0
"""A slider reaches from a quarter to four times a value that usual limits do not hold."""


class ArmSliders:
    """Sliders above the fold and those under 'more'; made anew for another kind of arm."""

    def __init__(self, context: PageContext, first: Any, more: Any) -> None:
        self._context = context
        self._scenario, self._built = (
            context.session.document.scenario,
            build_arm(context.session.document.scenario.arm),
        )
        self._first, self._more = Rebuilt(context, first), Rebuilt(context, more)
        self.refresh()

    def refresh(self) -> None:
        """Nothing where the arm is of the same kind."""
        arm, gains = self._arm, [(s.setting, len(self._stated(s))) for s in self._drive_sliders]
        segments = [(s.joint, s.has_section, s.EI is not None) for s in arm.segments]
        shape = (arm.name, segments, gains)
        self._first.make(shape, self._build_first)
        self._more.make(shape, self._build_more)

    @property
    def _arm(self) -> Arm:
        """Built once per scenario: every slider asks for it after every change."""
        scenario = self._context.session.document.scenario
        if scenario is not self._scenario:
            self._scenario, self._built = scenario, build_arm(scenario.arm)
        return self._built

    @property
    def _drive_sliders(self) -> tuple[DriveSlider, ...]:
        """Those that the class of the scenario's drive names."""
        kind = self._context.session.document.scenario.drive.kind
        return drive_classes().get(kind, Drive).sliders

    def _stated(self, slider: DriveSlider) -> list[float]:
        """One number per joint; none where the scenario leaves the setting out."""
        return list(self._context.session.document.scenario.drive.options.get(slider.setting) or ())

    def _build_first(self) -> None:
        context, document, arm = self._context, self._context.session.document, self._arm
        if arm.joints > 1:
            widgets.slider(
                context, "θ2 [deg]", THETA2, lambda: round(math.degrees(document.live.theta2), 3),
                lambda deg: document.set_live(theta2=math.radians(deg)),
                "Working point: the angle of the second joint.",
            )  # fmt: skip
        if arm.segments[0].has_section:
            self._shared("ε [GPa]", "young_modulus", 1e9, (0.2, 3.0, 0.01), "Young modulus.")
            self._shared("d [mm]", "width", 1e-3, (20.0, 80.0, 0.1), "Section's width.")
        for k, segment in enumerate(arm.segments):
            if segment.EI is not None:
                self._own(k, f"EI{k + 1} [N m²]", "EI", (1.0, 1.0, 1.0), "Bending stiffness.")

    def _build_more(self) -> None:
        arm = self._arm
        for k in range(arm.joints):
            n = k + 1
            if arm.segments[k].has_section or arm.segments[k].EI is not None:
                self._own(k, f"Modes {n}", "modes", (0, 3, 1), "Bending modes.")
            self._own(k, f"l{n} [m]", "length", (0.1, 1.5, 0.01), "Length.")
            self._own(k, f"m{n} [kg]", "mass", (0.1, 20.0, 0.1), "Mass.")
        last = arm.joints - 1
        self._own(last, "Tip mass [kg]", "tip_mass", (0.0, 5.0, 0.05), "At the end effector.")
        for one in self._drive_sliders:
            for k, value in enumerate(self._stated(one)):
                widgets.slider(
                    self._context, f"{one.letter}{k + 1} [{one.unit}]", around(value, one.limits),
                    partial(self._gain, one, k), partial(self._put_gain, one, k), one.hint,
                )  # fmt: skip

    def _shared(self, label: str, name: str, unit: float, limits: Limits, hint: str) -> None:
        """One value for all segments."""
        session = self._context.session

        def get() -> float:
            return float(getattr(self._arm.segments[0], name) or unit) / unit

        def change(value: float) -> bool:
            return session.document.slide(
                arm_setting(session.document.scenario, name, value * unit)
            )

        widgets.slider(self._context, label, around(get(), limits), get, change, hint)

    def _own(self, k: int, label: str, name: str, limits: Limits, hint: str) -> None:
        """One segment's value."""
        session, whole = self._context.session, isinstance(limits[0], int)

        def get() -> float:
            segments = self._arm.segments
            return float(getattr(segments[k], name) or 0.0) if k < len(segments) else limits[0]

        def change(value: float) -> bool:
            values = [getattr(s, name) for s in self._arm.segments]
            if k >= len(values) or None in values:
                return False
            values[k] = int(value) if whole else value
            # Another number of modes is compiled first, so that is kept at once.
            put_in = session.document.change if whole else session.document.slide
            return put_in(arm_setting(session.document.scenario, name, values))

        shown = limits if whole else around(get(), limits)
        widgets.slider(self._context, label, shown, get, change, hint)

    def _gain(self, one: DriveSlider, k: int) -> float:
        """0 where another drive, with rows of gains, has come and this is not rebuilt yet."""
        values = self._stated(one)
        value = values[k] if k < len(values) else 0.0
        return float(value) if isinstance(value, int | float) else 0.0

    def _put_gain(self, one: DriveSlider, k: int, value: float) -> bool:
        values = self._stated(one)
        if k >= len(values):
            return False
        values[k] = float(value)
        return self._context.session.document.slide(put(("drive", one.setting), values))


def around(value: float, limits: Limits) -> Limits:
    """The usual limits where they hold the value, else some about it with a fitting step."""
    low, high, _ = limits
    if low < high and low <= value <= high:
        return limits
    size = abs(value) or 1.0
    step = 10.0 ** math.floor(math.log10(size) - 1.5)
    return (_rounded(value / SPAN, step), _rounded(value * SPAN, step), step)


def _rounded(value: float, step: float) -> float:
    return round(math.ceil(value / step) * step, 9)
