"""The sliders of an arm: which there are depends on its kind."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

from core.arm.arm import Arm
from core.arm.build import build_arm
from core.drives.drive import Drive, DriveSlider, drive_classes
from flexgui.panels import widgets
from flexgui.panels.page_context import PageContext
from flexgui.panels.rebuilt import Rebuilt
from flexgui.session.edit import arm_setting, put

Limits = tuple[float, float, float]
"""(least, greatest, step)"""

THETA2: Limits = (5.0, 175.0, 0.5)
"""deg; stretched and folded arms have no fictitious rigid arm."""

SPAN = 4.0
"""A slider reaches from a quarter to four times a value that usual limits do not hold."""


class ArmSliders:
    """Sliders above the fold and those under 'more'; made anew for another kind of arm."""

    def __init__(self, desk: PageContext, first: Any, more: Any) -> None:
        self._desk = desk
        self._scenario, self._built = desk.session.scenario, build_arm(desk.session.scenario.arm)
        self._first, self._more = Rebuilt(desk, first), Rebuilt(desk, more)
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
        scenario = self._desk.session.scenario
        if scenario is not self._scenario:
            self._scenario, self._built = scenario, build_arm(scenario.arm)
        return self._built

    @property
    def _drive_sliders(self) -> tuple[DriveSlider, ...]:
        """Those that the class of the scenario's drive names."""
        kind = self._desk.session.scenario.drive.kind
        return drive_classes().get(kind, Drive).sliders

    def _stated(self, slider: DriveSlider) -> list[float]:
        """One number per joint; none where the scenario leaves the setting out."""
        return list(self._desk.session.scenario.drive.options.get(slider.setting) or ())

    def _build_first(self) -> None:
        desk, session, arm = self._desk, self._desk.session, self._arm
        if arm.joints > 1:
            widgets.slider(
                desk, "θ2 [deg]", THETA2, lambda: round(math.degrees(session.live.theta2), 3),
                lambda deg: session.set_live(theta2=math.radians(deg)),
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
                    self._desk, f"{one.letter}{k + 1} [{one.unit}]", around(value, one.limits),
                    partial(self._gain, one, k), partial(self._put_gain, one, k), one.hint,
                )  # fmt: skip

    def _shared(self, label: str, name: str, unit: float, limits: Limits, hint: str) -> None:
        """One value for all segments."""
        session = self._desk.session

        def get() -> float:
            return float(getattr(self._arm.segments[0], name) or unit) / unit

        def change(value: float) -> bool:
            return session.slide(arm_setting(session.scenario, name, value * unit))

        widgets.slider(self._desk, label, around(get(), limits), get, change, hint)

    def _own(self, k: int, label: str, name: str, limits: Limits, hint: str) -> None:
        """One segment's value."""
        session, whole = self._desk.session, isinstance(limits[0], int)

        def get() -> float:
            segments = self._arm.segments
            return float(getattr(segments[k], name) or 0.0) if k < len(segments) else limits[0]

        def change(value: float) -> bool:
            values = [getattr(s, name) for s in self._arm.segments]
            if k >= len(values) or None in values:
                return False
            values[k] = int(value) if whole else value
            # Another number of modes is compiled first, so that is kept at once.
            put_in = session.change if whole else session.slide
            return put_in(arm_setting(session.scenario, name, values))

        shown = limits if whole else around(get(), limits)
        widgets.slider(self._desk, label, shown, get, change, hint)

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
        return self._desk.session.slide(put(("drive", one.setting), values))


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
