"""Results of other settings and replaced work, on the page: named, and back with one press."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import viser

from flexgui.session.session import Session
from flexgui.session.state import STAGES
from tests.page.conftest import Desktop
from tests.page.helpers import SIZE, box, pick, press, sees, small
from tests.page.test_diagnose import few
from tests.session.helpers import until
from tests.session.test_other_settings import results

SIZES = (SIZE, {"width": 1280, "height": 720})
SETTLED = 2000
"""ms after which a stage stands, on a machine that draws without a graphics card."""


def shot(page: Any, name: str) -> None:
    """For eyes, where FLEXGUI_SHOTS names a folder."""
    folder = os.environ.get("FLEXGUI_SHOTS")
    for size in SIZES if folder else ():
        page.set_viewport_size(size)
        page.wait_for_timeout(SETTLED)
        page.screenshot(path=Path(folder or "") / f"earlier_{size['width']}_{name}.png")
    page.set_viewport_size(SIZE)


def ticked(page: Any, stage: str) -> bool:
    """Whether the stage has its tick."""
    button = page.get_by_role("button", name=stage, exact=True).first
    return "done" in str(button.get_attribute("class"))


def slide(page: Any, label: str, key: str) -> None:
    """One press of an arrow key on a slider of the shown stage."""
    found = page.locator(f"label:visible:text-is('{label}')").first.get_attribute("for")
    page.locator(f'[id="{found}"]').get_by_role("slider").press(key)


def says(page: Any, text: str) -> bool:
    """Whether the shown stage says it."""
    return bool(page.locator(f".fx p:visible:has-text('{text}')").count())


@pytest.mark.long
def test_one_key_press_and_one_back_leave_an_identification_as_it_was(
    page: Any, session: Session
) -> None:
    small(session)
    press(page, "Identify")
    press(page, "Start identification")
    sees(page, "EI (follows)")
    until(lambda: ticked(page, "Identify"))
    for label in ("ε [GPa]", "SNR [dB]"):
        press(page, "Arm")
        sees(page, "Next: take measurements")
        slide(page, label, "ArrowRight")
        until(lambda: not ticked(page, "Identify"))
        press(page, "Identify")
        until(lambda: says(page, "Made with "))
        shot(page, f"identify_{label[0]}")
        press(page, "Arm")
        sees(page, "Next: take measurements")
        slide(page, label, "ArrowLeft")
        until(lambda: ticked(page, "Identify"))
    press(page, "Identify")
    sees(page, "Start again")
    until(lambda: not says(page, "Made with "))


@pytest.fixture
def worked(session: Session) -> Session:
    """An identification and a diagnosis."""
    few(session)
    assert session.diagnosis.search()
    until(lambda: not session.run.busy and session.diagnosis.pending is None, 120.0)
    return session


@pytest.mark.long
def test_settings_that_moved_void_nothing_and_come_back_by_a_press(
    page: Any, worked: Session
) -> None:
    before = results(worked)
    press(page, "Arm")
    for label in ("ε [GPa]", "d [mm]", "θ2 [deg]"):
        box(page, label).fill({"ε": "1.2", "d": "51", "θ": "80"}[label[0]])
    until(lambda: not ticked(page, "Diagnose"))
    for stage in ("Diagnose", "Compare", "Identify", "Export"):
        press(page, stage)
        until(lambda: says(page, "Made with ε = 1"))
        shot(page, f"moved_{stage}")
    press(page, "Diagnose")
    sees(page, "Models of this session")
    press(page, "Arm")
    for label, old in (("ε [GPa]", "1"), ("d [mm]", "50")):
        box(page, label).fill(old)
    until(lambda: ticked(page, "Diagnose") and ticked(page, "Identify"))
    assert results(worked)[:8] == before[:8]
    box(page, "ε [GPa]").fill("1.2")
    press(page, "Diagnose")
    press(page, "Back to these settings")
    until(lambda: ticked(page, "Diagnose") and ticked(page, "Identify"))
    assert results(worked)[:8] == before[:8]


@pytest.mark.long
def test_a_scenario_that_is_opened_over_work_gives_it_back(page: Any, worked: Session) -> None:
    before = results(worked)
    press(page, "Data")
    pick(page, "Scenario", "demo")
    press(page, "Open this scenario")
    until(lambda: says(page, "Your earlier work, “An arm with a hidden effect”, is kept."))
    shot(page, "replaced")
    press(page, "Diagnose")
    shot(page, "replaced_Diagnose")
    press(page, "Back to it")
    until(lambda: worked.identification.current is not None)
    assert results(worked)[:8] == before[:8]
    until(lambda: not says(page, "Your earlier work"))


NO_SETTING = ("Action", "Add")
"""What is pressed in the page's own HTML, and a list that adds what it offers."""


def inputs(desktop: Desktop) -> Iterator[tuple[tuple[str, int], Any]]:
    """Label, place among those with it, and handle of all that a person can set."""
    places: Counter[str] = Counter()
    for handle in tuple(desktop.pages[-1].gui._gui_input_handle_from_uuid.values()):
        label = getattr(handle, "label", "")
        is_set = hasattr(handle, "options") or isinstance(handle.value, bool | int | float | tuple)
        pressed = isinstance(handle, viser.GuiButtonHandle | viser.GuiUploadButtonHandle)
        if handle._impl.update_cb and is_set and not pressed and label not in NO_SETTING:
            yield (label, places[label]), handle
            places[label] += 1


def another(handle: Any) -> Any:
    """A value beside the present one."""
    value = handle.value
    if hasattr(handle, "options"):
        return handle.options[(handle.options.index(value) + 1) % len(handle.options)]
    if isinstance(value, bool):
        return not value
    step = getattr(handle, "step", None) or 1
    if isinstance(value, tuple):
        return (value[0], value[1] + step)
    most = getattr(handle, "max", None)
    return value - step if most is not None and value + step > most else value + step


def enter(desktop: Desktop, handle: Any, value: Any) -> None:
    """As when a browser sends it."""
    handle.value = value
    client = desktop.pages[-1].context.client
    for call in handle._impl.update_cb:
        call(viser.GuiEvent(client, client.client_id, handle))


@pytest.mark.long
def test_every_input_that_is_changed_and_changed_back_leaves_all_results(
    page: Any, worked: Session, desktop: Desktop
) -> None:
    before, changed = results(worked)[:8], set()
    for stage in STAGES:
        press(page, stage)
        page.wait_for_timeout(SETTLED)
    for label, place in dict(inputs(desktop)):
        handle = dict(inputs(desktop))[label, place]
        old = handle.value
        enter(desktop, handle, another(handle))
        assert worked.wait_idle()
        changed |= {label} if worked.document.scenario != before[0] else set()
        enter(desktop, dict(inputs(desktop))[label, place], old)
        assert worked.wait_idle()
        assert results(worked)[:8] == before, label
    assert {"ε [GPa]", "d [mm]", "SNR [dB]", "Method", "Output", "Seed", "Modes 1"} <= changed
