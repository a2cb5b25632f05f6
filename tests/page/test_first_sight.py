"""What a first visitor meets: two ways to begin, the system's theme, and keys for the time-line."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import viser

from flexgui.page.in_browser import PURPOSE, asset
from flexgui.page.layout import DARK
from flexgui.server.access import LONGEST_CURTAIN, SLOW, behind_curtain
from flexgui.session.session import Session
from flexgui.views.colours import RISING, RISING_ON_DARK
from tests.page.conftest import Desktop
from tests.page.helpers import press, ready, sees, still, visit
from tests.session.helpers import until

SCHEME = "document.documentElement.dataset.mantineColorScheme === '{}'"
BORDER = 4.0
"""px of a frame, at most."""


def test_the_tour_and_the_own_recordings_stand_side_by_side(page: Any) -> None:
    sees(page, PURPOSE)
    boxes = [
        page.get_by_role("button", name=name).bounding_box()
        for name in ("Begin the tour", "Open my recordings")
    ]
    assert boxes[0]["y"] == boxes[1]["y"]
    assert boxes[0]["x"] + boxes[0]["width"] < boxes[1]["x"]


@pytest.mark.long
def test_a_closed_folder_is_a_row_and_a_single_tab_needs_no_bar(page: Any) -> None:
    title = page.get_by_role("button", name="More about the arm")
    row, frame = title.bounding_box(), title.locator("..").bounding_box()
    assert frame["height"] <= row["height"] + 2.0 * BORDER
    title.click()
    until(lambda: title.locator("..").bounding_box()["height"] > 2.0 * row["height"])
    assert page.get_by_role("tab").count() == 0


@pytest.mark.long
def test_open_plots_fit_a_phone(page: Any) -> None:
    """They made every panel twice as wide as the screen, and wider with each drawing."""
    page.set_viewport_size({"width": 390, "height": 844})
    page.get_by_text("Plots", exact=True).first.click()
    still(page)
    widths = page.evaluate(
        "[...document.querySelectorAll('.uplot, .fx')].map(e => e.getBoundingClientRect().width)"
    )
    assert widths and max(widths) <= 390


@pytest.mark.long
def test_the_systems_theme_is_followed_and_a_choice_is_kept(
    desktop: Desktop, chromium: Any, session: Session
) -> None:
    with visit(chromium, desktop.address, color_scheme="dark") as shown:
        shown.wait_for_function(SCHEME.format("dark"))
        desktop.pages[-1].context.theme.choose("light")
        shown.wait_for_function(SCHEME.format("light"))
        shown.reload()
        ready(shown)
        shown.wait_for_function(SCHEME.format("light"))
        assert desktop.pages[-1].context.theme.chosen == "light" != DARK


@pytest.mark.long
def test_space_plays_and_arrows_step(page: Any, session: Session) -> None:
    press(page, "Data")
    page.locator("#fx-line .play").wait_for()
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press(" ")
    until(lambda: session.playback.cursor.playing and session.playback.cursor.time > 0.0)
    page.keyboard.press(" ")
    until(lambda: not session.playback.cursor.playing)
    stands = session.playback.cursor.time
    page.keyboard.press("ArrowRight")
    until(lambda: session.playback.cursor.time > stands)
    stepped = session.playback.cursor.time
    page.keyboard.press("ArrowLeft")
    until(lambda: session.playback.cursor.time < stepped)


SENT = "window.fxLine = (shown => state => shown(window.fxSent = state))(window.fxLine)"


@pytest.mark.long
def test_the_key_of_colours_follows_the_theme(
    desktop: Desktop, chromium: Any, session: Session
) -> None:
    with visit(chromium, desktop.address) as shown:
        press(shown, "Data")
        until(lambda: session.playback.motion is not None)
        still(shown)
        shown.evaluate(SENT)
        for theme, scale in (("dark", RISING_ON_DARK), ("light", RISING)):
            desktop.pages[-1].context.theme.choose(theme)
            shown.wait_for_function(f"window.fxSent?.colours?.endsWith('{scale[-1][1]}')")


@pytest.mark.long
def test_every_slider_and_icon_has_a_name(page: Any) -> None:
    page.wait_for_function(
        """() => [...document.querySelectorAll('[role=slider], button, input[inputmode]')]
          .every(e => e.getAttribute('aria-label') || e.innerText?.trim() || e.labels?.length)"""
    )


def test_the_curtain_is_the_first_thing_of_the_body() -> None:
    made = behind_curtain(b"<html><title>Viser</title><body><div id='root'></div>")
    text = made.decode()
    assert "<title>FlexGUI</title>" in text
    assert text.index("fx-curtain") < text.index("id='root'") and PURPOSE in text


LABEL_GROUND = """() => {
  const gl = document.createElement('canvas').getContext('webgl2', {preserveDrawingBuffer: true});
  const program = gl.createProgram();
  for (const [kind, text] of [
    [gl.VERTEX_SHADER, `void main() {
      gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
      gl_PointSize = 8.0;
    }`],
    [gl.FRAGMENT_SHADER, `precision highp float; const float vAlpha = 1.0;
      void main() { gl_FragColor = vec4(1.0, 1.0, 1.0, 0.85 * vAlpha); }`],
  ]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  return ['light', 'dark'].map(theme => {
    document.documentElement.setAttribute('data-mantine-color-scheme', theme);
    gl.useProgram(program);
    gl.drawArrays(gl.POINTS, 0, 1);
    const pixel = new Uint8Array(4);
    gl.readPixels(gl.drawingBufferWidth / 2, gl.drawingBufferHeight / 2, 1, 1, gl.RGBA,
      gl.UNSIGNED_BYTE, pixel);
    return [...pixel];
  });
}"""


def test_the_ground_of_texts_in_the_picture_is_translucent_and_dark_on_a_dark_page(
    chromium: Any,
) -> None:
    client = Path(viser.__file__).parent / "client" / "src" / "label" / "LabelRenderer.tsx"
    source = client.read_text(encoding="utf-8")
    replaced = re.findall(r'(?:GROUND|INK) = "([^"]+)"', asset("labels.js"))
    assert [source.count(colour) for colour in replaced] == [1, 1], "as the script expects it"
    page = chromium.new_page()
    page.set_content(behind_curtain(b"<html><body></body></html>").decode())
    light, dark = page.evaluate(LABEL_GROUND)
    page.close()
    assert light[0] > 240 and dark[0] < 50
    assert all(90 < pixel[3] < 150 for pixel in (light, dark))


def test_an_empty_page_stays_covered_however_long_it_takes(chromium: Any) -> None:
    context = chromium.new_context()
    page = context.new_page()
    page.clock.install()
    page.set_content(behind_curtain(b"<html><body></body></html>").decode())
    page.clock.fast_forward(LONGEST_CURTAIN + 1000)
    sees(page, SLOW)
    assert page.locator("#fx-curtain").is_visible()
    page.evaluate("document.body.insertAdjacentHTML('beforeend', '<div class=fx-bar></div>')")
    page.clock.fast_forward(1000)
    page.locator("#fx-curtain").wait_for(state="detached")
    context.close()
