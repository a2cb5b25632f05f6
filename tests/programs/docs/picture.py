"""The picture of the page and the film of the falling error.

`python -m tests.programs.docs.picture`.

A hidden effect on short recordings, found and then added: ladder, missing torque with the law of
the first candidate, the arm in the colours of its error, and the ranking.
"""

from __future__ import annotations

import io
import shutil
import tempfile
from pathlib import Path
from typing import Any

import viser
from PIL import Image

from flexgui.jobs import JobPool
from flexgui.session.session import Session
from tests.conftest import ROOT, headless_browser
from tests.page.conftest import offered
from tests.page.helpers import SIZE
from tests.page.test_diagnose import few
from tests.page.test_walk import Served, finish

FOLDER = ROOT / "docs" / "pictures"
PICTURE, FILM = FOLDER / "page.png", FOLDER / "fall.gif"
SETTLED = 4000
"""ms after which everything is drawn, without a graphics card too."""
AT = 0.4
"""s of the recording, where the arm is bent and fails."""
ADD = "Add Coulomb friction"
HELD, WORKING, EACH = 2500, 250, 40
"""ms for which the first and the last picture stand, one of the fit, and one of the fall."""
FALL = 25
"""Pictures of the fall."""
SLOWER = 20.0
"""Times that the fall is slowed down while it is filmed: a picture takes longer than it lasts."""
SLOW = """slower => {
  const real = performance.now.bind(performance), since = real();
  performance.now = () => since + (real() - since) / slower;
  const next = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = draw => next(() => draw(performance.now()));
}"""
FALLS = """[...document.querySelectorAll('.js-plotly-plot')]
  .some(node => node.layout?.meta?.morph === 'x' && node.data[0].y.length > 1)"""
"""The new bar stands on the ladder."""
LONGEST = 300
"""Pictures until the model is fitted."""
WIDTH, SHADES = 960, 128
"""px and colours: a README's pictures are a few hundred KB."""


class Plain(Served):
    """Without viser's button to share."""

    def _connected(self, client: viser.ClientHandle) -> None:
        client.gui.configure_theme(show_logo=False, show_share_button=False)
        super()._connected(client)


def film(page: Any) -> None:
    """Adds the effect and watches the error fall."""
    page.evaluate(SLOW, SLOWER)
    shots, times = [page.screenshot()], [HELD]
    page.get_by_role("button", name=ADD, exact=True).first.click()
    for k in range(LONGEST):
        if page.evaluate(FALLS):
            break
        page.wait_for_timeout(WORKING)
        if k % 8 == 2:  # of the fit a few are enough
            shots.append(page.screenshot())
            times.append(WORKING)
    shots += [page.screenshot() for _ in range(FALL)]
    times += [EACH] * FALL
    page.get_by_text("Repeat diagnosis").wait_for()
    page.wait_for_timeout(SETTLED)
    save_film([*shots, page.screenshot()], [*times, HELD])


def save_film(shots: list[bytes], times: list[int]) -> None:
    """`times`: ms of each picture."""
    frames = [Image.open(io.BytesIO(shot)).convert("RGB") for shot in shots]
    size = (WIDTH, WIDTH * frames[0].height // frames[0].width)
    small = [frame.resize(size).quantize(SHADES) for frame in frames]
    small[0].save(FILM, save_all=True, append_images=small[1:], duration=times, loop=0)


def main() -> None:
    """Makes both."""
    folder = Path(tempfile.mkdtemp())
    (folder / "own").mkdir()
    with JobPool(2) as pool:
        desk = Plain(offered(pool))
        session = desk.session = Session("picture", folder / "own", desk.services)
        few(session)
        session.tour.set_step(None)
        finish(session, session.identification.start())
        finish(session, session.diagnosis.search())
        session.show("Diagnose")
        session.playback.move(time=AT)
        with headless_browser() as browser:
            page = browser.new_page(viewport=SIZE)
            page.goto(desk.address)
            page.get_by_role("button", name=ADD, exact=True).first.wait_for()
            page.wait_for_timeout(SETTLED)
            page.screenshot(path=PICTURE)
            film(page)
        desk.server.stop()
        session.close()
    shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
