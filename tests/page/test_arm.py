"""The first stage in a browser."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flexgui.core.scenario.read import read_scenario
from flexgui.library.shipped import shipped_folder
from flexgui.page.in_browser import PURPOSE
from flexgui.session.session import Session
from flexgui.stages.arm import panel as arm_panel
from tests.page.conftest import Desktop
from tests.page.helpers import (
    box,
    enter,
    labelled,
    plots,
    press,
    ready,
    redrawn,
    sees,
    shows,
    still,
)
from tests.session.helpers import until

SLIDERS = {"θ2 [deg]": "100", "ε [GPa]": "2", "d [mm]": "60", "SNR [dB]": "35"}
MORE = {
    "Modes 1": "0", "l1 [m]": "0.8", "m2 [kg]": "9", "Tip mass [kg]": "1",
    "λ1 [N m s/rad]": "120",
}  # fmt: skip
FADED = """() => [...new Set([...document.querySelectorAll('.js-plotly-plot, .uplot')].map(
  node => getComputedStyle(node).opacity < 1))]"""
"""Whether the figures are; one answer where all agree."""
BANNER = "You follow the teacher."
FIRST_OF_ITS_KIND = 60_000
"""ms: another number of modes is compiled once per machine."""


def beams(desktop: Desktop) -> np.ndarray:
    """Vertices of the arm as they were sent to the browser."""
    stage = desktop.pages[-1]._scene._stage
    assert stage is not None
    return np.concatenate(stage.pose.beams)


def moved(page: Any, desktop: Desktop, label: str, value: str, arm_too: bool = True) -> None:
    before, arm = plots(page), beams(desktop)
    enter(page, label, value)
    redrawn(page, before, FIRST_OF_ITS_KIND)
    if arm_too:  # it is drawn on its own, before the plots or after them
        until(lambda: not np.array_equal(beams(desktop), arm))


@pytest.mark.long
def test_each_slider_changes_the_plots_and_the_arm(
    page: Any, desktop: Desktop, session: Session
) -> None:
    still(page)
    for label, value in SLIDERS.items():
        moved(page, desktop, label, value, arm_too=label != "SNR [dB]")
    page.get_by_text("More about the arm", exact=True).click()
    for label, value in MORE.items():
        moved(page, desktop, label, value)
    assert session.document.scenario.arm.overrides["young_modulus"] == 2e9
    assert session.document.live.snr_db == 35


@pytest.mark.long
@pytest.mark.parametrize(
    ("typed", "said"), [("-5", "-5 is not"), ("", "That is not"), ("abc", "That is not")]
)
def test_what_is_no_number_of_a_slider_says_so_and_changes_nothing(
    page: Any, session: Session, typed: str, said: str
) -> None:
    still(page)
    given, slider = session.document.scenario, box(page, "ε [GPa]")
    before = slider.input_value()
    slider.click(click_count=3)
    page.keyboard.press("Delete")
    page.keyboard.type(typed)
    page.keyboard.press("Tab")
    sees(page, f"{said} a number from 0.2 to 3; still {before}.")
    shows(page, "ε [GPa]", before)
    assert session.document.scenario.arm == given.arm
    enter(page, "ε [GPa]", "2")
    slider.press("Enter")
    page.get_by_text("is not a number").wait_for(state="detached")
    until(lambda: session.document.scenario.arm.overrides.get("young_modulus") == 2e9)


@pytest.mark.long
def test_a_plot_that_cannot_be_drawn_says_so_and_looks_old_until_it_is(
    page: Any, desktop: Desktop, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise ZeroDivisionError

    still(page)
    arm = beams(desktop)
    with monkeypatch.context() as broken:
        broken.setattr(arm_panel, "poles", fails)
        enter(page, "θ2 [deg]", "100")
        sees(page, "Plots and tables could not be updated and may be old: a fault of FlexGUI")
        until(lambda: not np.array_equal(beams(desktop), arm))
        assert page.evaluate(FADED) == [True]
    enter(page, "θ2 [deg]", "80")
    page.get_by_text("could not be updated").wait_for(state="hidden")
    assert page.evaluate(FADED) == [False]


@pytest.mark.long
def test_exaggeration_bends_the_drawn_arm_only(page: Any, desktop: Desktop) -> None:
    before, arm = still(page), beams(desktop)
    enter(page, "Exaggerate", "50")
    until(lambda: not np.array_equal(beams(desktop), arm))
    assert still(page) == before


@pytest.mark.long
def test_an_arrow_key_moves_the_slider_and_not_the_view(page: Any, desktop: Desktop) -> None:
    before, camera = still(page), desktop.pages[-1].context.client.camera.position.copy()
    labelled(page, "θ2 [deg]").get_by_role("slider").focus()
    page.keyboard.press("ArrowRight", delay=200)
    until(lambda: plots(page) != before)
    assert np.array_equal(desktop.pages[-1].context.client.camera.position, camera)


@pytest.mark.long
def test_equations_and_matrices_are_rendered(page: Any) -> None:
    page.get_by_text("Equations of this model", exact=True).click()
    page.locator("math").first.wait_for()
    page.get_by_text("Matrices E0, E1, A, B", exact=True).click()
    sees(page, "E1, times cos(theta2)")


@pytest.mark.long
def test_a_mode_swings_the_arm(page: Any, desktop: Desktop, session: Session) -> None:
    session.document.set_live(mode=0)
    for _ in range(3):  # it goes on
        before = beams(desktop)
        until(lambda before=before: not np.array_equal(beams(desktop), before))  # type: ignore[misc]
    session.document.set_live(mode=None)
    until(lambda: not desktop.pages[-1]._scene._swings)


@pytest.mark.long
def test_a_follower_is_told_and_sees_the_stage_and_changes_nothing(
    page: Any, desktop: Desktop, session: Session
) -> None:
    sees(page, PURPOSE)
    assert not page.get_by_text(BANNER).count()
    desktop.read_only = True
    page.reload()
    sees(page, BANNER)
    sees(page, "Seven working points")
    press(page, "Data")
    page.wait_for_timeout(500)
    assert session.stage == "Arm"
    assert page.get_by_role("button", name="Next: take measurements").is_disabled()
    session.show("Data")
    sees(page, "7 to fit, 1 to validate.")


@pytest.mark.long
def test_a_controller_with_rows_of_gains_has_no_slider_of_them(
    page: Any, desktop: Desktop, session: Session
) -> None:
    """The bench in its own loop; its recording is not needed to look at its arm."""
    scenario = read_scenario(shipped_folder() / "bench_2dsfl_loop.toml")
    assert session.open(scenario)
    sees(page, scenario.title)
    page.reload()
    ready(page)
    page.get_by_text("EI2 [N m²]", exact=True).first.wait_for()
    still(page)
    moved(page, desktop, "θ2 [deg]", "100")
    page.get_by_text("More about the arm", exact=True).click()
    page.get_by_text("m2 [kg]", exact=True).first.wait_for()
    assert not page.get_by_text("λ1 [N m s/rad]").count()


ANOTHER_ARM = (
    ("l1 [m]", "0.6"), ("m1 [kg]", "3.2"), ("m2 [kg]", "1.6"), ("λ1 [N m s/rad]", "40"),
    ("λ1 [N m s/rad]", "60"), ("λ1 [N m s/rad]", "40"),
)  # fmt: skip
"""The axis of frequency becomes longer, shorter and longer."""


@pytest.mark.long
def test_charts_follow_an_arm_whose_axis_of_frequency_changes(page: Any) -> None:
    """uPlot looked for the numbers of an axis for ever, and kept the old curves."""
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.get_by_text("More about the arm", exact=True).click()
    for label, value in ANOTHER_ARM:
        before = still(page)
        enter(page, label, value)
        redrawn(page, before, FIRST_OF_ITS_KIND)
    assert not errors
