"""Every stage at four sizes of window, light and dark: nothing cut off or overlapping, no error in
the console, no serious fault of accessibility; screenshots to be looked at in FLEXGUI_SHOTS."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import viser

from flexgui.jobs import JobPool
from flexgui.page.in_browser import plotly_script, run_javascript
from flexgui.server.viser_patches import skip_plotly_upload
from flexgui.session.session import Session
from flexgui.session.state import STAGES
from tests.jobs.helpers import EVEN
from tests.page.conftest import Desktop, offered
from tests.page.helpers import press
from tests.page.test_diagnose import few
from tests.session.helpers import until

pytestmark = pytest.mark.long

SIZES = ((1600, 900), (1280, 720), (2560, 1440), (390, 844))
THEMES = ("light", "dark")
SETTLED = 2500
"""ms after which a stage stands, on a machine that draws without a graphics card."""
FOUND = 900.0
"""s for an identification and a diagnosis of two short recordings on a busy machine."""

BOXES = (Path(__file__).parent / "boxes.js").read_text(encoding="utf-8")
AXE = Path(__file__).parents[2] / ".venv" / "axe.min.js"
"""axe-core of the npm registry, put there by `make axe`; without it this part is left out."""
RULES = "axe.run(document, {runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa']})"
GRAVE = ("serious", "critical")
READY = "document.querySelector('.fx-bar') !== null"


class Served(Desktop):
    """Draws with the same Plotly as the server does."""

    def _connected(self, client: viser.ClientHandle) -> None:
        run_javascript(client, plotly_script())
        skip_plotly_upload(client)
        super()._connected(client)


@pytest.fixture(scope="module")
def walked(chromium: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """One session with recordings, a fit, and an effect that was found."""
    folder = tmp_path_factory.mktemp("walk")
    with JobPool(2, EVEN) as pool:
        desk = Served(offered(pool))
        (folder / "own").mkdir()
        session = desk.session = Session("walk", folder / "own", desk.services)
        few(session)
        finish(session, session.identification.start())
        finish(session, session.diagnosis.search())
        yield desk
        for page in desk.pages:
            page.close()
        desk.server.stop()
        session.close()


def finish(session: Session, begun: bool) -> None:
    assert begun
    until(lambda: not session.run.busy, FOUND)


@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def test_every_stage_can_be_shown(
    walked: Served, chromium: Any, size: tuple[int, int], theme: str, tmp_path: Path
) -> None:
    context = chromium.new_context(
        viewport={"width": size[0], "height": size[1]}, color_scheme=theme
    )
    context.set_default_timeout(60_000)
    page, errors = context.new_page(), []
    page.on("console", lambda said: errors.append(said.text) if is_fault(said) else None)
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(walked.address)
    page.wait_for_function(READY)
    shots = Path(os.environ.get("FLEXGUI_SHOTS", tmp_path))
    faults: dict[str, Any] = {}
    for stage in STAGES:
        press(page, stage)
        until(partial(shows, walked.session, stage))
        page.wait_for_timeout(SETTLED)
        page.screenshot(path=shots / f"{size[0]}_{theme}_{stage}.png")
        found = page.evaluate(BOXES)
        found += accessibility(page)
        if found:
            faults[stage] = found
    context.close()
    assert not errors
    assert not faults, "\n".join(f"{stage}: {each}" for stage, f in faults.items() for each in f)


def is_fault(said: Any) -> bool:
    """An error, or what Plotly warns of a figure that it cannot draw as told."""
    return said.type == "error" or said.text.startswith("WARN: ")


def shows(session: Session | None, stage: str) -> bool:
    return session is not None and session.stage == stage


def accessibility(page: Any) -> list[list[str]]:
    """Serious and critical faults that axe-core finds; none where it is not there."""
    if not AXE.exists():
        return []
    page.evaluate(AXE.read_text(encoding="utf-8"))
    return [
        [fault["id"], node["html"][:120], (node["any"] or [{}])[0].get("message", "")]
        for fault in page.evaluate(RULES)["violations"]
        if fault["impact"] in GRAVE
        for node in fault["nodes"][:4]
    ]


CUT = "<div style='width: 60px; overflow: hidden; white-space: nowrap'>much too long for it</div>"
SCROLLS = "<div style='width: 60px; overflow: auto; white-space: nowrap'>long, but it scrolls</div>"
ON = "<p style='position: absolute; top: 100px; left: 9px'>{}</p>"


def faults(chromium: Any, body: str) -> list[list[str]]:
    page = chromium.new_page()
    page.set_content(f"<body>{body}</body>")
    found = page.evaluate(BOXES)
    page.close()
    return list(found)


def test_what_is_cut_is_found_and_what_scrolls_is_not(chromium: Any) -> None:
    found = faults(chromium, CUT + SCROLLS)
    assert [fault[:2] for fault in found] == [["cut", "much too long for it"]]


def test_a_panel_that_scrolls_sideways_is_found(chromium: Any) -> None:
    panel = "<div class='mantine-ScrollArea-viewport' style='overflow: auto; width: 90px'>{}</div>"
    found = faults(chromium, panel.format("<div style='width: 98px'>a word</div>"))
    assert [fault[0] for fault in found] == ["sideways"]
    assert faults(chromium, panel.format("<div style='width: 90px'>a word</div>")) == []


def test_texts_on_one_another_are_found(chromium: Any) -> None:
    found = faults(chromium, ON.format("first words") + ON.format("other words"))
    assert found == [["overlap", "first words", "other words"]]
    assert faults(chromium, "<p>first words</p><p>other words</p>") == []
